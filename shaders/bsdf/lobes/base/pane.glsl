// Thin walls: panes whose two faces are so near to each other that light goes straight through. Between the faces it is
// reflected to and fro: of two faces of reflectance R a pane reflects 2 R / (1 + R), and passes (1 - R) / (1 + R), which
// its colour tints once. The pane is the same from both sides, and the index is that of wo's side on both.
#if ANY_NEEDS_TABLES && HAS_THIN_WALLS
BASE_SHARE base_dielectric_mean(Surface s); // bsdf/lobes/base/multiscatter.glsl
BASE_SHARE shares_once(Surface s, vec3 w, vec4 albedo); // bsdf/lobes/base/shares.glsl
BASE_SHARE shares_once(Surface s);

// What goes through bends at two rough faces, which turn it by (eta - 1) times the difference of their slopes where a
// reflection turns by twice a slope. So alpha is less by (eta - 1) / sqrt(2) for facets whose slopes have a variance;
// for GGX's, whose tails are longer, 0.83 (eta - 1) has the median of the angles. [Burley 2015, "Extending the Disney
// BRDF to a BSDF with integrated subsurface scattering", section 5, takes (0.65 eta - 0.35)^2.]
const float PANE_NARROWING = 0.83;

float pane_narrowing(float eta) { return min(1.0, PANE_NARROWING * (eta - 1.0)); }

vec2 pane_alpha(Surface s) { return max(s.alpha * s.pane_narrowing, vec2(sqr(LEAST_ROUGHNESS))); }

// Its roughness, for the tables.
float pane_roughness(Surface s) { return s.is_delta ? 0.0 : s.roughness * sqrt(s.pane_narrowing); }

// Two faces of reflectance r.
float pane_of(float r) { return 2.0 * r / (1.0 + r); }
vec3 pane_of(vec3 r) { return 2.0 * r / (1.0 + r); }

// The share that the rough pane reflects, from two of base_albedo's shares: never too low, as 2 F / (1 + F) is concave.
float pane_reflected(vec4 albedo) { return 2.0 * albedo.x * albedo.y / max(albedo.x + albedo.y, 1e-6); }

vec3 pane_reflected(float one, vec3 once) { return 2.0 * one * once / max(one + once, 1e-6); }
float pane_reflected(float one, float once) { return pane_reflected(vec4(one, once, 0.0, 0.0)); }

// What else gets lost in a rough pane: pane_reflected is too high, and light that goes through pays for the more
// reflecting of the two directions. Polynomials in the place of the index and of the roughness in the tables and in the
// root of the cosine; they were fitted to quadrature at 3 500 places, of which none is exceeded by more than 0.0008 and
// 0.014 is missing at most. The second one is of the cosine-weighted mean. Stretched facets get less of it, as they were
// not fitted.
float pane_lost_more(Surface s, float reflected, float c) {
    float x = energy_eta(s.eta_outside), r = s.roughness, q = sqrt(abs(c));
    float a = -0.02512 + r * (0.99989 + r * (-1.23915 + r * 0.37995)) + x * (0.03807 + r * (-0.51244 + r * 0.45234))
            + x * x * (-0.19584 - 0.03944 * r + 0.14459 * x);
    float b = -0.21408 + r * (-0.49542 + r * 0.32811) + x * (0.82139 - 0.11685 * r - 0.54168 * x);
    float poly = a + q * (b + q * (-0.03403 + 0.37287 * r + 0.08662 * x - 0.13573 * q));
    return s.is_delta ? 0.0 : reflected * (1.0 - reflected) * sqr(s.aspect) * max(poly, 0.0);
}

float pane_lost_more_mean(Surface s) {
    float x = energy_eta(s.eta_outside), r = s.roughness;
    float poly = 0.00715 + r * (0.02989 + r * (-0.06407 + r * 0.03084)) + x * (-0.05722 + r * (-0.00596 + r * 0.02374))
               + x * x * (0.13147 - 0.00359 * r - 0.0817 * x);
    return s.is_delta ? 0.0 : sqr(s.aspect) * max(poly, 0.0);
}

// Of base_albedo's shares those that get lost, as of glass: `through` is what white facets of pane_alpha reflect.
vec4 pane_albedo(Surface s, vec3 w, vec4 albedo) {
    if (!s.is_thin) return albedo;
    float through = energy_albedo(bsdf_turn(s, w), pane_roughness(s), s.aspect, s.eta_outside).x;
    float reflected = pane_reflected(albedo);
    return vec4(albedo.xy, vec2((1.0 - reflected) * (1.0 - through) + pane_lost_more(s, reflected, w.z)));
}

vec4 pane_albedo_mean(Surface s, vec4 mean) {
    if (!s.is_thin) return mean;
    float through = energy_mean(pane_roughness(s), s.aspect, s.eta_outside).x;
    return vec4(mean.xy, vec2((1.0 - pane_reflected(mean)) * (1.0 - through) + pane_lost_more_mean(s)));
}

// The chance that light which is lost between the facets leaves on the other side, from either.
BASE_SHARE pane_multiscatter_chance(Surface s) { return 1.0 - pane_of(base_dielectric_mean(s)); }

// What goes through by single scattering, of light that comes from one side at a share `reflected` and leaves at
// another: the greater one decides, which is reciprocal and gains nothing.
vec3 pane_transmittance(Surface s, BASE_SHARE reflected) {
    return (1.0 - s.metallic) * s.transmission * (1.0 - reflected) * s.clear_color;
}

// A direction that goes through, or zero where it would come back.
vec3 pane_sample(Surface s, vec3 wo, vec2 u) {
    vec3 wm = s.is_delta ? vec3(0.0, 0.0, 1.0) : ggx_visible_normal(wo, pane_alpha(s), u);
    vec3 r = 2.0 * dot(wo, wm) * wm - wo;
    return r.z > 0.0 ? vec3(r.xy, -r.z) : vec3(0.0);
}

// Of light that passes by the microfacets: f lacks the layers. wo_t and image_t, wi's mirror image, are in the lobe's
// frame.
Scatter pane_eval(Surface s, vec3 wo_t, vec3 image_t, vec4 albedo_i, float weight, float chance) {
    if (s.is_delta || s.index_matched || s.transmission <= 0.0 || s.metallic >= 1.0) return Scatter(vec3(0.0), 0.0);
    vec2 alpha = pane_alpha(s);
    vec3 wm = normalize(wo_t + image_t);
    BASE_SHARE there = pane_reflected(albedo_i.x, shares_once(s, image_t, albedo_i));
    BASE_SHARE reflected = max(pane_reflected(s.albedo.x, shares_once(s)), there);
    vec3 f = pane_transmittance(s, reflected) * (ggx_d(wm, alpha) * ggx_visibility(wo_t, image_t, alpha));
    return Scatter(f, weight * (1.0 - chance) * ggx_visible_pdf(wo_t, wm, alpha));
}
#endif
