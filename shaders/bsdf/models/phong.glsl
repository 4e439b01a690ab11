// The classic highlight about the mirrored direction [Phong 1975]; it is not normalised: f cos = (diffuse cos +
// specular (r.v)^n) / pi, r being wi mirrored at the normal. (r.v)^0 is 1.
#include "bsdf/lobes/lambert.glsl"
#include "bsdf/lobes/blinn_phong.glsl"

#if HAS_PHONG
void phong_surface(Material m, vec2 tangent, inout Surface s) {
    s.phong = m.phong_specular;
    s.shininess = m.shininess;
}

// (r.v)^n, from the distance between the two, which knows a small angle better than the cosine does.
float phong_power(vec3 wo, vec3 wi, float n) {
    vec3 apart = vec3(-wi.xy, wi.z) - wo;
    float d2 = dot(apart, apart), c = 1.0 - 0.5 * d2;
    if (c <= 0.0) return n == 0.0 ? 1.0 : 0.0;
    return blinn_phong_power(vec3(sqrt(max(d2 * (1.0 - 0.25 * d2), 0.0)), 0.0, c), n);
}

// The chance of picking the diffuse lobe. The highlight reflects at most 2 / (n + 1) times its colour.
float phong_diffuse_chance(Surface s) {
    float diffuse = luminance(s.base_color);
    float shine = luminance(s.phong) * (2.0 / (s.shininess + 1.0));
    return diffuse + shine > 0.0 ? diffuse / (diffuse + shine) : 1.0;
}

// Directions about the mirrored one have the density (n + 1) / (2 pi) (r.v)^n on their own hemisphere.
float phong_pdf(Surface s, vec3 wo, vec3 wi) {
    float near = 1.0 - 0.5 * dot(vec3(-wi.xy, wi.z) - wo, vec3(-wi.xy, wi.z) - wo);
    float lobe = near > 0.0 ? (s.shininess + 1.0) * (0.5 * INV_PI) * phong_power(wo, wi, s.shininess) : 0.0;
    return mix(lobe, lambert_pdf(wi), phong_diffuse_chance(s));
}

Scatter phong_eval(Surface s, vec3 wo, vec3 wi) {
    vec3 f = INV_PI * (LOBE(LOBE_DIFFUSE, s.base_color)
                     + LOBE(LOBE_SPECULAR, s.phong * (phong_power(wo, wi, s.shininess) / wi.z)));
    return Scatter(f, phong_pdf(s, wo, wi));
}

LobeSample phong_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    vec3 w = blinn_phong_lobe(s.shininess, u);
    vec3 axis = vec3(-wo.xy, wo.z), mid = vec3(axis.xy, axis.z + 1.0); // mirrors z to the axis, turned about it
    vec3 about = mid * (dot(mid, w) / mid.z) - w;                      // |mid|^2 = 2 mid.z
    return bsdf_rough_sample(u_lobe < phong_diffuse_chance(s) ? lambert_sample(u) : about);
}
#endif
