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
#else
    float unused; // a struct must have a member; every kernel with textures passes footprints on
#endif
};

const float FOOTPRINT_GRAZING = 1e-4; // the least cosine, as a footprint would reach to the horizon

// A lookup of a single point, whose texels are filtered bilinearly.
Footprint footprint_none() {
#if ANY_FOOTPRINTS && HAS_UVS_1
    return Footprint(vec4(0.0), vec4(0.0));
#elif ANY_FOOTPRINTS
    return Footprint(vec4(0.0));
#else
    return Footprint(0.0);
#endif
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
#endif
