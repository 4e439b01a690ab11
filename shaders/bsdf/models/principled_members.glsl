// What only `principled` needs of a Surface; `surface.glsl` puts it there.
#if HAS_PRINCIPLED
    float eta_outside;     // index inside over outside
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
    float sheen_albedo;    // the share that the sheen keeps from what is under it
#endif
