// Lambertian reflection. In every kernel, as the model of what has no other.
#include "bsdf/lobes/lambert.glsl"

void diffuse_surface(Material m, vec2 tangent, inout Surface s) {}

Scatter diffuse_eval(Surface s, vec3 wo, vec3 wi) {
    return Scatter(LOBE(LOBE_DIFFUSE, lambert_eval(s)), lambert_pdf(wi));
}

LobeSample diffuse_sample(Surface s, vec3 wo, float u_lobe, vec2 u) { return bsdf_rough_sample(lambert_sample(u)); }
