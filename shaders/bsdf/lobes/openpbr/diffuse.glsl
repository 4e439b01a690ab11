// The diffuse base: energy-preserving Oren-Nayar [Portsmouth, Kutz & Hill 2025], Lambert's at roughness 0, under a
// dielectric that passes what it reflects neither on the way in nor out. Each `albedo` is the share that the boundary
// reflects: at wo, at wi, or on average.
#if HAS_OPENPBR
float openpbr_diffuse_share(Surface s) { return (1.0 - s.metallic) * (1.0 - s.transmission); }

// What of that does not walk under the surface.
float openpbr_matte_share(Surface s) {
#if HAS_WALKS
    return openpbr_diffuse_share(s) * (1.0 - s.walks);
#else
    return openpbr_diffuse_share(s);
#endif
}

#if HAS_DIFFUSE_ROUGHNESS
const float EON_SLOPE = 0.5 - 2.0 / 3.0 * INV_PI;
const float EON_MEAN = 2.0 / 3.0 - 28.0 / 15.0 * INV_PI;

// What a white one with roughness r loses of light from cosine c: 1 less its single scattering's albedo.
float openpbr_diffuse_lost(float c, float r) {
    float s = sqrt(max(0.0, 1.0 - c * c));
    // The second term's tangent times 1 - sine^3 - cosine, without the division by a small cosine.
    float g = s * (acos(clamp(c, 0.0, 1.0)) - s * c) + 2.0 / 3.0 * s * (c * (1.0 + s + s * s) / (1.0 + s) - 1.0);
    return 1.0 - (1.0 + r * INV_PI * g) / (1.0 + EON_SLOPE * r);
}

// The cosine-weighted mean of what both the boundary and single scattering leave over, by Gauss's rule.
BASE_SHARE openpbr_diffuse_lost_mean(Surface s) {
    const vec3 c = vec3(0.2123405382, 0.5905331356, 0.9114120405);
    const vec3 weight = vec3(0.1396539598, 0.4584822128, 0.4018638274);
    BASE_SHARE sum = BASE_SHARE(0.0);
    for (int i = 0; i < 3; i++) {
        vec3 w = vec3(sqrt(0.5 * (1.0 - c[i] * c[i])) * vec2(1.0), c[i]);
        sum += weight[i] * openpbr_diffuse_lost(c[i], s.diffuse_roughness) * (1.0 - shares_kept(s, w, base_albedo(s, w)));
    }
    return sum;
}
#endif

vec3 openpbr_diffuse_eval(Surface s, vec3 wo, vec3 wi, BASE_SHARE albedo_o, BASE_SHARE albedo_i,
                          BASE_SHARE albedo_mean) {
    BASE_SHARE passed_o = 1.0 - albedo_o, passed_i = 1.0 - albedo_i;
    BASE_SHARE even = passed_o * passed_i / max(1.0 - albedo_mean, 1e-6);
    vec3 f = even * s.matte_color;
#if HAS_DIFFUSE_ROUGHNESS
    float r = s.diffuse_roughness;
    if (r > 0.0) {
        float a = 1.0 / (1.0 + EON_SLOPE * r), mean = a * (1.0 + EON_MEAN * r);
        float side = dot(wo.xy, wi.xy);
        // The part that depends on the azimuth keeps below what the boundary passes, in either direction.
        BASE_SHARE apart = side * (side > 0.0 ? 1.0 / max(wo.z, wi.z) : 1.0) * min(min(passed_o, passed_i), even);
        BASE_SHARE lost_o = openpbr_diffuse_lost(wo.z, r) * passed_o, lost_i = openpbr_diffuse_lost(wi.z, r) * passed_i;
        BASE_SHARE lost = lost_o * lost_i / max(openpbr_diffuse_lost_mean(s), 1e-6);
        vec3 more = s.matte_color * s.matte_color * mean / (1.0 - s.matte_color * (1.0 - mean)); // colour of several scatterings
        f = s.matte_color * (a * (even + r * apart)) + more * lost;
    }
#endif
    return openpbr_matte_share(s) * INV_PI * f;
}

float openpbr_diffuse_weight(Surface s, BASE_SHARE albedo_o) {
    return openpbr_matte_share(s) * luminance(s.matte_color) * (1.0 - base_grey(albedo_o));
}

#if HAS_THIN_WALLS
// Of light that walks in a thin wall and comes out on its other side, whose boundary it passes, too.
vec3 openpbr_through_eval(Surface s, BASE_SHARE albedo_o, BASE_SHARE albedo_i, BASE_SHARE albedo_mean) {
    BASE_SHARE f = (1.0 - albedo_o) * (1.0 - albedo_i) / max(1.0 - albedo_mean, 1e-6);
    return openpbr_diffuse_share(s) * s.diffuse_transmission * INV_PI * f * s.diffuse_through;
}

float openpbr_through_weight(Surface s, BASE_SHARE albedo_o) {
    return openpbr_diffuse_share(s) * s.diffuse_transmission * luminance(s.diffuse_through) * (1.0 - base_grey(albedo_o));
}
#endif
#endif
