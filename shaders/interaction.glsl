// The point where a path meets a surface: its frame, its material and the bodies on both sides.
struct Interaction {
    vec3 wo;       // in the shading frame
    bool behind;   // it is seen from the inner side of the geometry
    vec3 front;    // the geometric normal on the viewer's side
    Basis basis;   // the shading frame
    vec2 tangent;  // the direction in it that anisotropy stretches along
    Material m;
    bool mapped;   // a normal map bends the normal of the base or of the coat
    vec3 coat;     // the coat's own normal, as the viewer sees it; only with HAS_COAT_NORMALS
    Medium beyond; // what lies on the other side
};

// Finds the bodies on both sides of the surface.
void interaction_media(inout Interaction here, inout Path path) {
#if HAS_ATTENUATION
    vec3 rate = surface_attenuation(here.m);
    bool clear = surface_transmits(here.m);
    if (clear && here.behind && path.medium.depth < 0.5) {
        // This is the back of an open sheet: the path is taken to have been inside a body all along.
        path.medium = medium_entered(path.medium, rate);
        if (path.bounce == 0u) path.throughput = medium_share(path.medium, path.hit.t);
    }
    here.beyond = path.medium;
    if (clear && here.behind) here.beyond = medium_left(path.medium, rate);
    if (clear && !here.behind) here.beyond = medium_entered(path.medium, rate);
#else
    here.beyond = path.medium;
#endif
}

// Finds the direction that anisotropy stretches along.
void interaction_tangent(SurfacePoint at, inout Interaction here) {
    here.tangent = vec2(1.0, 0.0);
#if HAS_ANISOTROPIC
    vec2 along = vec2(dot(at.tangent, here.basis.x), dot(at.tangent, here.basis.y));
    float along2 = dot(along, along);
    if (along2 > 0.0) here.tangent = along * inversesqrt(along2);
    // The angle turns from u towards v on both sides: else the inside of a body would not mirror its outside.
    here.m.anisotropic_rotation *= here.behind ? -at.handed : at.handed;
#endif
}

Interaction interaction_make(inout Path path) {
    Interaction here;
    vec3 wo_w = -path.d;
    here.behind = dot(path.at.ng, wo_w) < 0.0;
    here.front = here.behind ? -path.at.ng : path.at.ng;
    here.mapped = false;
#if HAS_TEXTURES
    vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)];
    texture_look(path.at, texels);
    here.m = texture_material(path.at, texels);
#else
    here.m = material_pick(path.at.material);
#endif
#if HAS_COAT_NORMALS
    SurfacePoint coat_at = path.at;
    here.mapped = texture_coat_normal(path.at, texels, coat_at.ns);
    here.coat = facing_normal(coat_at, wo_w);
#endif
#if HAS_NORMAL_MAPS
    here.mapped = texture_normal(path.at, texels, path.at.ns) || here.mapped;
#endif
    here.basis = frame_basis(facing_normal(path.at, wo_w));
    here.wo = frame_to_local(here.basis, wo_w);
    interaction_tangent(path.at, here);
    interaction_media(here, path);
    return here;
}

// The surface as seen from here.wo, ready for the lobes.
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

// The cosine between a direction and the normal that decides on which side of the surface it is.
float interaction_side(Interaction here, vec3 wi_w) {
    return here.mapped ? dot(wi_w, here.front) : dot(wi_w, here.basis.z);
}

// Whether wi_w is on the same side of the shading normal and of the surface itself.
bool interaction_agrees(Interaction here, vec3 wi_w) {
    return here.mapped || facing_agrees(dot(wi_w, here.basis.z), dot(wi_w, here.front));
}

// The medium that a ray towards wi_w goes through.
Medium interaction_medium(Interaction here, Path path, vec3 wi_w) {
    Medium medium = path.medium;
    if ((dot(path.at.ng, wi_w) < 0.0) != here.behind) medium = here.beyond;
    return medium;
}

// Sets the medium through which the path goes on towards d.
void interaction_cross(Interaction here, vec3 d, inout Path path) { path.medium = interaction_medium(here, path, d); }
