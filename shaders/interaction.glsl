// What a path meets, before it is asked how it scatters: frame, material, bodies.
struct Interaction {
    vec3 wo;     // in the frame
    bool behind; // seen from the inner side of the geometry
    vec3 front;  // geometric normal on the viewer's side
    Basis basis;
    vec2 tangent;
    Material m;
#if HAS_NORMAL_MAPS
    bool mapped; // a map has bent a normal
#endif
#if HAS_COAT_NORMALS
    vec3 coat; // the coat's own normal, as the viewer sees it
#endif
#if HAS_ATTENUATION
    Medium beyond; // on the other side
#endif
};

Interaction interaction_make(inout Path path) {
    Interaction here;
    vec3 wo_w = -path.d;
    here.behind = dot(path.at.ng, wo_w) < 0.0;
    here.front = here.behind ? -path.at.ng : path.at.ng;
#if HAS_TEXTURES
    vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)];
    texture_look(path.at, texels);
#endif
#if HAS_COAT_NORMALS
    SurfacePoint coat_at = path.at;
    bool coat_mapped = texture_coat_normal(path.at, texels, coat_at.ns);
    here.coat = facing_normal(coat_at, wo_w);
#endif
#if HAS_NORMAL_MAPS
    here.mapped = texture_normal(path.at, texels, path.at.ns);
#endif
#if HAS_COAT_NORMALS
    here.mapped = here.mapped || coat_mapped;
#endif
    here.basis = frame_basis(facing_normal(path.at, wo_w));
    here.wo = frame_to_local(here.basis, wo_w);
    here.tangent = vec2(1.0, 0.0);
#if HAS_ANISOTROPIC
    vec2 along = vec2(dot(path.at.tangent, here.basis.x), dot(path.at.tangent, here.basis.y));
    float along2 = dot(along, along);
    if (along2 > 0.0) here.tangent = along * inversesqrt(along2);
#endif
#if HAS_TEXTURES
    here.m = texture_material(path.at, texels);
#else
    here.m = material_pick(path.at.material);
#endif
#if HAS_ANISOTROPIC
    // From u towards v, from whichever side it is seen: else a body's inside would not be its outside's mirror.
    here.m.anisotropic_rotation *= here.behind ? -path.at.handed : path.at.handed;
#endif
#if HAS_ATTENUATION
    vec3 rate = surface_attenuation(here.m);
    bool clear = surface_transmits(here.m);
    if (clear && here.behind && path.medium.depth < 0.5) {
        // The back of an open sheet: as if there had been a body all along.
        path.medium = medium_entered(path.medium, rate);
        if (path.bounce == 0u) path.throughput = medium_share(path.medium, path.hit.t);
    }
    here.beyond = path.medium;
    if (clear && here.behind) here.beyond = medium_left(path.medium, rate);
    if (clear && !here.behind) here.beyond = medium_entered(path.medium, rate);
#endif
    return here;
}

Surface interaction_surface(Interaction here) {
    Surface s = surface_make(here.m, here.tangent);
#if HAS_COAT_NORMALS
    s.coat = frame_basis(frame_to_local(here.basis, here.coat));
#endif
#if HAS_PRINCIPLED_LOBES
    principled_face(here.wo, here.behind, s);
#endif
    return s;
}

#if HAS_ATTENUATION
// A path that goes on towards d: on which side.
void interaction_cross(Interaction here, vec3 d, inout Path path) {
    if ((dot(path.at.ng, d) < 0.0) != here.behind) path.medium = here.beyond;
}
#endif
