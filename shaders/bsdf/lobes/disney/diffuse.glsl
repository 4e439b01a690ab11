// Diffuse reflection with its retro-reflection, and a flattened variant for thin subsurface [Burley 2012, section 5.3].
// bsdf/bsdf.glsl has checked that wo.z and wi.z are positive.
vec3 disney_diffuse_eval(Surface s, vec3 wo, vec3 wi, float cos_d) {
    float fi = fresnel_schlick(wi.z), fo = fresnel_schlick(wo.z);
    float fss90 = cos_d * cos_d * s.roughness;
    float fd90 = 0.5 + 2.0 * fss90;
    float f = mix(1.0, fd90, fi) * mix(1.0, fd90, fo);
#if HAS_SUBSURFACE
    float fss = mix(1.0, fss90, fi) * mix(1.0, fss90, fo);
    float ss = 1.25 * (fss * (1.0 / (wi.z + wo.z) - 0.5) + 0.5);
    f = mix(f, ss, s.subsurface);
#endif
    return INV_PI * f * s.base_color * (1.0 - s.metallic);
}

float disney_diffuse_weight(Surface s) {
    return (1.0 - s.metallic) * (luminance(s.base_color) + 0.1 * max_component(s.sheen));
}
