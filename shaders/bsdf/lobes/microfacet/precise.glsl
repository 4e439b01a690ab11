// Logarithms, exponentials and angles to a few ulps: exponents up to 1e6 multiply their errors, and drivers promise
// 2^-21 for log2 and little for atan.
#if HAS_MICROFACET

// log(x), given also x - 1, which the caller may know more precisely than x itself.
float precise_log(float x, float less_one) {
    uint bits = floatBitsToUint(max(x, 1.2e-38)); // the least normal number
    int exponent = int(bits >> 23) - 127;
    float m = uintBitsToFloat((bits & 0x7FFFFFu) | 0x3F800000u);
    if (m > 1.41421356) {
        m *= 0.5;
        exponent++;
    }
    float z = exponent == 0 ? less_one / (2.0 + less_one) : (m - 1.0) / (m + 1.0), z2 = z * z;
    float series = 2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (0.2 + z2 * (1.0 / 7.0 + z2 * (1.0 / 9.0)))));
    return float(exponent) * 0.693147181 + series;
}

float precise_log1p(float x) { return precise_log(1.0 + x, x); }

// exp(x) - 1; at |x| = 0.3 the series is 4e-8 of its value off.
float precise_expm1(float x) {
    float series = x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0)))));
    return abs(x) < 0.3 ? series : exp(x) - 1.0;
}

// The angle of sine s and cosine c, 0 to 90 degrees: four times that of a quarter's tangent, by its series.
float precise_angle(float s, float c) {
    float half_tan = s / (1.0 + c);
    float t = half_tan / (1.0 + sqrt(1.0 + half_tan * half_tan)), t2 = t * t;
    float tail = 1.0 / 9.0 - t2 * (1.0 / 11.0 - t2 * (1.0 / 13.0 - t2 * (1.0 / 15.0 - t2 / 17.0)));
    return 4.0 * t * (1.0 - t2 * (1.0 / 3.0 - t2 * (0.2 - t2 * (1.0 / 7.0 - t2 * tail))));
}
#endif
