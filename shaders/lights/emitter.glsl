// What a shape that shines sends out, as far as its material decides that.
struct Emitter {
    vec3 radiance;
    uint sides;         // 1: the outward side shines; 2: both do
    float transparency; // the chance that a ray passes through the surface
};

vec3 emitter_radiance(Material m) {
#if HAS_TEXTURED_LIGHTS
    return vec3(1.0); // the place that is sampled decides: see emitter_texture
#elif HAS_OPACITY
    return m.emission * m.opacity;
#else
    return m.emission;
#endif
}

uint emitter_sides(Material m) {
#if HAS_EMISSION_BOTH
    return m.emission_sides;
#else
    return 1u;
#endif
}

float emitter_transparency(Material m) {
#if HAS_OPACITY && HAS_TEXTURED_LIGHTS
    return m.opacity < 1.0 ? 1.0 : 0.0; // the place that the ray passes decides: see emitter_texture
#elif HAS_OPACITY
    return 1.0 - m.opacity;
#else
    return 0.0;
#endif
}

Emitter emitter_make(Light l) {
#if HAS_EMISSION
    Material m = material_pick(l.material);
    return Emitter(emitter_radiance(m), emitter_sides(m), emitter_transparency(m));
#else
    return Emitter(vec3(0.0), 1u, 0.0);
#endif
}

#if HAS_LAYERED_LIGHTS
vec3 light_layers(SurfacePoint at, vec3 w); // path/light_layers.glsl
#endif

#if HAS_TEXTURED_LIGHTS || HAS_LAYERED_LIGHTS
// The barycentric weights of the place q on the shape `id`, if it is a triangle.
vec2 emitter_uv(uint id, vec3 q) {
    vec2 uv = vec2(0.0);
#if HAS_TRIANGLE_LIGHTS
    if (id >> LEAF_KIND_SHIFT == SHAPE_TRIANGLE) {
        Triangle tri = triangle_pick(id & LEAF_FIRST_MASK);
        vec3 e1 = tri.v1 - tri.v0, e2 = tri.v2 - tri.v0, w = q - tri.v0, c = cross(e1, e2);
        uv = vec2(dot(cross(w, e2), c), dot(cross(e1, w), c)) / dot(c, c);
    }
#endif
    return uv;
}
#endif

#if HAS_TEXTURED_LIGHTS
float lights_near(LightSample s, vec3 p); // lights.glsl

// The share of the light that arrives from the sampled place: the inside of a far half is seen through the near half, as
// far as that is transparent.
float emitter_share(LightSample s, vec3 p, Hit hit, SurfacePoint at) {
    float share = 1.0;
#if HAS_OPACITY && HAS_EMISSION_BOTH
    float near = lights_near(s, p);
    SurfacePoint through = shapes_point(hit, p + near * s.wi, vec3(0.0, 0.0, 1.0));
    if (near > 0.0 && dot(s.wi, at.ng) > 0.0) share = 1.0 - texture_opacity(through);
#endif
#if HAS_OPACITY
    share *= texture_opacity(at);
#endif
    return share;
}

// The emission of the place that was sampled, times the opacity there.
vec3 emitter_texture(LightSample s, vec3 p) {
    vec3 q = p + s.t * s.wi;
    Hit hit = Hit(0.0, s.id, emitter_uv(s.id, q));
    SurfacePoint at = shapes_point(hit, q, vec3(0.0, 0.0, 1.0));
    return texture_emission(at, footprint_none()) * emitter_share(s, p, hit, at);
}
#endif

// Gives the sample s of a shape its radiance.
void emitter_shine(Light l, Emitter e, vec3 p, inout LightSample s) {
#if HAS_EMISSION
    if (l.kind >= LIGHT_SPHERE) s.radiance *= e.radiance;
#endif
#if HAS_TEXTURED_LIGHTS
    if (l.kind >= LIGHT_SPHERE && s.pdf > 0.0) s.radiance *= emitter_texture(s, p);
#endif
#if HAS_LAYERED_LIGHTS
    if (l.kind >= LIGHT_SPHERE && s.pdf > 0.0) {
        vec3 q = p + s.t * s.wi;
        s.radiance *= light_layers(shapes_point(Hit(0.0, s.id, emitter_uv(s.id, q)), q, vec3(0.0, 0.0, 1.0)), -s.wi);
    }
#endif
}
