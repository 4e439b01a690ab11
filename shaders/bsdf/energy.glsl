// Tables of the lobes' albedos, which gpu/tables/build/energy_tables.py makes. The texture unit interpolates along all
// their axes.
#if ANY_NEEDS_TABLES
layout(binding = ENERGY_ALBEDO_TEXTURE) uniform sampler3D energy_albedo_table; // cosine, roughness, eta
layout(binding = ENERGY_MEAN_TEXTURE) uniform sampler3D energy_mean_table;     // roughness, round or aspect, eta
layout(binding = ENERGY_SHEEN_TEXTURE) uniform sampler3D energy_sheen_table;   // cosine, sheen roughness

// The texture coordinate of a place 0..1 between the middles of the first and the last of n texels.
float energy_place(float x, int n) { return (clamp(x, 0.0, 1.0) * float(n - 1) + 0.5) / float(n); }

float energy_eta(float eta) {
    float end = (ENERGY_LARGEST_ETA - 1.0) / (ENERGY_LARGEST_ETA + 1.0);
    return sqrt((eta - 1.0) / (eta + 1.0) / end);
}

float energy_roughness(float roughness) { return pow(roughness, 2.0 / 3.0); }

float energy_aspect(float aspect) { return clamp(log(aspect) / log(ENERGY_LEAST_ASPECT), 0.0, 1.0); }

#if HAS_ANISOTROPIC
// cosine; azimuth, all of them for each eta; roughness, all of them for each aspect
layout(binding = ENERGY_STRETCHED_TEXTURE) uniform sampler3D energy_stretched_table;

// energy_albedo of a stretched lobe; w is in the lobe's own frame.
vec4 energy_stretched(vec3 w, float roughness, float aspect, float eta) {
    vec2 a = abs(w.xy);
    float azimuth = a.x + a.y > 0.0 ? atan(a.x, a.y) * (2.0 * INV_PI) : 1.0; // from the short axis
    azimuth = pow(azimuth, ENERGY_AZIMUTH_POWER);
    float x = energy_place(sqrt(abs(w.z)), ENERGY_COSINES), y = azimuth * float(ENERGY_AZIMUTHS - 1) + 0.5;
    float z = clamp(energy_roughness(roughness), 0.0, 1.0) * float(ENERGY_STEPS - 1) + 0.5;
    float s = energy_aspect(aspect) * float(ENERGY_ASPECTS - 1), e = energy_eta(eta) * float(ENERGY_ETAS - 1);
    int k = min(int(s), ENERGY_ASPECTS - 2), m = min(int(e), ENERGY_ETAS - 2);
    vec2 inv = 1.0 / vec2(ENERGY_ETAS * ENERGY_AZIMUTHS, ENERGY_ASPECTS * ENERGY_STEPS);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 2; i++) {
        vec2 yz = inv * vec2(float((m + i) * ENERGY_AZIMUTHS) + y, float(k * ENERGY_STEPS) + z);
        vec4 low = texture(energy_stretched_table, vec3(x, yz));
        vec4 high = texture(energy_stretched_table, vec3(x, yz.x, yz.y + inv.y * float(ENERGY_STEPS)));
        float share = abs(e - float(m + 1 - i));
        sum += share * mix(low, high, s - float(k));
    }
    return sum;
}
#endif

// Four shares of the light from w, in the lobe's own frame, after one scattering by microfacets. x: what is reflected
// if all facets reflect everything. y: what facets of index eta reflect, never too low. z and w: what is lost between
// the facets of glass, seen from outside and from inside.
vec4 energy_albedo(vec3 w, float roughness, float aspect, float eta) {
#if HAS_ANISOTROPIC
    if (aspect < 1.0) return energy_stretched(w, roughness, aspect, eta);
#endif
    ivec3 n = textureSize(energy_albedo_table, 0);
    float x = energy_place(sqrt(abs(w.z)), n.x), z = energy_place(energy_eta(eta), n.z);
    return texture(energy_albedo_table, vec3(x, energy_place(energy_roughness(roughness), n.y), z));
}

// The cosine-weighted means of these shares.
vec4 energy_mean(float roughness, float aspect, float eta) {
    ivec3 n = textureSize(energy_mean_table, 0);
    float y = 0.5; // round lobes have a row of their own
#if HAS_ANISOTROPIC
    if (aspect < 1.0) y = 1.5 + energy_aspect(aspect) * float(ENERGY_ASPECTS - 1);
#endif
    float x = energy_place(energy_roughness(roughness), n.x);
    return texture(energy_mean_table, vec3(x, y / float(n.y), energy_place(energy_eta(eta), n.z)));
}

#if HAS_FILM
layout(binding = ENERGY_FACETS_TEXTURE) uniform sampler3D energy_facets_table; // cosine, roughness, layer

// Gauss's rules for means over the facets, by the light's cosine at them; c is its cosine at the surface. Layer 0: four
// of these cosines; 1: their weights; 2 and 3: the same for cosine-weighted means over all directions; 4 to 7: the same
// over all facets that the light meets, not only those that reflect it to its own side.
vec4 energy_facets(float c, float roughness, float layer) {
    ivec3 n = textureSize(energy_facets_table, 0);
    float x = energy_place(sqrt(abs(c)), n.x), y = energy_place(energy_roughness(roughness), n.y);
    return texture(energy_facets_table, vec3(x, y, (layer + 0.5) / float(n.z)));
}
#endif

// The albedo of a white sheen from a direction of cosine c.
float energy_sheen(float c, float roughness) {
    ivec3 n = textureSize(energy_sheen_table, 0);
    float y = energy_place((roughness - ENERGY_LEAST_SHEEN_ROUGHNESS) / (1.0 - ENERGY_LEAST_SHEEN_ROUGHNESS), n.y);
    return texture(energy_sheen_table, vec3(energy_place(sqrt(abs(c)), n.x), y, 0.5)).x;
}
#endif
