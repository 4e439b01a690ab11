// Tables of what lobes send back, made by gpu/energy_tables.py: interpolated in all their axes by the sampler.
#if HAS_PRINCIPLED
layout(binding = ENERGY_ALBEDO_TEXTURE) uniform sampler3D energy_albedo_table; // cosine, roughness, eta
layout(binding = ENERGY_MEAN_TEXTURE) uniform sampler3D energy_mean_table;     // roughness, aspect, eta
layout(binding = ENERGY_SHEEN_TEXTURE) uniform sampler3D energy_sheen_table;   // cosine, sheen roughness

// Texture coordinate of a place 0..1 between the middles of the first and last of n texels.
float energy_place(float x, int n) { return (clamp(x, 0.0, 1.0) * float(n - 1) + 0.5) / float(n); }

float energy_eta(float eta) {
    float end = (ENERGY_LARGEST_ETA - 1.0) / (ENERGY_LARGEST_ETA + 1.0);
    return sqrt((eta - 1.0) / (eta + 1.0) / end);
}

float energy_roughness(float roughness) { return pow(roughness / ENERGY_ROUGHNESS_END, 2.0 / 3.0); }

#if HAS_ANISOTROPIC
layout(binding = ENERGY_ALIKE_TEXTURE) uniform sampler3D energy_alike_table; // cosine, |cos phi|, roughness by aspect

// The roughness of the round lobe that keeps as much light from w (in the lobe's own frame) as the stretched one does,
// how much that is, and what glass of the common index loses.
vec4 energy_alike(vec3 w, float roughness, float aspect) {
    ivec3 n = textureSize(energy_alike_table, 0);
    int steps = n.z / ENERGY_ASPECTS;
    float across = dot(w.xy, w.xy);
    float cos_phi = across > 0.0 ? abs(w.x) * inversesqrt(across) : 1.0;
    float x = energy_place(sqrt(abs(w.z)), n.x), y = energy_place(cos_phi, n.y);
    float at = clamp((1.0 - aspect) / (1.0 - ENERGY_LEAST_ASPECT), 0.0, 1.0) * float(ENERGY_ASPECTS - 1);
    int k = min(int(at), ENERGY_ASPECTS - 2);
    float z = pow(clamp(roughness, 0.0, 1.0), 2.0 / 3.0) * float(steps - 1) + 0.5;
    vec4 low = texture(energy_alike_table, vec3(x, y, (z + float(k * steps)) / float(n.z)));
    vec4 high = texture(energy_alike_table, vec3(x, y, (z + float((k + 1) * steps)) / float(n.z)));
    return mix(low, high, at - float(k)) * vec4(ENERGY_ROUGHNESS_END, 1.0, 1.0, 1.0);
}
#endif

// Shares of the light from w (in the lobe's own frame) that one scattering by a microfacet surface: reflects where
// all is reflected; reflects by eta's Fresnel, never too low; loses where glass is entered; where it is left.
vec4 energy_albedo(vec3 w, float roughness, float aspect, float eta) {
#if HAS_ANISOTROPIC
    float given = roughness;
    vec4 alike = vec4(0.0);
    if (aspect < 1.0) {
        alike = energy_alike(w, roughness, aspect);
        roughness = alike.x;
    }
#endif
    ivec3 n = textureSize(energy_albedo_table, 0);
    float x = energy_place(sqrt(abs(w.z)), n.x), z = energy_place(energy_eta(eta), n.z);
    vec4 kept = texture(energy_albedo_table, vec3(x, energy_place(energy_roughness(roughness), n.y), z));
#if HAS_ANISOTROPIC
    if (aspect < 1.0) {
        // The greatest share of it that a roughness between those along and across reflects: never too low.
        vec3 across = vec3(x, energy_place(energy_roughness(given * sqrt(aspect)), n.y), z);
        vec3 along = vec3(x, energy_place(energy_roughness(given * inversesqrt(aspect)), n.y), z);
        vec2 a = texture(energy_albedo_table, across).xy, b = texture(energy_albedo_table, along).xy;
        kept.y = alike.y * min(1.0, max(kept.y / max(kept.x, 1e-6), max(a.y / max(a.x, 1e-6), b.y / max(b.x, 1e-6))));
        kept.x = alike.y;
        float usual_z = energy_place(energy_eta(ENERGY_COMMON_ETA), n.z);
        vec3 usual = vec3(x, energy_place(energy_roughness(roughness), n.y), usual_z);
        vec2 ratio = min(kept.zw / max(texture(energy_albedo_table, usual).zw, 1e-4), 2.0);
        kept.zw = min(alike.zw * ratio, 1.0);
    }
#endif
    return kept;
}

// Their cosine-weighted means.
vec4 energy_mean(float roughness, float aspect, float eta) {
    ivec3 n = textureSize(energy_mean_table, 0);
    float y = energy_place((1.0 - aspect) / (1.0 - ENERGY_LEAST_ASPECT), n.y);
    float x = energy_place(energy_roughness(roughness), n.x);
    return texture(energy_mean_table, vec3(x, y, energy_place(energy_eta(eta), n.z)));
}

float energy_sheen(float c, float roughness) {
    ivec3 n = textureSize(energy_sheen_table, 0);
    float y = energy_place((roughness - ENERGY_LEAST_SHEEN_ROUGHNESS) / (1.0 - ENERGY_LEAST_SHEEN_ROUGHNESS), n.y);
    return texture(energy_sheen_table, vec3(energy_place(sqrt(abs(c)), n.x), y, 0.5)).x;
}
#endif
