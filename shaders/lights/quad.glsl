// A parallelogram that shines along its normal, sampled by area.
float quad_light_pdf(Quad q, float t, vec3 ng, vec3 wi) {
    float c = -dot(wi, ng);
    return c > 0.0 ? t * t / (c * q.area) : 0.0;
}

LightSample quad_light_sample(Quad q, vec3 p, vec2 u) {
    Point at;
    at.p = q.origin + u.x * q.u + u.y * q.v;
    at.ng = q.normal;
    at.error = gamma_error(6.0) * (abs(q.origin) + abs(q.u) + abs(q.v));
    vec3 to = shapes_leave(at, q.normal) - p; // it is seen from its front only
    float t = length(to);
    vec3 wi = t > 0.0 ? to / t : q.normal;
    return LightSample(wi, t, vec3(0.0), quad_light_pdf(q, t, q.normal, wi), true, NONE);
}
