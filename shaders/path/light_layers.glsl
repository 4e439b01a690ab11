// What layers leave of the light that a surface sends out from under them, towards w. Normal maps do not count, as lights
// that are sampled do not read them.
#if HAS_LAYERED_LIGHTS
vec3 light_layers(SurfacePoint at, vec3 w) {
    Interaction here;
    here.behind = dot(at.ng, w) < 0.0;
    here.basis = basis_make(sides_normal(at, w));
#if HAS_TEXTURES
    vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)];
    texture_look(at, footprint_none(), texels);
    Material m = texture_material(at, texels);
#else
    Material m = material_pick(at.material);
#endif
    interaction_tangent(at, m, here);
    Surface s = surface_make(m, here.tangent);
#if HAS_COAT_NORMALS
    s.coat = basis_make(vec3(0.0, 0.0, 1.0));
#endif
    return models_emitted(s, basis_to_local(here.basis, w));
}
#endif
