// Powers of a cosine, and directions so distributed: the highlights of `blinn_phong` and `phong`.

// wm.z^n. Near the pole it is taken from the sine, as z itself is rounded: at n = 1e6 that would be 6 % off.
float blinn_phong_power(vec3 wm, float n) {
    float x = dot(wm.xy, wm.xy); // sin^2
    float series = -x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * (0.25 + x * 0.2)))); // log(1 - x)
    float log_cos2 = x < 0.1 ? series : 2.0 * log(max(wm.z, 1e-30));
    return exp(0.5 * n * log_cos2);
}

// A direction about z with the density (n + 1) / (2 pi) z^n.
vec3 blinn_phong_lobe(float n, vec2 u) {
    float y = 2.0 / (n + 1.0) * log(1.0 - u.y); // of z^2
    float tail = -y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0 + y * (1.0 / 120.0)))));
    float sin2 = clamp(y > -0.1 ? tail : 1.0 - exp(y), 0.0, 1.0);
    float r = sqrt(sin2), phi = TWO_PI * u.x;
    return vec3(r * cos(phi), r * sin(phi), sqrt(1.0 - sin2));
}
