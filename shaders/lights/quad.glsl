// A parallelogram that shines on one side, or on both. A rectangle is sampled uniformly over the solid angle that it
// fills [Urena, Fajardo, King 2013]. Other shapes are sampled by area, and so are rectangles of small solid angle,
// where fp32 has no digits left for a place inside them.

#if HAS_QUAD_LIGHTS
// The solid angle, in sr, below which a rounding of the angles moves a place by a thousandth of the rectangle.
const float QUAD_LIGHT_LEAST = 2e-3;

// A rectangle as p sees it: the ranges of its coordinates along u and v from p, its plane's distance, and its solid
// angle, which is 0 where the quad is to be sampled by area.
struct QuadView {
    float x0, x1, y0, y1, z;
    float a, d; // distances of the corners (x0, y0) and (x0, y1)
    float s;
};

// The solid angle by two triangles [Van Oosterom & Strackee 1983, eq. 8], whose triple products are one height times
// area, in which nothing cancels; the two angles are added as the arguments of complex numbers.
QuadView quad_light_view(Quad q, vec3 p) {
    QuadView w;
    vec3 o = q.origin - p;
    // In units of the edges' sum: products of six lengths below stay in range, or leave it for the area's sake.
    float unit = 1.0 / (q.u_length + q.v_length);
    float lu = q.u_length * unit, lv = q.v_length * unit;
    w.x0 = dot(o, q.dual_u) * unit;
    w.y0 = dot(o, q.dual_v) * unit;
    w.x1 = w.x0 + lu;
    w.y1 = w.y0 + lv;
    w.z = abs(dot(o, q.normal)) * unit;
    float z2 = w.z * w.z, xx = w.x0 * w.x1 + z2, yy = w.y0 * w.y1 + z2;
    vec2 x2 = vec2(w.x0 * w.x0, w.x1 * w.x1), y2 = vec2(w.y0 * w.y0, w.y1 * w.y1);
    vec4 l = sqrt(vec4(x2.xyy, x2.x) + vec4(y2.xxy, y2.y) + z2); // corners in turn: a, b, c, d
    float ac = w.x0 * w.x1 + w.y0 * w.y1 + z2, ab = xx + y2.x, cd = xx + y2.y, bc = yy + x2.y, ad = yy + x2.x;
    float h = w.z * lu * lv;
    float d1 = l.x * l.y * l.z + ab * l.z + ac * l.y + bc * l.x;
    float d2 = l.x * l.z * l.w + ac * l.w + ad * l.z + cd * l.x;
    float s = 2.0 * sampling_angle(h * (d1 + d2), d1 * d2 - h * h);
    bool rectangle = !disk_is(q) && abs(dot(q.dual_u, q.dual_v)) <= 1e-5;
    w.s = rectangle && s >= QUAD_LIGHT_LEAST ? s : 0.0;
    w.a = l.x;
    w.d = l.w;
    return w;
}

float quad_light_area_pdf(Quad q, float t, vec3 wi) {
    float c = abs(dot(wi, q.normal));
    return c > 0.0 ? t * t / (c * q.area) : 0.0;
}

bool quad_light_shines(Quad q, vec3 p, uint sides) { return sides == 2u || dot(q.origin - p, q.normal) < 0.0; }

float quad_light_pdf(Quad q, vec3 p, float t, vec3 wi, uint sides) {
    float s = quad_light_view(q, p).s;
    if (!quad_light_shines(q, p, sides)) return 0.0;
    return s > 0.0 ? 1.0 / s : quad_light_area_pdf(q, t, wi);
}

// The place along u and v, 0..1, uniform over the solid angle. The paper's k, the sum of two angles between the planes
// through the edges, is made as its cosine and sine, which are exact where arc cosines are not.
vec2 quad_light_place(QuadView w, vec2 u) {
    float z2 = w.z * w.z, a0 = w.y0 * w.y0 + z2, a1 = w.y1 * w.y1 + z2;
    float r0 = inversesqrt(a0), r1 = inversesqrt(a1);
    vec2 k = vec2(w.x0 * w.x0 * w.y0 * w.y1 + z2 * w.a * w.d, w.x0 * w.z * (w.y1 * w.a - w.y0 * w.d));
    k *= -r0 * r1 / (w.x0 * w.x0 + z2);
    float part = u.x * w.s, c = cos(part), s = sin(part);
    vec2 turn = vec2(c * k.x - s * k.y, s * k.x + c * k.y); // of the paper's au
    float n = -(w.y0 * r0 * turn.x + w.y1 * r1); // its fu times sin au
    float rest = n * n - z2 * r0 * r0 * turn.y * turn.y;
    float x = (n > 0.0 ? w.z : -w.z) * turn.y * inversesqrt(max(rest, 1e-30));
    x = clamp(x, w.x0, w.x1);
    float d2 = x * x + z2;
    float h = mix(w.y0 * inversesqrt(d2 + w.y0 * w.y0), w.y1 * inversesqrt(d2 + w.y1 * w.y1), u.y);
    float y = clamp(h * sqrt(d2 / max(1.0 - h * h, 1e-12)), w.y0, w.y1);
    return vec2(x - w.x0, y - w.y0) / vec2(w.x1 - w.x0, w.y1 - w.y0);
}

LightSample quad_light_sample(Quad q, vec3 p, vec2 u, uint sides) {
    QuadView w = quad_light_view(q, p);
    if (!quad_light_shines(q, p, sides)) return lights_none();
    vec2 place = w.s > 0.0 ? quad_light_place(w, u) : disk_is(q) ? disk_light_place(u) : u;
    SurfacePoint at;
    at.p = q.origin + place.x * q.u + place.y * q.v;
    at.ng = q.normal;
    at.error = gamma_error(6.0) * (abs(q.origin) + abs(q.u) + abs(q.v));
    vec3 to = shapes_leave(at, p - q.origin) - p; // on the side that it is seen from
    float t = length(to);
    vec3 wi = t > 0.0 ? to / t : q.normal;
    return LightSample(wi, t, vec3(1.0), w.s > 0.0 ? 1.0 / w.s : quad_light_area_pdf(q, t, wi), true, NONE);
}

// The quad of a light. Where only one quad emits, as in many a room, it is loaded from a constant place:
// docs/development.md says how much time this saves.
Quad quad_light_load(uint i) {
#if QUAD_LAMP >= 0
    return quad_load(uint(QUAD_LAMP));
#else
    return quad_pick(i);
#endif
}
#endif

void quad_light_sample_case(Light l, vec3 p, vec2 u, Emitter e, inout LightSample s) {
#if HAS_QUAD_LIGHTS
    if (l.kind == LIGHT_QUAD) {
        s = quad_light_sample(quad_light_load(l.index), p, u, e.sides);
        s.id = (SHAPE_QUAD << LEAF_KIND_SHIFT) | l.index;
    }
#endif
}

void quad_light_pdf_case(Hit hit, vec3 p, vec3 wi, Emitter e, inout float pdf) {
#if HAS_QUAD_LIGHTS
    if (hit.id >> LEAF_KIND_SHIFT == SHAPE_QUAD) {
        pdf = quad_light_pdf(quad_light_load(hit.id & LEAF_FIRST_MASK), p, hit.t, wi, e.sides);
    }
#endif
}

#if CAUSTICS
void quad_light_place_case(Light l, vec2 u, inout LightPlace at) {
#if HAS_QUAD_LIGHTS
    if (l.kind == LIGHT_QUAD) {
        Quad s = quad_light_load(l.index);
        vec2 place = disk_is(s) ? disk_light_place(u) : u;
        at.p = s.origin + place.x * s.u + place.y * s.v;
        at.id = (SHAPE_QUAD << LEAF_KIND_SHIFT) | l.index;
        at.pdf_area = 1.0 / s.area;
    }
#endif
}
#endif
