// What only `measured` needs of a Surface; `surface.glsl` puts it there.
#if HAS_MEASURED
    Measured measured; // where its tables are
#endif
