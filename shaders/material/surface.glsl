// A material at a point of a surface, ready for the lobes: what several models, or code for all of them, need of it.
// What one model alone needs is in its NAME_members.glsl.
#include "material/material.glsl"
#include "path/event.glsl"

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
#if ANY_TRANSMITS     // set for models that model_transmits names
    float transmission; // share of the base that is clear
    float eta;          // index beyond the surface over index on wo's side
#endif
#if ANY_NEEDS_TABLES   // set for models that look up the tables of energy.glsl
    float eta_outside;     // index inside over outside
    float excess;          // share of what an index of ENERGY_LARGEST_ETA passes that is reflected besides
    bool inside;           // wo is on the denser side of a boundary that transmits
    bool is_delta;         // the base is perfectly smooth
    bool index_matched;    // the index is 1: rays pass as if nothing were there
    vec3 specular_color;
    vec3 clear_color;      // of what is refracted
    float aspect;          // of the specular lobe, 1 where it is round
    vec4 albedo;           // energy_albedo at wo
    vec4 albedo_mean;      // energy_mean
    bool coat_is_delta;
    float coat_roughness;  // for the tables, 0 where the coat is a mirror
    float coat_albedo;     // the share of light from wo that the coat keeps from what is under it
    float sheen_roughness; // for the tables
    float sheen_albedo;    // the share that the sheen keeps from what is under it
#if HAS_THIN_WALLS
    bool is_thin;               // a wall without an inside: bsdf/lobes/base/pane.glsl
    float pane_narrowing;       // alpha of the lobe that goes through over that of the reflected one
    float diffuse_transmission; // share of the diffuse light that goes through
    vec3 diffuse_through;       // its colour
#endif
#endif
#if ANY_NEEDS_TABLES && ANY_FILM
    float film;            // how much of the boundary's reflectance is the film's, 0 where there is none
    float film_thickness;  // um
    float film_ior;
    float film_outer;      // index of what lies on the film, where a vacuum's is 1
#if HAS_FILM
    float film_base;       // index of the dielectric under it
    float film_bends;      // the index of the inside relative to that of the outside by which light is refracted
    vec3 film_mean;        // cosine-weighted mean of the dielectric's reflectance, from outside
    vec3 film_once;        // the share of light from wo that its facets reflect once
    vec3 film_kept;        // the share of light from wo that the boundary keeps from what is under it
    vec3 film_kept_mean;   // its cosine-weighted mean
    vec3 film_lost;        // the share of light from wo that is lost between the facets of glass,
    vec3 film_lost_outside; // and its means, seen from outside
    vec3 film_lost_inside; // and from inside
    vec3 film_reflected;   // what a facet that wo hits as it does the surface reflects,
    vec3 film_passed;      // what it passes,
    float film_chance;     // and the chance of the former
#endif
#if HAS_METAL_FILM
    vec3 film_eta;         // of the metal under it,
    vec3 film_k;           // whose index is film_eta + i film_k
    vec3 film_metal_mean;  // cosine-weighted mean of its reflectance
#endif
#endif
#if HAS_COAT_NORMALS
    Basis coat; // the coat's own frame, in the shading frame
#endif
#if HAS_WALKS
    float walks;    // the share of the diffuse light that walks under the surface
#endif
    uint event;     // what scatters: the surface, or something else that a path has met
#if HAS_SCATTERING
    float g;        // mean cosine of a particle's scattering
#endif
#include "model_members.glsl"
};

// The rate at which light is absorbed inside, 1/m: transmittance is exp(-rate t).
vec3 surface_attenuation(Material m) {
#if HAS_ATTENUATION
    if (m.attenuation_distance > 0.0) return min(-log(m.attenuation_color) / m.attenuation_distance, vec3(1e30));
#endif
    return vec3(0.0);
}

#if HAS_NORMAL_MAPS
// A material whose facets' slopes vary by `base` more along each axis than its own numbers say, those of its coat by
// `coat`. Variances add up, and alpha^2 is twice that of one axis [Tokuyoshi & Kaplanyan 2019, "Improved geometric
// specular antialiasing", section 2]; an exponent n stands for alpha^2 = 2 / (n + 2) [Walter et al. 2007].
void surface_roughen(float base, float coat, inout Material m) {
    float more = 2.0 * base;
    m.roughness = more > 0.0 ? min(sqrt(sqrt(sqr(sqr(m.roughness)) + more)), 1.0) : m.roughness;
    m.alpha = more > 0.0 ? sqrt(sqr(m.alpha) + more) : m.alpha;
    m.shininess = more > 0.0 ? max(2.0 / (2.0 / (m.shininess + 2.0) + more) - 2.0, 0.0) : m.shininess;
#if HAS_CLEARCOAT
    if (coat > 0.0) {
        float gloss = sqrt(sqr(mix(0.1, 0.001, m.clearcoat_gloss)) + 2.0 * coat);
        float rough = sqrt(sqrt(sqr(sqr(max(m.clearcoat_roughness, 0.0))) + 2.0 * coat));
        if (m.clearcoat_roughness >= 0.0) m.clearcoat_roughness = min(rough, 1.0);
        m.clearcoat_gloss = (0.1 - min(gloss, 1.0)) / (0.1 - 0.001);
    }
#endif
}
#endif

// What holds for every model until its own NAME_surface says otherwise.
Surface surface_plain(Material m) {
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
    s.tangent = vec2(1.0, 0.0);
#if HAS_WALKS
    s.walks = 0.0;
    if (material_walks(m)) {
        s.walks = m.subsurface;
        s.subsurface = 0.0;
    }
#endif
    s.event = EVENT_SURFACE;
#if HAS_SCATTERING
    s.g = 0.0;
#endif
    return s;
}

// Whether the noise of the surface comes from the light rather than from where its paths go. It does not for metals
// that nearly mirror, nor for glass, whose paths find the light by themselves.
bool surface_is_broad(Surface s) {
    bool narrow = s.metallic > 0.5 && s.roughness < 0.25;
#if HAS_TRANSMISSION
    narrow = narrow || (model_transmits(s.model) && s.transmission > 0.5);
#endif
    return !narrow || event_is_particle(s.event);
}
