// One triangle of an emitting mesh, sampled uniformly over the solid angle that it fills [Arvo 1995], or by area where
// that angle is small, as fp32 has no digits left for a place inside it then.

#if HAS_TRIANGLE_LIGHTS
// The solid angle, in sr, below which roundings move a place by more than a hundredth of the triangle.
const float TRIANGLE_LIGHT_LEAST = 5e-3;

float triangle_light_area(Triangle t) { return 0.5 * length(cross(t.v1 - t.v0, t.v2 - t.v0)); }

// A triangle as p sees it: unit directions to its first two corners, the part of its second edge across the first
// direction, the angle at the first corner, and the solid angle, which is 0 where it is to be sampled by area.
struct TriangleView {
    vec3 a, b;
    vec3 across; // unit
    float cos_a, sin_a;
    float s;
};

// The solid angle after [Van Oosterom & Strackee 1983, eq. 8], its triple product from edges, so that nothing cancels.
TriangleView triangle_light_view(Triangle tri, vec3 p) {
    TriangleView w;
    vec3 a = tri.v0 - p, b = tri.v1 - p, c = tri.v2 - p, e1 = tri.v1 - tri.v0, e2 = tri.v2 - tri.v0;
    vec3 inv = inversesqrt(vec3(dot(a, a), dot(b, b), dot(c, c)));
    w.a = a * inv.x;
    w.b = b * inv.y;
    vec3 uc = c * inv.z;
    float det = abs(dot(w.a, cross(e1, e2))) * inv.y * inv.z;
    float s = 2.0 * sampling_angle(det, 1.0 + dot(w.a, w.b) + dot(w.a, uc) + dot(w.b, uc));
    w.s = s >= TRIANGLE_LIGHT_LEAST ? s : 0.0;
    vec3 f = e1 - dot(e1, w.a) * w.a, g = e2 - dot(e2, w.a) * w.a;
    float ff = dot(f, f), gg = dot(g, g), scale = inversesqrt(ff * gg);
    w.across = g * inversesqrt(gg);
    w.cos_a = clamp(dot(f, g) * scale, -1.0, 1.0);
    w.sin_a = abs(dot(w.a, cross(f, g))) * scale;
    return w;
}

bool triangle_light_shines(Triangle tri, vec3 p, vec3 ng, uint sides) {
#if HAS_EMISSION_BOTH
    if (sides == 2u && (tri.shape & SINGLE_SIDED) == 0u) return true;
#endif
    return dot(tri.v0 - p, ng) < 0.0;
}

float triangle_light_area_pdf(Triangle tri, float t, vec3 ng, vec3 wi) {
    float c = abs(dot(wi, ng));
    return c > 0.0 ? t * t / (c * triangle_light_area(tri)) : 0.0;
}

float triangle_light_pdf(Triangle tri, vec3 p, float t, vec3 ng, vec3 wi, uint sides) {
    float s = triangle_light_view(tri, p).s;
    if (!triangle_light_shines(tri, p, ng, sides)) return 0.0;
    return s > 0.0 ? 1.0 / s : triangle_light_area_pdf(tri, t, ng, wi);
}

// A direction, uniform over the solid angle. Arvo's u and v are differences of cosines: written in half angles, as the
// squares of sines, they keep their digits for small triangles.
vec3 triangle_light_direction(TriangleView w, vec2 u) {
    float h = 0.5 * u.x * w.s, sh = sin(h), ch = cos(h);
    float sin_s = 2.0 * sh * ch, cos_s = 1.0 - 2.0 * sh * sh;
    vec3 chord = w.b - w.a;
    float s = sin_s * w.cos_a - cos_s * w.sin_a, t = cos_s * w.cos_a + sin_s * w.sin_a;
    float du = 2.0 * sh * (ch * w.sin_a - sh * w.cos_a);
    float dv = sin_s * w.cos_a - w.sin_a * (0.5 * dot(chord, chord) - 2.0 * sh * sh);
    float below = (dv * s + du * t) * w.sin_a;
    float q = below != 0.0 ? clamp(((dv * t - du * s) * w.cos_a - dv) / below, -1.0, 1.0) : 1.0;
    vec3 c = q * w.a + sqrt(1.0 - q * q) * w.across; // the corner of the part that u.x cuts off
    vec3 arc = c - w.b;
    float z = u.y * 0.5 * dot(arc, arc); // 1 - cos of the way from b to c
    vec3 side = arc - dot(arc, w.b) * w.b;
    float length2 = dot(side, side);
    return (1.0 - z) * w.b + sqrt(z * (2.0 - z)) * side * (length2 > 0.0 ? inversesqrt(length2) : 0.0);
}

LightSample triangle_light_sample(Triangle tri, vec3 p, vec2 u, uint sides) {
    TriangleView w = triangle_light_view(tri, p);
    vec2 place = sampling_triangle(u);
    vec3 e1 = tri.v1 - tri.v0, e2 = tri.v2 - tri.v0;
    if (w.s > 0.0) { // where the direction meets the plane
        vec3 d = triangle_light_direction(w, u), o = p - tri.v0;
        vec3 r = cross(d, e2), k = cross(o, e1);
        float inv = 1.0 / dot(r, e1);
        place = clamp(vec2(dot(o, r), dot(d, k)) * inv, vec2(0.0), vec2(1.0));
        place /= max(1.0, place.x + place.y);
    }
    SurfacePoint at = triangle_point(tri, place, 0u, NONE);
    if (!triangle_light_shines(tri, p, at.ng, sides)) return lights_none();
    vec3 to = shapes_leave(at, p - at.p) - p;
    float t = length(to);
    vec3 wi = t > 0.0 ? to / t : at.ng;
    return LightSample(wi, t, vec3(1.0), w.s > 0.0 ? 1.0 / w.s : triangle_light_area_pdf(tri, t, at.ng, wi), true,
                       NONE);
}
#endif

void triangle_light_sample_case(Light l, vec3 p, vec2 u, Emitter e, inout LightSample s) {
#if HAS_TRIANGLE_LIGHTS
    if (l.kind == LIGHT_TRIANGLE) {
        s = triangle_light_sample(triangle_pick(l.index), p, u, e.sides);
        s.id = (SHAPE_TRIANGLE << LEAF_KIND_SHIFT) | l.index;
    }
#endif
}

void triangle_light_pdf_case(Hit hit, vec3 p, SurfacePoint at, vec3 wi, Emitter e, inout float pdf) {
#if HAS_TRIANGLE_LIGHTS
    if (hit.id >> LEAF_KIND_SHIFT == SHAPE_TRIANGLE) {
        pdf = triangle_light_pdf(triangle_pick(hit.id & LEAF_FIRST_MASK), p, hit.t, at.ng, wi, e.sides);
    }
#endif
}

#if CAUSTICS
void triangle_light_place_case(Light l, vec2 u, inout LightPlace at) {
#if HAS_TRIANGLE_LIGHTS
    if (l.kind == LIGHT_TRIANGLE) {
        Triangle s = triangle_pick(l.index);
        at.uv = sampling_triangle(u);
        at.p = s.v0 + at.uv.x * (s.v1 - s.v0) + at.uv.y * (s.v2 - s.v0);
        at.id = (SHAPE_TRIANGLE << LEAF_KIND_SHIFT) | l.index;
        at.pdf_area = 1.0 / triangle_light_area(s);
    }
#endif
}
#endif
