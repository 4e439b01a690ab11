// Distances that are drawn towards lamps, evenly in the angle that these see [Kulla and Fajardo 2012, "Importance Sampling
// Techniques for Path Tracing in Participating Media"]. A lamp's light grows with the inverse square of the distance, which
// no other density of distances follows, so that fog around a small lamp would be speckled.

#if ANY_EQUIANGULAR
const float EQUIANGULAR_MOST = 0.5;  // of the chance that the distance is drawn so
const float EQUIANGULAR_DEPTH = 5.0; // mean free paths beyond which none is
const float EQUIANGULAR_LEAST = 1e-3; // of the angle for a lamp to be drawn towards: few numbers lie within less

// A lamp in each component.
struct Equiangular {
    vec4 chances; // of drawing the distance towards it
    vec4 along;   // where the ray is closest to it
    vec4 apart;   // how far from it
    vec4 begin;   // the angle there
    vec4 span;    // of the angles of all distances up to `far`
    float far;
};

// That of a ray which goes `t` metres at most, losing `rate` a metre. The chances follow what each lamp sends through a ray
// of particles alike. They are small where the ray is hardly scattered, and where a lamp is so far away that its density
// would be even.
Equiangular equiangular_make(vec3 o, vec3 d, float t, float rate) {
    vec4 x = uniforms.lamps_x - o.x, y = uniforms.lamps_y - o.y, z = uniforms.lamps_z - o.z;
    vec4 across_x = y * d.z - z * d.y, across_y = z * d.x - x * d.z, across_z = x * d.y - y * d.x;
    Equiangular e;
    e.far = min(t, EQUIANGULAR_DEPTH / max(rate, 1.0 / INFINITY_T));
    e.along = x * d.x + y * d.y + z * d.z;
    vec4 nearest = 1e-4 * sqrt(x * x + y * y + z * z) + 1e-10; // of a lamp that the ray hits: any density may be drawn from
    e.apart = max(sqrt(across_x * across_x + across_y * across_y + across_z * across_z), nearest);
    e.begin = atan(-e.along, e.apart);
    vec4 span = atan(e.far - e.along, e.apart) - e.begin;
    e.span = max(span, EQUIANGULAR_LEAST);
    vec4 sent = step(EQUIANGULAR_LEAST, span) * uniforms.lamps_intensity * span / e.apart;
    float all = sent.x + sent.y + sent.z + sent.w;
    float most = EQUIANGULAR_MOST * (1.0 - exp(-rate * e.far));
    e.chances = all > 0.0 && all < INFINITY_T ? most * min(e.span, 1.0) * sent / all : vec4(0.0);
    return e;
}

float equiangular_chance(Equiangular e) { return e.chances.x + e.chances.y + e.chances.z + e.chances.w; }

// The distance for a u below equiangular_chance.
float equiangular_sample(Equiangular e, float u) {
    float left = u;
    uint i = 0u;
    for (uint k = 0u; k < 4u; k++) {
        if (e.chances[k] > 0.0 && left >= 0.0) {
            i = k;
            u = left;
            left -= e.chances[k];
        }
    }
    u = min(u / max(e.chances[i], 1e-30), 1.0);
    return clamp(e.along[i] + e.apart[i] * tan(e.begin[i] + u * e.span[i]), 0.0, e.far);
}

// Of the distance t, times the chance of drawing it so.
float equiangular_pdf(Equiangular e, float t) {
    vec4 off = t - e.along;
    vec4 pdfs = e.chances * e.apart / (e.span * (e.apart * e.apart + off * off));
    return t <= e.far ? pdfs.x + pdfs.y + pdfs.z + pdfs.w : 0.0;
}
#endif
