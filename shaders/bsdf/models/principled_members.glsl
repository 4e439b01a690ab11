// What only `principled` needs of a Surface; `surface.glsl` puts it there.
#if HAS_PRINCIPLED
    float alpha_sheen;
#endif
