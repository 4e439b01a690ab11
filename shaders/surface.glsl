// What a material is at a point of a surface, ready for the lobes. Here, and only here, roughness becomes alpha.
struct Surface {
    uint model;
    vec3 base_color;
    float roughness;
    float metallic;
    float subsurface;
    vec3 spec0;       // specular reflectance at normal incidence
    vec2 alpha;       // of the specular lobe, along its x and y
    float alpha_mask; // of its masking, remapped
    vec3 sheen;       // colour times amount
    float clearcoat;
    float alpha_coat;
    vec3 phong;       // colour of blinn_phong's highlight
    float shininess;
    vec2 tangent;     // direction in the shading frame that anisotropy stretches along
};

Surface surface_make(Material m, vec2 tangent) {
    Surface s;
    s.model = m.model;
    s.base_color = m.base_color;
    s.roughness = m.roughness;
    s.metallic = m.metallic;
    s.subsurface = m.subsurface;
    s.spec0 = vec3(0.0);
    s.alpha = vec2(1.0);
    s.alpha_mask = 1.0;
    s.sheen = vec3(0.0);
    s.clearcoat = 0.0;
    s.alpha_coat = 1.0;
    s.phong = m.phong_specular;
    s.shininess = m.shininess;
    s.tangent = vec2(1.0, 0.0);
#if HAS_DISNEY
    // Weights of the course notes' luminance, not Rec.709's: the model is kept for faithful comparison.
    float lum = dot(m.base_color, vec3(0.3, 0.6, 0.1));
    vec3 tint = lum > 0.0 ? m.base_color / lum : vec3(1.0);
    s.spec0 = mix(m.specular * 0.08 * mix(vec3(1.0), tint, m.specular_tint), m.base_color, m.metallic);
    float aspect = 1.0;
#if HAS_ANISOTROPIC
    aspect = sqrt(1.0 - 0.9 * m.anisotropic);
    if (m.anisotropic > 0.0) s.tangent = tangent;
#endif
    float a = m.roughness * m.roughness;
    s.alpha = max(vec2(0.001), vec2(a / aspect, a * aspect));
    s.alpha_mask = sqr(0.5 + 0.5 * m.roughness);
#if HAS_SHEEN
    s.sheen = m.sheen * mix(vec3(1.0), tint, m.sheen_tint);
#endif
#if HAS_CLEARCOAT
    s.clearcoat = m.clearcoat;
    s.alpha_coat = mix(0.1, 0.001, m.clearcoat_gloss);
#endif
#endif
#if HAS_METAL_ROUGH
    if (m.model == MODEL_METAL_ROUGH) {
        s.spec0 = mix(vec3(0.04), m.base_color, m.metallic);
        s.alpha_mask = max(0.001, m.roughness * m.roughness);
        s.alpha = vec2(s.alpha_mask);
        s.tangent = vec2(1.0, 0.0);
    }
#endif
    return s;
}
