// Dispersive glass. The channel that leads gives the direction; the others come along where their own indices allow it,
// weighted by the balance heuristic over which of the three had led the path [Wilkie et al. 2014, "Hero wavelength
// spectral sampling"]: each channel's f over the mean of the three densities, of the whole path. So reflected light, and what
// rough glass passes, keeps all three, and has colour by each one's index; a perfectly specular refraction leaves only
// the leading one, with three times the weight.

#if HAS_DISPERSION
Surface dispersion_surface(Interaction here, Material m, Hues hues, uint channel) {
    return interaction_surface(here, hues_material(m, hues, channel));
}

// Takes over the channel's part of f.
void dispersion_take(uint channel, Scatter f, inout Scatter sum, inout vec3 pdfs) {
    sum.f[channel] = f.f[channel];
    pdfs[channel] = f.pdf;
}

// The perfectly specular lobe that gave `lobe`, for another channel with the surface s: refracted, it goes elsewhere.
Scatter dispersion_delta(Surface s, vec3 wo, LobeSample lobe) {
    LobeSample deltas[BSDF_DELTAS];
    bsdf_deltas(s, wo, deltas);
    Scatter r = deltas[lobe.coated ? 2 : 0].scatter;
    if (lobe.wi.z < 0.0) r = Scatter(vec3(0.0), 0.0);
    return r;
}
#endif

// The BSDF in a direction, and its density, whichever channel leads; s is the leading one's surface. Where the path goes
// on in it, so do its hues.
Scatter dispersion_eval(Surface s, Interaction here, Material m, Asked asked, inout Hues hues) {
#if HAS_DISPERSION
    Scatter sum = Scatter(vec3(0.0), 0.0);
    vec3 pdfs = vec3(0.0);
    bool parts = hues_part(m), more;
    uint j = 0u;
    do {
        uint channel = (hues.leads + j) % 3u;
        Surface c = s;
        if (j > 0u) c = dispersion_surface(here, m, hues, channel);
        Scatter f = bsdf_eval_world(c, here, asked);
        if (j > 0u && asked.goes_on && asked.lobe.is_delta) f = dispersion_delta(c, here.wo, asked.lobe);
        if (parts) dispersion_take(channel, f, sum, pdfs);
        else sum = f;
        more = parts && ++j < 3u;
    } while (more);
    if (parts) {
        sum.pdf = dot(pdfs, hues.shares) / 3.0;
        if (asked.goes_on && sum.pdf > 0.0) hues.shares *= pdfs / sum.pdf;
    }
    return sum;
#else
    return bsdf_eval_world(s, here, asked);
#endif
}

// Likewise for a surface that only mirrors or refracts; s becomes the leading channel's.
LobeSample dispersion_sample_delta(Interaction here, Material m, float u, float least, inout Surface s,
                                   inout Hues hues) {
    LobeSample lobe = models_sample_delta(here.wo, interaction_dense(here), u, least, s);
#if HAS_DISPERSION
    if (hues_part(m)) {
        Scatter sum = Scatter(vec3(0.0), 0.0);
        vec3 pdfs = vec3(0.0);
        dispersion_take(hues.leads, lobe.scatter, sum, pdfs);
        uint j = 1u;
        if (lobe.wi.z > 0.0) do {
            uint channel = (hues.leads + j) % 3u;
            Surface c = surface_make(interaction_material(here, hues_material(m, hues, channel)), here.tangent);
            LobeSample other = models_sample_delta(here.wo, interaction_dense(here), 0.0, least, c);
            dispersion_take(channel, other.scatter, sum, pdfs);
        } while (++j < 3u);
        sum.pdf = dot(pdfs, hues.shares) / 3.0;
        if (sum.pdf > 0.0) hues.shares *= pdfs / sum.pdf;
        lobe.scatter = sum;
    }
#endif
    return lobe;
}
