// One material without a scene, as the kernels that tabulate its BSDF see it (the entries bsdf_*.comp): material 0 in
// a frame whose z is the outward normal and whose x is the tangent. wo.z < 0 is inside a body that transmits; from
// there nothing is seen of other materials.

struct BsdfAlone {
    Surface s;
    float side;   // 1 outside, -1 inside: there y and z of the surface's own frame point the other way
    bool visible; // false: wo is behind a surface that does not transmit, or in its plane
};

// Into the frame in which the lobes see the surface from wo's side, and back.
vec3 bsdf_alone_turn(BsdfAlone alone, vec3 w) { return vec3(w.x, alone.side * w.yz); }

BsdfAlone bsdf_alone_make(vec3 wo) {
    Material m = material_load(0u);
    BsdfAlone alone;
    bool behind = wo.z < 0.0;
    alone.side = behind ? -1.0 : 1.0;
    alone.visible = wo.z > 0.0 || (behind && material_transmits(m));
#if HAS_ANISOTROPIC
    m.anisotropic_rotation *= alone.side; // it turns from u towards v on both sides, as in interaction_tangent
#endif
    alone.s = surface_make(m, vec2(1.0, 0.0));
    models_face(bsdf_alone_turn(alone, wo), behind, alone.s);
    return alone;
}
