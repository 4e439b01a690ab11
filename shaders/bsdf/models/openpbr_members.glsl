// What only `openpbr` needs of a Surface; `surface.glsl` puts it there.
#if HAS_OPENPBR
    float specular_weight;
    vec3 matte_color;      // of the diffuse base
    bool bare;             // wo is inside a body that transmits, where no layer is seen
    bool turned_out;       // the index is below 1: the denser side is the outer one
    float diffuse_roughness;
    float fuzz_weight;
    vec3 fuzz;             // of the lobe for wo: two numbers of the transform, and the albedo
    vec2 alpha_coat_2;     // of the coat's facets, along its x and y
    vec2 coat_tangent;     // direction in the shading frame that the coat's anisotropy stretches along
    float coat_aspect;
    float coat_eta;
    float coat_excess;     // as `excess`
    vec3 coat_color;
    vec3 coat_darkening;   // what is left of the base's light after the reflections inside the coat
#endif
