// The cone around a path's ray, for the footprints of textures (material/footprint.glsl).
// The cone of a scattered ray grows by this part of the width of the directions that its density leaves to it.
const float CONE_SCATTER = 0.1;

struct Cone {
#if ANY_FOOTPRINTS
    float width;  // where the ray begins, or has met a surface, m; negative beyond a focus
    float spread; // the angle by which it grows, m/m
#else
    float unused; // a struct must have a member; every kernel passes cones on
#endif
};

// The cone of a camera's ray along d.
Cone cone_begin(vec3 d) {
#if ANY_FOOTPRINTS
    Cone cone;
    camera_cone(d, cone.width, cone.spread);
    return cone;
#else
    return Cone(0.0);
#endif
}

// The cone after t metres.
Cone cone_after(Cone cone, float t) {
#if ANY_FOOTPRINTS
    cone.width += cone.spread * t;
#endif
    return cone;
}

// A cone without any width, for lookups of single points.
Cone cone_none() {
#if ANY_FOOTPRINTS
    return Cone(0.0, 0.0);
#else
    return Cone(0.0);
#endif
}

#if HAS_TEXTURES
// Its footprint on the surface that it has met along d.
Footprint cone_footprint(Cone cone, SurfacePoint at, vec3 d) {
#if ANY_FOOTPRINTS
    return footprint_make(at, d, cone.width);
#else
    return footprint_none();
#endif
}
#endif

#if ANY_FOOTPRINTS
// The cone that goes on from a surface which curves by `bend`, 1/m, positive where the viewer sees a ball from outside.
// A mirror turns by twice what its normal turns; behind a boundary angles shrink by the index `eta` beyond it, over
// that before it. Paraxial, as in lenses.
Cone cone_bent(Cone cone, float bend, float eta, bool crosses) {
    float turned = bend * cone.width;
    cone.spread = crosses ? (cone.spread + turned) / eta - turned : cone.spread + 2.0 * turned;
    return cone;
}

// The cone of a direction of density `pdf`: the wider, the more directions it stands for.
Cone cone_scattered(Cone cone, float pdf) {
    float grown = CONE_SCATTER * inversesqrt(max(pdf, 1e-12));
    return Cone(abs(cone.width), max(cone.spread, 0.0) + grown);
}
#endif
