// What only `principled` needs of a Surface; `surface.glsl` puts it there.
#if HAS_PRINCIPLED
    float alpha_sheen;
#if HAS_CONDUCTOR
    vec3 conductor_eta; // above 0 where the metal has indices
    vec3 conductor_k;
    vec3 metal_mean;    // of its reflectance, cosine-weighted
#endif
#endif
