// The perfectly specular lobes of a surface, each as bsdf_sample gives it.
const int BSDF_DELTAS = 3;

// Those that a surface lacks have no chance. One of them at least is missing, as no surface refracts in two ways; the
// coat and the base may mirror into the same direction.
void bsdf_deltas(Surface s, vec3 wo, out LobeSample deltas[BSDF_DELTAS]) {
    for (int k = 0; k < BSDF_DELTAS; k++) deltas[k] = LobeSample(vec3(0.0), false, Scatter(vec3(0.0), 0.0), false);
#if HAS_PRINCIPLED_LOBES
    if (s.model == MODEL_PRINCIPLED) {
        PrincipledWeights w = principled_weights(s, wo);
        LobeSample mirrored = principled_sample_microfacet(s, wo, 0.0, vec2(0.0), w.microfacet);
        if (mirrored.is_delta && mirrored.wi.z > 0.0) deltas[0] = mirrored;
        LobeSample refracted = principled_sample_microfacet(s, wo, 0.9999999, vec2(0.0), w.microfacet);
        if (refracted.is_delta && refracted.wi.z < 0.0) deltas[1] = refracted;
#if HAS_CLEARCOAT
        LobeSample coat = principled_sample_coat(s, wo, vec2(0.0), w.coat);
        if (coat.is_delta) deltas[2] = coat;
#endif
    }
#endif
}
