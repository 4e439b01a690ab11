const float PI = 3.14159265358979;
const float TWO_PI = 6.28318530717959;
const float INV_PI = 0.318309886183791;
// The distance in metres that stands for infinity. It is farther than any hit, as coordinates end at 1e9, and stays
// finite when a constant multiplies it: with 3e38 a compiler that turns exp(-rate * t) into exp2(rate * (-1.44 t)) made
// infinity of it, and NaN where the rate is 0.
const float INFINITY_T = 1.0e30;
const float ULP = 5.9604645e-8;  // 2^-24, the largest relative rounding error of one float operation

// n ulps, bounding n successive roundings [Higham 2002, lemma 3.1].
float gamma_error(float n) { return n * ULP / (1.0 - n * ULP); }

float luminance(vec3 c) { return dot(c, LUMINANCE); }
float max_component(vec3 c) { return max(c.x, max(c.y, c.z)); }
float sqr(float x) { return x * x; }
