// Maps from the unit square to the shapes that are sampled.

// The unit disk: areas are preserved, squares become circles [Shirley & Chiu 1997].
vec2 sampling_disk(vec2 u) {
    vec2 s = 2.0 * u - 1.0;
    bool wide = abs(s.x) > abs(s.y);
    float r = wide ? s.x : s.y;
    float ratio = r == 0.0 ? 0.0 : (wide ? s.y : s.x) / r;
    float angle = ratio * (PI / 4.0);
    float major = cos(angle), minor = sin(angle);
    return r * (wide ? vec2(major, minor) : vec2(minor, major));
}

// The hemisphere about +z with density cos(theta) / pi [Malley].
vec3 sampling_cosine(vec2 u) {
    vec2 d = sampling_disk(u);
    return vec3(d, sqrt(max(0.0, 1.0 - dot(d, d))));
}

// The hemisphere about +z with density 1 / (2 pi).
vec3 sampling_hemisphere(vec2 u) {
    float r = sqrt(max(0.0, 1.0 - u.x * u.x));
    float phi = TWO_PI * u.y;
    return vec3(r * cos(phi), r * sin(phi), u.x);
}

// The sphere with density 1 / (4 pi).
vec3 sampling_sphere(vec2 u) {
    float z = 1.0 - 2.0 * u.x;
    float r = sqrt(max(0.0, 4.0 * u.x * (1.0 - u.x))); // 1 - z^2 without cancelling
    float phi = TWO_PI * u.y;
    return vec3(r * cos(phi), r * sin(phi), z);
}

// The cone about +z of all directions with 1 - cos below `cap`, uniformly. 1 - cos does not cancel in narrow cones.
vec3 sampling_cone(float cap, vec2 u) {
    float h = u.x * cap; // 1 - cos theta
    float r = sqrt(h * (2.0 - h)), phi = TWO_PI * u.y;
    return vec3(r * cos(phi), r * sin(phi), 1.0 - h);
}

// A triangle, uniformly: the barycentric weights of its second and third vertex [Heitz 2019, low distortion].
vec2 sampling_triangle(vec2 u) {
    vec2 b = u * 0.5;
    float d = u.y - u.x;
    return d > 0.0 ? vec2(b.x, b.y + d * 0.5) : vec2(b.x - d * 0.5, b.y);
}

// The angle of (x, y) with y >= 0, to a relative error of 7e-7: an odd polynomial, fitted to atan on [0, 1]. It is
// cheaper than atan(y, x), which handles all quadrants.
float sampling_angle(float y, float x) {
    float a = abs(x), r = min(a, y) / max(a, y), q = r * r;
    float angle = 0.0838723022 + q * (-0.0370138848 + q * 0.00786364667);
    angle = r * (0.999999349 + q * (-0.333265174 + q * (0.198815021 + q * (-0.134872584 + q * angle))));
    if (y > a) angle = 0.5 * PI - angle;
    return x < 0.0 ? PI - angle : angle;
}

// The power heuristic with exponent 2 [Veach 1997, section 9.2.4]. It takes the ratio, as a and b may be huge.
float power_heuristic(float a, float b) {
    float r = b / a;
    return 1.0 / (1.0 + r * r);
}

// An offset in the pixel, importance-sampled from the reconstruction filter, so that every sample has weight one
// [Ernst, Stamminger, Greiner 2006]. The table holds the inverse of the half profile's distribution, in pixels, at
// 1 - (1 - k / n)^4, which is dense in the tail, where the inverse is steep.
layout(std140, binding = FILTER_BLOCK) uniform filter_block { vec4 filter_table[FILTER_TABLE_SIZE + 1]; };

float sampling_filter_axis(float u) {
    float tail = sqrt(sqrt(1.0 - abs(2.0 * u - 1.0)));
    float s = (1.0 - tail) * float(FILTER_TABLE_SIZE);
    uint k = min(uint(s), uint(FILTER_TABLE_SIZE - 1));
    float r = mix(filter_table[k].x, filter_table[k + 1u].x, s - float(k));
    return u < 0.5 ? -r : r;
}

// How far the filter reaches, in pixels, and its density along one axis, which is tabulated at even steps up to there.
float sampling_filter_radius() { return filter_table[FILTER_TABLE_SIZE].x; }

float sampling_filter_density(float x) {
    float s = abs(x) / sampling_filter_radius() * float(FILTER_TABLE_SIZE);
    uint k = min(uint(s), uint(FILTER_TABLE_SIZE - 1));
    return s <= float(FILTER_TABLE_SIZE) ? mix(filter_table[k].y, filter_table[k + 1u].y, s - float(k)) : 0.0;
}

vec2 sampling_filter(vec2 u) { return vec2(sampling_filter_axis(u.x), sampling_filter_axis(u.y)); }
