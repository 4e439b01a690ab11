// A material at a point of a surface, ready for the lobes. Here, and only here, roughness becomes alpha.
#include "material/material.glsl"

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
    vec3 phong;       // colour of the highlight of phong and blinn_phong
    float shininess;
    vec2 tangent;     // direction in the shading frame that anisotropy stretches along
#if HAS_PRINCIPLED
    float transmission;    // share of the base that is clear
    float eta_outside;     // index inside over outside
    float eta;             // index beyond the surface over index on wo's side
    bool inside;           // wo is inside a body that transmits
    bool is_delta;         // the base is perfectly smooth
    bool index_matched;    // the index is 1: rays pass as if nothing were there
    bool coat_is_delta;
    vec3 specular_color;
    float aspect;          // of the specular lobe, 1 where it is round
    float sheen_roughness; // for the tables
    float alpha_sheen;
    float coat_roughness;  // for the tables, 0 where the coat is a mirror
    vec4 albedo;           // energy_albedo at wo
    vec4 albedo_mean;      // energy_mean
    float coat_albedo;     // the share of light from wo that the coat keeps from what is under it
    float sheen_albedo;    // the same of the sheen
#if HAS_COAT_NORMALS
    Basis coat;            // the coat's own frame, in the shading frame
#endif
#endif
#if HAS_MICROFACET
    Microfacet terms;    // the terms of the model `microfacet`, with their parameters
    float terms_ior;     // of its dielectric
    float log_factor;    // of its distribution, from its table
    uint row;            // the texel where its table's row for its alpha begins,
    uint row_above;      // that of the next one,
    float row_share;     // and how far alpha is on the way there
#endif
};

#if HAS_PRINCIPLED
// Sets the members for `principled` that do not depend on the direction; principled_face sets the others.
void surface_principled(Material m, vec2 tangent, inout Surface s) {
    float largest = max_component(m.base_color);
    vec3 tint = largest > 0.0 ? m.base_color / largest : vec3(1.0);
    s.specular_color = m.specular_color * mix(vec3(1.0), tint, m.specular_tint);
    float f0 = sqrt(0.08 * m.specular);
    s.eta_outside = m.ior >= 1.0 ? m.ior : (1.0 + f0) / (1.0 - f0);
    s.index_matched = s.eta_outside < 1.0001;
    if (s.index_matched) s.eta_outside = 1.0;
    s.eta = s.eta_outside;
    s.transmission = 0.0;
    s.inside = false;
#if HAS_TRANSMISSION
    s.transmission = m.transmission;
#endif
    s.is_delta = m.roughness < LEAST_ROUGHNESS;
    s.aspect = 1.0;
#if HAS_ANISOTROPIC
    s.aspect = sqrt(1.0 - 0.9 * m.anisotropic);
    float turn = radians(m.anisotropic_rotation);
    vec2 cs = vec2(cos(turn), sin(turn));
    s.tangent = m.anisotropic > 0.0 ? vec2(cs.x * tangent.x - cs.y * tangent.y, cs.y * tangent.x + cs.x * tangent.y)
                                    : vec2(1.0, 0.0);
#endif
    float a = sqr(max(m.roughness, LEAST_ROUGHNESS));
    s.alpha = vec2(a / s.aspect, a * s.aspect);
#if HAS_SHEEN
    s.sheen = m.sheen * (m.sheen_color.x >= 0.0 ? m.sheen_color : mix(vec3(1.0), tint, m.sheen_tint));
    s.sheen *= 1.0 - m.metallic;
    s.sheen_roughness = max(m.sheen_roughness, ENERGY_LEAST_SHEEN_ROUGHNESS);
    s.alpha_sheen = s.sheen_roughness * s.sheen_roughness;
#endif
    s.coat_is_delta = false;
#if HAS_CLEARCOAT
    s.coat_is_delta = m.clearcoat_roughness >= 0.0 && m.clearcoat_roughness < LEAST_ROUGHNESS;
    float rough = max(m.clearcoat_roughness, LEAST_ROUGHNESS);
    s.alpha_coat = m.clearcoat_roughness >= 0.0 ? rough * rough : mix(0.1, 0.001, m.clearcoat_gloss);
    s.coat_roughness = s.coat_is_delta ? 0.0 : sqrt(s.alpha_coat);
#endif
}
#endif

#if HAS_MICROFACET
// Sets the members for `microfacet`.
void surface_microfacet(Material m, inout Surface s) {
    s.terms = microfacet_load(m.number);
    s.terms_ior = m.ior;
    s.spec0 = m.specular_color;
    s.alpha = vec2(clamp(m.alpha, s.terms.alpha_low, s.terms.alpha_high));
    s.log_factor = 0.0;
    s.row = s.row_above = s.terms.table;
    s.row_share = 0.0;
#if HAS_MICROFACET_TABLES && TEXTURE_ALPHA >= 0
    float place = (log(s.alpha.x + s.terms.row_offset) - s.terms.row_start) * s.terms.row_scale;
    uint first = min(uint(max(place, 0.0)), max(s.terms.rows, 2u) - 2u);
    s.row += first * s.terms.row_texels;
    s.row_above = s.row + (s.terms.rows > 1u ? s.terms.row_texels : 0u);
    s.row_share = clamp(place - float(first), 0.0, 1.0);
#endif
#if HAS_MICROFACET_TABLES
    s.log_factor = microfacet_texel(s.row).x;
#if TEXTURE_ALPHA >= 0
    s.log_factor = mix(s.log_factor, microfacet_texel(s.row_above).x, s.row_share);
#endif
#endif
}
#endif

// The rate at which light is absorbed inside, 1/m: transmittance is exp(-rate t).
vec3 surface_attenuation(Material m) {
#if HAS_ATTENUATION
    if (m.attenuation_distance > 0.0) return min(-log(m.attenuation_color) / m.attenuation_distance, vec3(1e30));
#endif
    return vec3(0.0);
}

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
#if HAS_MICROFACET
    if (m.model == MODEL_MICROFACET) surface_microfacet(m, s);
#endif
#if HAS_PRINCIPLED
#if HAS_CLEARCOAT
    s.clearcoat = m.clearcoat;
#endif
    if (m.model == MODEL_PRINCIPLED) surface_principled(m, tangent, s);
#endif
    return s;
}

// Whether the noise of the surface comes from the light rather than from where its paths go. It does not for metals
// that nearly mirror, nor for glass, whose paths find the light by themselves.
bool surface_is_broad(Surface s) {
    bool narrow = s.metallic > 0.5 && s.roughness < 0.25;
#if HAS_TRANSMISSION
    narrow = narrow || (s.model == MODEL_PRINCIPLED && s.transmission > 0.5);
#endif
    return !narrow;
}
