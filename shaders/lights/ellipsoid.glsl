// An ellipsoid, sampled uniformly over the unit sphere that it is an image of. An area element of that sphere with
// normal n grows by |det A| |A^-T n| under the map A. The ellipsoid's inner side is seen from inside, and through the
// near half where a ray may pass that, with the chance `transparency`.

#if HAS_ELLIPSOID_LIGHTS
float ellipsoid_light_density(Solid s, vec3 q) { // per area
    mat3 axes = solid_axes(s);
    vec3 n = q.x * s.row_x + q.y * s.row_y + q.z * s.row_z;
    return 1.0 / (4.0 * PI * abs(determinant(axes)) * length(n));
}

float ellipsoid_light_pdf(Solid s, float t, SurfacePoint at, vec3 wi, uint sides) {
    float c = -dot(wi, at.ng);
#if HAS_EMISSION_BOTH
    if (sides == 2u) c = abs(c);
#endif
    return c > 0.0 ? ellipsoid_light_density(s, normalize(solid_rows(s, at.p - s.center))) * t * t / c : 0.0;
}

LightSample ellipsoid_light_sample(Solid s, vec3 p, vec2 u, uint sides, float transparency) {
    vec3 q = sampling_sphere(u);
    SurfacePoint at = solid_point(s, q, q);
    vec3 side = at.ng;
    float share = 1.0;
#if HAS_EMISSION_BOTH
    if (sides == 2u) {
        side = p - at.p;
        vec3 f = solid_rows(s, p - s.center);
        if (dot(side, at.ng) < 0.0 && dot(f, f) > 1.0) share = transparency;
    }
#endif
    vec3 to = shapes_leave(at, side) - p;
    float t = length(to);
    vec3 wi = t > 0.0 ? to / t : at.ng;
    return LightSample(wi, t, vec3(share), ellipsoid_light_pdf(s, t, at, wi, sides), true, NONE);
}
#endif

void ellipsoid_light_sample_case(Light l, vec3 p, vec2 u, Emitter e, inout LightSample s) {
#if HAS_ELLIPSOID_LIGHTS
    if (l.kind == LIGHT_ELLIPSOID) {
        s = ellipsoid_light_sample(ellipsoid_pick(l.index), p, u, e.sides, e.transparency);
        s.id = (SHAPE_ELLIPSOID << LEAF_KIND_SHIFT) | l.index;
    }
#endif
}

void ellipsoid_light_pdf_case(Hit hit, SurfacePoint at, vec3 wi, Emitter e, inout float pdf) {
#if HAS_ELLIPSOID_LIGHTS
    if (hit.id >> LEAF_KIND_SHIFT == SHAPE_ELLIPSOID) {
        pdf = ellipsoid_light_pdf(ellipsoid_pick(hit.id & LEAF_FIRST_MASK), hit.t, at, wi, e.sides);
    }
#endif
}

#if CAUSTICS
void ellipsoid_light_place_case(Light l, vec2 u, inout LightPlace at) {
#if HAS_ELLIPSOID_LIGHTS
    if (l.kind == LIGHT_ELLIPSOID) {
        Solid s = ellipsoid_pick(l.index);
        vec3 n = sampling_sphere(u);
        at.p = solid_point(s, n, n).p;
        at.id = (SHAPE_ELLIPSOID << LEAF_KIND_SHIFT) | l.index;
        at.pdf_area = ellipsoid_light_density(s, n);
    }
#endif
}
#endif

#if HAS_TEXTURED_LIGHTS
void ellipsoid_light_near_case(LightSample s, vec3 p, inout float near) {
#if HAS_ELLIPSOID_LIGHTS
    if (s.id >> LEAF_KIND_SHIFT == SHAPE_ELLIPSOID) {
        Solid ball = ellipsoid_pick(s.id & LEAF_FIRST_MASK);
        vec3 f = solid_rows(ball, ball.center - p), g = solid_rows(ball, s.wi);
        near = 2.0 * dot(f, g) / dot(g, g) - s.t;
    }
#endif
}
#endif
