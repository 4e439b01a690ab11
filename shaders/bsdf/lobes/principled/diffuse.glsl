// The diffuse base under a rough dielectric scatters the light that the boundary reflects neither on its way in nor on
// its way out [Kulla & Conty 2017; Ashikhmin & Shirley 2000]; a flatter variant is for thin subsurface. Each `albedo`
// is the share that the boundary reflects: at wo, at wi, or on average.
#if HAS_PRINCIPLED

// The albedo of the density 1 / (2 (c + c')) over c' [Seeliger 1888]: 1 - c ln(1 + 1 / c).
float principled_diffuse_seeliger(float c) { return c > 0.0 ? 1.0 - c * log(1.0 + 1.0 / c) : 1.0; }

// The share of the base that is diffuse and sends light back where it comes in.
float principled_matte_share(Surface s) {
    float share = (1.0 - s.metallic) * (1.0 - s.transmission);
#if HAS_WALKS
    share *= 1.0 - s.walks;
#endif
    return share;
}

vec3 principled_diffuse_eval(Surface s, float cos_o, float cos_i, BASE_SHARE albedo_o, BASE_SHARE albedo_i,
                             BASE_SHARE albedo_mean) {
    BASE_SHARE f = (1.0 - albedo_o) * (1.0 - albedo_i) / max(1.0 - albedo_mean, 1e-6);
#if HAS_SUBSURFACE
    // Single scattering of a half-space, brought to an albedo of 1 at every angle as Kulla & Conty do for microfacets.
    const float mean = 0.409137; // of principled_diffuse_seeliger, cosine-weighted: 4/3 - 4/3 ln 2
    float lost_o = 1.0 - principled_diffuse_seeliger(cos_o), lost_i = 1.0 - principled_diffuse_seeliger(cos_i);
    float even = 0.5 / (cos_o + cos_i) + lost_o * lost_i / (1.0 - mean);
    f = mix(f, even * (1.0 - max(albedo_o, albedo_i)), s.subsurface);
#endif
    return principled_matte_share(s) * INV_PI * f * s.base_color;
}

#if HAS_THIN_WALLS
// Of light that the inside of a thin wall scatters to its other side, whose boundary it passes, too.
vec3 principled_through_eval(Surface s, BASE_SHARE albedo_o, BASE_SHARE albedo_i, BASE_SHARE albedo_mean) {
    BASE_SHARE f = (1.0 - albedo_o) * (1.0 - albedo_i) / max(1.0 - albedo_mean, 1e-6);
    return (1.0 - s.metallic) * (1.0 - s.transmission) * s.diffuse_transmission * INV_PI * f * s.diffuse_through;
}

float principled_through_weight(Surface s, BASE_SHARE albedo_o) {
    return (1.0 - s.metallic) * (1.0 - s.transmission) * luminance(s.diffuse_through) * (1.0 - base_grey(albedo_o));
}
#endif

float principled_diffuse_weight(Surface s, BASE_SHARE albedo_o) {
    return principled_matte_share(s) * luminance(s.base_color) * (1.0 - base_grey(albedo_o));
}
#endif
