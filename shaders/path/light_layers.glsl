// What layers leave of the light that a surface sends out from under them, towards w. Normal maps do not count, as lights
// that are sampled do not read them.
#if HAS_LAYERED_LIGHTS
vec3 light_layers(SurfacePoint at, vec3 w) {
    Interaction here;
    Material m;
    Surface s = interaction_lone(at, w, medium_outside(), here, m);
    return models_emitted(here.wo, here.behind, s);
}
#endif
