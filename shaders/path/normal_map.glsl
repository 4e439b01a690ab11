// A lobe about a normal that a map has bent reaches below the surface. The light that it sends there comes back up, as
// if the surface mirrored it, so that nothing is lost and nothing gained: the idea of [Schuessler, Heitz, Hanika,
// Dachsbacher 2017, "Microfacet-based normal mapping"] with the tangent facet laid flat and one further scattering.
// A direction v thus has the sum of two directions of the lobe, itself and its image below the surface. Refracted light
// is folded likewise.

#if HAS_NORMAL_MAPS
// The folded BSDF towards v, in world space.
Scatter normal_map_eval(Surface s, Interaction here, vec3 v) {
    Scatter sum = Scatter(vec3(0.0), 0.0);
    float side = dot(v, here.fold);
    vec3 w = v;
    bool more;
    uint k = 0u;
    do {
        vec3 wi = basis_to_local(here.basis, w);
        Scatter f = bsdf_eval(s, here.wo, wi);
        if (!here.mapped || wi.z * side > 0.0) sum = Scatter(sum.f + f.f, sum.pdf + f.pdf);
        w = v - 2.0 * side * here.fold;
        more = k == 0u && here.mapped && dot(w, here.basis.z) * side > 0.0;
#if HAS_COAT_NORMALS
        Scatter c = models_coat_eval(s, here.wo, wi);
        if (side > 0.0) sum = Scatter(sum.f + c.f, sum.pdf + c.pdf);
        float coat_side = dot(basis_to_local(here.basis, w), s.coat.z);
        more = more || (k == 0u && here.mapped && side > 0.0 && coat_side > 0.0);
#endif
        k++;
    } while (more);
    return sum;
}
#endif

// Whether the folded lobe has that direction.
bool normal_map_keeps(Surface s, LobeSample lobe) {
#if HAS_TRANSMISSION
    bool keeps = lobe.wi.z != 0.0 && (lobe.wi.z > 0.0 || s.transmission > 0.0);
#else
    bool keeps = lobe.wi.z > 0.0;
#endif
    return keeps || lobe.coated;
}

// The sampled direction in world space, folded back to its lobe's side of the surface.
vec3 normal_map_direction(Interaction here, LobeSample lobe) {
    vec3 d = basis_to_world(here.basis, lobe.wi);
    // Uniform directions are drawn about the surface itself, where nothing needs folding.
    bool uniform_about_surface = ESTIMATOR == ESTIMATOR_UNIFORM && here.mapped && !lobe.is_delta;
    if (uniform_about_surface) d = basis_to_world(basis_make(here.fold), lobe.wi);
    float across = dot(d, here.fold);
    if (here.mapped && across * (lobe.coated ? 1.0 : lobe.wi.z) < 0.0) d -= 2.0 * across * here.fold;
    return d;
}
