// A sphere. From outside it is sampled uniformly over the cone that it fills [Pharr, Jakob, Humphreys 2023, section
// 6.2.4]; from inside, where the inner side shines, too, uniformly over all directions. `transparency` is the chance
// that a ray passes through the surface: the inside of the far half is then seen through the near one, and gets half of
// the samples.

#if HAS_SPHERE_LIGHTS
// 1 - cos of the cone's half angle, which does not cancel for small or far spheres; 2 from inside.
float sphere_light_cap(Sphere s, vec3 p) {
    vec3 to = s.center - p;
    float sin2 = s.radius * s.radius / dot(to, to);
    return sin2 < 1.0 ? sin2 / (1.0 + sqrt(1.0 - sin2)) : 2.0;
}

float sphere_light_density(float cap, uint sides, float transparency) {
    return (sides == 2u && transparency > 0.0 && cap < 2.0 ? 0.5 : 1.0) / (TWO_PI * cap);
}

float sphere_light_pdf(Sphere s, vec3 p, uint sides, float transparency) {
    return sphere_light_density(sphere_light_cap(s, p), sides, transparency);
}

LightSample sphere_light_sample(Sphere s, vec3 p, vec2 u, uint sides, float transparency) {
    float cap = sphere_light_cap(s, p);
    bool inside = cap == 2.0;
    if (inside && sides == 1u) return lights_none();
    vec3 to = s.center - p;
    float d2 = dot(to, to);
    float share = 1.0;
    bool far = inside;
#if HAS_EMISSION_BOTH && HAS_OPACITY
    if (!inside && sides == 2u && transparency > 0.0) {
        far = u.x >= 0.5;
        share = far ? transparency : 1.0;
        u.x = far ? 2.0 * u.x - 1.0 : 2.0 * u.x;
    }
#endif
    float h = u.x * cap; // 1 - cos theta
    float sin2 = h * (2.0 - h), cos_t = 1.0 - h;
    float phi = TWO_PI * u.y, r = sqrt(max(sin2, 0.0));
    Basis b = basis_make(d2 > 0.0 ? to * inversesqrt(d2) : vec3(0.0, 0.0, 1.0));
    vec3 wi = basis_to_world(b, vec3(r * cos(phi), r * sin(phi), cos_t));
    // The ray meets the sphere at a corner of the triangle whose others are p and the centre.
    float reach = sqrt(max(0.0, s.radius * s.radius - d2 * sin2));
    SurfacePoint at;
    at.ng = normalize(wi * (sqrt(d2) * cos_t + (far ? reach : -reach)) - to);
    at.p = s.center + s.radius * at.ng;
    at.error = gamma_error(6.0) * (abs(s.center) + s.radius);
    vec3 target = shapes_leave(at, -wi);
    float pdf = sphere_light_density(cap, sides, transparency);
    return LightSample(wi, max(0.0, dot(target - p, wi)), vec3(share), pdf, true, NONE);
}
#endif

void sphere_light_sample_case(Light l, vec3 p, vec2 u, Emitter e, inout LightSample s) {
#if HAS_SPHERE_LIGHTS
    if (l.kind == LIGHT_SPHERE) {
        s = sphere_light_sample(sphere_pick(l.index), p, u, e.sides, e.transparency);
        s.id = (SHAPE_SPHERE << LEAF_KIND_SHIFT) | l.index;
    }
#endif
}

void sphere_light_pdf_case(Hit hit, vec3 p, Emitter e, inout float pdf) {
#if HAS_SPHERE_LIGHTS
    if (hit.id >> LEAF_KIND_SHIFT == SHAPE_SPHERE) {
        pdf = sphere_light_pdf(sphere_pick(hit.id & LEAF_FIRST_MASK), p, e.sides, e.transparency);
    }
#endif
}

#if CAUSTICS
void sphere_light_place_case(Light l, vec2 u, inout LightPlace at) {
#if HAS_SPHERE_LIGHTS
    if (l.kind == LIGHT_SPHERE) {
        Sphere s = sphere_pick(l.index);
        at.p = s.center + s.radius * sampling_sphere(u);
        at.id = (SHAPE_SPHERE << LEAF_KIND_SHIFT) | l.index;
        at.pdf_area = 1.0 / (4.0 * PI * s.radius * s.radius);
    }
#endif
}
#endif

#if HAS_TEXTURED_LIGHTS
void sphere_light_near_case(LightSample s, vec3 p, inout float near) {
#if HAS_SPHERE_LIGHTS
    if (s.id >> LEAF_KIND_SHIFT == SHAPE_SPHERE) {
        near = 2.0 * dot(sphere_pick(s.id & LEAF_FIRST_MASK).center - p, s.wi) - s.t;
    }
#endif
}
#endif
