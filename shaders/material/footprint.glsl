// How much of a surface one lookup of a texture stands for: a ray is the axis of a cone [Akenine-Moller et al. 2021,
// "Improved shader and texture level of detail using ray cones"], whose ellipse on the surface is the footprint.
#if HAS_TEXTURES
// The axes of the ellipse in texture coordinates, each u and v.
struct Footprint {
#if ANY_FOOTPRINTS
    vec4 axes;
#if HAS_UVS_1
    vec4 axes_1; // of the second set
#endif
#if HAS_PROJECTIONS
    vec3 along;  // the axes themselves, in the world
    vec3 across;
#endif
#else
    float unused; // a struct must have a member; every kernel with textures passes footprints on
#endif
};

const float FOOTPRINT_GRAZING = 1e-4; // the least cosine, as a footprint would reach to the horizon

// A lookup of a single point, whose texels are filtered bilinearly.
Footprint footprint_none() {
    Footprint f;
#if ANY_FOOTPRINTS
    f.axes = vec4(0.0);
#if HAS_UVS_1
    f.axes_1 = vec4(0.0);
#endif
#if HAS_PROJECTIONS
    f.along = f.across = vec3(0.0);
#endif
#else
    f.unused = 0.0;
#endif
    return f;
}

// The footprint of a cone that has `width` where it meets the surface along d.
Footprint footprint_make(SurfacePoint at, vec3 d, float width) {
    Footprint f = footprint_none();
#if ANY_FOOTPRINTS
    vec3 across = cross(at.ng, d);
    across *= abs(width) * inversesqrt(max(dot(across, across), 1e-20));
    vec3 along = cross(across, at.ng) / max(abs(dot(at.ng, d)), FOOTPRINT_GRAZING);
    f.axes = vec4(dot(at.grow_u, along), dot(at.grow_v, along), dot(at.grow_u, across), dot(at.grow_v, across));
#if HAS_UVS_1
    f.axes_1 = vec4(dot(at.grow_u_1, along), dot(at.grow_v_1, along), dot(at.grow_u_1, across),
                    dot(at.grow_v_1, across));
#endif
#if HAS_PROJECTIONS
    f.along = along;
    f.across = across;
#endif
#endif
    return f;
}

// Both axes in a slot's own coordinates, one in each column.
mat2 footprint_in(TextureSlot s, Footprint f) {
#if ANY_FOOTPRINTS
    vec4 axes = f.axes;
#if HAS_UVS_1
    if ((s.flags & TEXTURE_SLOT_UV_1) != 0u) axes = f.axes_1;
#endif
    return mat2(dot(s.turn.xy, axes.xy), dot(s.turn.zw, axes.xy), dot(s.turn.xy, axes.zw), dot(s.turn.zw, axes.zw));
#else
    return mat2(0.0);
#endif
}

#if HAS_PROJECTIONS
// Likewise, for coordinates of these gradients.
mat2 footprint_along(TextureSlot s, Footprint f, vec3 grow_u, vec3 grow_v) {
#if ANY_FOOTPRINTS
    mat2 axes = mat2(dot(grow_u, f.along), dot(grow_v, f.along), dot(grow_u, f.across), dot(grow_v, f.across));
    return mat2(dot(s.turn.xy, axes[0]), dot(s.turn.zw, axes[0]), dot(s.turn.xy, axes[1]), dot(s.turn.zw, axes[1]));
#else
    return mat2(0.0);
#endif
}
#endif
#endif
