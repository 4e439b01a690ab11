// Khronos PBR Neutral: colours below 0.8 stay as they are; highlights are rolled off and desaturated.
vec3 pbr_neutral_curve(vec3 c) {
    const float start = 0.8 - 0.04, desaturation = 0.15;
    float x = min(c.r, min(c.g, c.b));
    float offset = x < 0.08 ? x - 6.25 * x * x : 0.04;
    c -= offset;
    float peak = max(c.r, max(c.g, c.b));
    if (peak < start) return c;
    const float d = 1.0 - start;
    float pressed = 1.0 - d * d / (peak + d - start);
    c = (c / peak) * pressed;
    float g = 1.0 - 1.0 / (desaturation * (peak - pressed) + 1.0);
    return mix(c, vec3(pressed), g);
}
