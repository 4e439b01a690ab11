// The shadow terminator. Where the normals of a mesh are smooth, a direction may lie above the shading normal's plane and
// yet below the triangle's: without more it would be dark, and the edge of the light on a coarse mesh follows its facets.
// Rays in such directions begin higher up, on the planes that the corners' normals suggest [Hanika 2021, "Hacking the
// Shadow Terminator", Ray Tracing Gems II, chapter 4]. We depart from that in leaving all other rays where they are: a
// convex mesh does not reach above the plane of any of its triangles, so that only these need it, and fewer rays can
// begin beyond another surface that is near. Where the normals agree, and on the hollow side, nothing is lifted, nor at
// surfaces that transmit or inside a body, where the side of the surface decides on the medium.

// Keeps what lifts the point on the viewer's side, whose normal is `front`; nothing where that is within its error.
// Returns whether there is anything.
bool terminator_begin(vec3 front, bool behind, bool clear, inout SurfacePoint at) {
#if HAS_SMOOTH_NORMALS
    if (behind) at.lift = at.sink;
    bool lifts = !clear && dot(at.lift, front) > dot(abs(front), at.error);
    if (!lifts) at.lift = vec3(0.0);
    return lifts;
#else
    return false;
#endif
}

// Whether a ray in the direction w begins on the smooth surface.
bool terminator_lifts(SurfacePoint at, vec3 w) {
#if HAS_SMOOTH_NORMALS
    return dot(at.lift, at.ng) * dot(w, at.ng) < 0.0;
#else
    return false;
#endif
}

// Whether a direction is on the same side of the shading normal and of the surface itself, or of the smooth surface.
bool terminator_agrees(SurfacePoint at, vec3 w, float shading, float geometric) {
    return sides_agrees(shading, geometric) || (shading > 0.0 && terminator_lifts(at, w));
}

// The origin of a ray that leaves the surface in the direction w.
vec3 terminator_leave(SurfacePoint at, vec3 w) {
#if HAS_SMOOTH_NORMALS
    if (terminator_lifts(at, w)) {
        at.p += at.lift;
        w = at.lift;
    }
#endif
    return shapes_leave(at, w);
}

// The id of the shape that a ray in the direction w cannot meet. One that is lifted may meet even its own triangle.
uint terminator_skip(SurfacePoint at, vec3 w) {
    uint skip = at.flat_id;
    if (terminator_lifts(at, w)) skip = NONE;
    return skip;
}

// The ray from the point to a light that has been sampled from there.
void terminator_aim(SurfacePoint at, LightSample light, out vec3 o, out vec3 d, out float t) {
    o = terminator_leave(at, light.wi);
    d = light.wi;
    t = light.t;
#if HAS_SMOOTH_NORMALS
    if (terminator_lifts(at, light.wi) && t < INFINITY_T) {
        vec3 to = at.p + t * d - o;
        t = length(to);
        d = to / t;
    }
#endif
}
