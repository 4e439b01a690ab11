// Fit of ACES' reference and output transforms by Stephen Hill, without a prescale. GLSL's matrices are columns.
vec3 aces_curve(vec3 c) {
    const mat3 inset = mat3(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    const mat3 outset = mat3(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    vec3 y = min(inset * c, vec3(1e8)); // the curve is within 1e-8 of its limit there, and y^2 stays finite
    y = (y * (y + 0.0245786) - 0.000090537) / (y * (0.983729 * y + 0.4329510) + 0.238081);
    return outset * y;
}
