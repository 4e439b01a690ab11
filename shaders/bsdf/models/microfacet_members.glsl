// What only `microfacet` needs of a Surface; `surface.glsl` puts it there.
#if HAS_MICROFACET
    Microfacet terms;    // with their parameters
    float terms_ior;     // of its dielectric
    float log_factor;    // of its distribution, from its table
    uint row;            // the texel where its table's row for its alpha begins,
    uint row_above;      // that of the next one,
    float row_share;     // and how far alpha is on the way there
#endif
