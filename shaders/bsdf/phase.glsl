// The phase function of Henyey and Greenstein [1941]; directions are in a frame whose z is wo, away from the particle.
#if HAS_SCATTERING
// Its value, which is also the density of phase_sample. What light turns by is the angle between -wo and wi; the terms are
// ordered so that nothing cancels where g is close to 1 or -1.
Scatter phase_eval(float g, vec3 wo, vec3 wi) {
    vec3 from = g < 0.0 ? wi - wo : wi + wo;
    float a = abs(g), d = (1.0 - a) * (1.0 - a) + a * dot(from, from);
    float p = 0.25 * INV_PI * (1.0 - a) * (1.0 + a) / (d * sqrt(d));
    return Scatter(vec3(p), p);
}

vec3 phase_sample(float g, vec2 u) {
    float a = abs(g), d = (1.0 - a) + 2.0 * a * (1.0 - u.x);
    float m = min((1.0 - a) * (1.0 - a) * u.x * ((1.0 + a) / d + 1.0) / d, 2.0); // 1 - |cosine of the turn|
    float r = sqrt(m * (2.0 - m)), phi = TWO_PI * u.y;
    return vec3(r * cos(phi), r * sin(phi), g < 0.0 ? 1.0 - m : m - 1.0);
}
#endif
