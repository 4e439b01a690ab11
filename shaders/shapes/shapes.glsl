// The nearest hit, and whether there is any. Where a kind has few shapes, they are tested in a loop of constant length,
// which compilers unroll: a shape's numbers are then loaded once for all lanes, in a tenth of the time that llvmpipe
// takes for a load by a varying index. Kinds with many shapes are in the tree, except for their few largest shapes,
// which would be in every ray's way there.
struct SurfacePoint {
    vec3 p;
    vec3 error;   // bound on p's distance from the surface, per axis
    vec3 ng;      // geometric normal, unit, outward
    vec3 ns;      // shading normal, unit, outward
    vec3 tangent; // any length
    uint material;
    uint light;   // the index of the light that it belongs to, or NONE
    uint flat_id; // the shape's id, if a ray that leaves the shape cannot meet it again; else NONE
    uint shape;   // its index in the scene document, with the bits SINGLE_SIDED and HIDDEN
#if HAS_SMOOTH_NORMALS
    vec3 lift;    // from the triangle to the smooth surface above it, on the outer side (path/terminator.glsl)
    vec3 sink;    // likewise on the inner side
#endif
#if HAS_TEXTURES || HAS_ANISOTROPIC
    float handed; // -1 where v grows against cross(ns, tangent)
#endif
#if HAS_TEXTURES
    vec2 uv;      // texture coordinates, v up
    vec2 uv_1;    // the second set of a mesh
    vec4 color;   // the vertex colour of a mesh
#endif
#if HAS_HEIGHTS
    mat2x3 chart; // dp/du and dp/dv; 0: the surface has no such coordinates
    mat2x3 chart_1;
#endif
#if ANY_FOOTPRINTS
    vec3 grow_u;  // how fast u grows over the surface, 1/m: its gradient
    vec3 grow_v;
    float bend;   // its curvature, 1/m, positive where it is a ball's from outside
#if HAS_UVS_1
    vec3 grow_u_1;
    vec3 grow_v_1;
#endif
#endif
};

// What holds where a shape's own function does not say otherwise.
void shapes_plain(inout SurfacePoint r) {
#if HAS_SMOOTH_NORMALS
    r.lift = r.sink = vec3(0.0);
#endif
#if ANY_FOOTPRINTS
    r.grow_u = r.grow_v = vec3(0.0);
    r.bend = 0.0;
#if HAS_UVS_1
    r.grow_u_1 = r.grow_v_1 = vec3(0.0);
#endif
#endif
}

#include "math/basis.glsl"
#include "material/material.glsl"
#include "shapes/sphere.glsl"
#include "shapes/disk.glsl"
#include "shapes/quad.glsl"
#include "shapes/solid.glsl"
#include "shapes/cylinder.glsl"
#include "shapes/box.glsl"
#include "shapes/instance.glsl"
#include "shapes/triangle.glsl"
#include "shapes/traverse.glsl"

void shapes_take(uint kind, uint index, float t, vec2 uv, uvec2 skip, inout Hit hit) {
    uint id = (kind << LEAF_KIND_SHIFT) | index;
    if (t < hit.t && id != skip.x && id != skip.y) hit = Hit(t, id, uv);
}

// The nearest hit with the shapes that stand in loops.
void shapes_loops(vec3 o, vec3 d, Shear shear, uvec2 skip, inout Hit hit) {
#if HAS_SPHERES
    for (uint i = 0u; i < uint(SPHERE_LOOP); i++) {
        shapes_take(SHAPE_SPHERE, i, sphere_hit(sphere_load(i), o, d, hit.t), hit.uv, skip, hit);
    }
#endif
#if HAS_QUADS
    for (uint i = 0u; i < uint(QUAD_LOOP); i++) {
        shapes_take(SHAPE_QUAD, i, quad_hit(quad_load(i), o, d, hit.t), hit.uv, skip, hit);
    }
#endif
#if HAS_BOXES
    for (uint i = 0u; i < uint(BOX_LOOP); i++) {
        shapes_take(SHAPE_BOX, i, box_hit(box_load(i), o, d, hit.t), hit.uv, skip, hit);
    }
#endif
#if HAS_ELLIPSOIDS
    for (uint i = 0u; i < uint(ELLIPSOID_LOOP); i++) {
        shapes_take(SHAPE_ELLIPSOID, i, ellipsoid_hit(ellipsoid_load(i), o, d, hit.t), hit.uv, skip, hit);
    }
#endif
#if HAS_TRIANGLES
    for (uint i = 0u; i < uint(TRIANGLE_LOOP); i++) {
        vec2 uv = hit.uv;
        float t = triangle_hit(triangle_load(i), shear, d, hit.t, uv);
        shapes_take(SHAPE_TRIANGLE, i, t, uv, skip, hit);
    }
#endif
}

void shapes_intersect(vec3 o, vec3 d, uvec2 skip, bool any, inout Hit hit) {
#if !HAS_BVH
    budget_left--; // a tree counts what its rays come to
#endif
    Shear shear = triangle_shear(o, d);
    shapes_loops(o, d, shear, skip, hit);
#if HAS_BVH
    // The loops may have found something that hides the lamp.
    if (!any || hit.id == NONE) traverse_scene(o, d, shear, skip, any, hit);
#endif
}

// The nearest hit along o + t d, t in (0, infinity); hit.id is NONE where nothing is hit. `skip` is the flat_id of the
// shape that the ray leaves.
Hit shapes_nearest(vec3 o, vec3 d, uint skip) {
    Hit hit = Hit(INFINITY_T, NONE, vec2(0.0));
    shapes_intersect(o, d, uvec2(skip, NONE), false, hit);
    return hit;
}

// Whether anything stands in (0, t_max). `skip` is the flat_id of the shape that the ray leaves and the id of the lamp
// that it goes to. A lamp is convex, and the place was picked where it is seen, so that a lamp never hides it; but near
// a sphere's rim the distance is only as good as the square root of a rounding.
bool shapes_occluded(vec3 o, vec3 d, float t_max, uvec2 skip) {
    Hit hit = Hit(t_max, NONE, vec2(0.0));
    shapes_intersect(o, d, skip, true, hit);
    return hit.id != NONE;
}

// The point of a ray that hits nothing.
SurfacePoint shapes_none(vec3 p, vec3 n) {
    SurfacePoint r;
    r.p = p;
    r.error = vec3(0.0);
    r.ng = r.ns = n;
    r.tangent = vec3(1.0, 0.0, 0.0);
    r.material = r.shape = 0u;
    r.light = r.flat_id = NONE;
#if HAS_TEXTURES || HAS_ANISOTROPIC
    r.handed = 1.0;
#endif
#if HAS_TEXTURES
    r.uv = r.uv_1 = vec2(0.0);
    r.color = vec4(1.0);
#endif
#if HAS_HEIGHTS
    r.chart = r.chart_1 = mat2x3(0.0);
#endif
    shapes_plain(r);
    return r;
}

// The point of a hit, unless it is one with a triangle.
SurfacePoint shapes_analytic_point(Hit hit, vec3 o, vec3 d) {
    uint kind = hit.id >> LEAF_KIND_SHIFT, index = hit.id & LEAF_FIRST_MASK;
    vec3 p = o + hit.t * d;
    SurfacePoint r = shapes_none(p, -d);
    // Each kind is read behind a branch, as the index may be outside of another kind's range.
#if HAS_SPHERES || HAS_BVH_SPHERES
    if (kind == SHAPE_SPHERE) r = sphere_point(sphere_pick(index), p);
#endif
#if HAS_QUADS || HAS_BVH_QUADS
    if (kind == SHAPE_QUAD) r = quad_point(quad_pick(index), p, hit.id);
#endif
#if HAS_BOXES || HAS_BVH_BOXES
    if (kind == SHAPE_BOX) r = box_point(box_pick(index), p);
#endif
#if HAS_ELLIPSOIDS || HAS_BVH_ELLIPSOIDS
    if (kind == SHAPE_ELLIPSOID) r = ellipsoid_point(ellipsoid_pick(index), p);
#endif
    return r;
}

SurfacePoint shapes_point(Hit hit, vec3 o, vec3 d) {
    uint kind = hit.id >> LEAF_KIND_SHIFT, index = hit.id & LEAF_FIRST_MASK;
    SurfacePoint r = shapes_analytic_point(hit, o, d);
#if HAS_INSTANCES
    // Ids of triangles in instances are negative and below NONE. Written as `hit.id != NONE && ...` this goes wrong: a
    // driver (Mesa 22.3) takes hit.id for NONE in lanes that have left the loop of shapes/transparency.glsl.
    bool within = int(hit.id) < -1;
    if (within || kind == SHAPE_TRIANGLE) {
        Instance it = instance_none();
        if (within) {
            it = instance_load(instance_number(hit.id));
            index = it.first + instance_triangle(hit.id);
        }
        r = triangle_point(triangle_pick(index), hit.uv, index, hit.id, it);
        if (within) {
            r.material = it.material;
            r.shape = it.shape;
        }
    }
#elif HAS_TRIANGLES || HAS_BVH_TRIANGLES
    if (kind == SHAPE_TRIANGLE) r = triangle_point(triangle_pick(index), hit.uv, index, hit.id);
#endif
    return r;
}

// The material of the shape that was hit.
uint shapes_material(Hit hit) {
    uint kind = hit.id >> LEAF_KIND_SHIFT, index = hit.id & LEAF_FIRST_MASK, material = 0u;
#if HAS_SPHERES || HAS_BVH_SPHERES
    if (kind == SHAPE_SPHERE) material = sphere_pick(index).material;
#endif
#if HAS_QUADS || HAS_BVH_QUADS
    if (kind == SHAPE_QUAD) material = quad_pick(index).material;
#endif
#if HAS_BOXES || HAS_BVH_BOXES
    if (kind == SHAPE_BOX) material = box_pick(index).material;
#endif
#if HAS_ELLIPSOIDS || HAS_BVH_ELLIPSOIDS
    if (kind == SHAPE_ELLIPSOID) material = ellipsoid_pick(index).material;
#endif
#if HAS_TRIANGLES || HAS_BVH_TRIANGLES
    if (kind == SHAPE_TRIANGLE) material = triangle_pick(index).material;
#endif
#if HAS_INSTANCES
    if (int(hit.id) < -1) material = instance_load(instance_number(hit.id)).material; // as in shapes_point
#endif
    return material;
}

#if HAS_OPACITY
// The point of a hit as far as its opacity depends on it; of a triangle that is much less than the whole point.
SurfacePoint shapes_veil(Hit hit, vec3 o, vec3 d) {
    uint kind = hit.id >> LEAF_KIND_SHIFT, index = hit.id & LEAF_FIRST_MASK;
    SurfacePoint r = shapes_analytic_point(hit, o, d);
#if HAS_TRIANGLES || HAS_BVH_TRIANGLES || HAS_INSTANCES
    bool within = false;
#if HAS_INSTANCES
    within = int(hit.id) < -1;
    if (within) {
        Instance it = instance_load(instance_number(hit.id));
        index = it.first + instance_triangle(hit.id);
        r.material = it.material;
        r.shape = it.shape;
    }
#endif
    if (within || kind == SHAPE_TRIANGLE) {
        Triangle tri = triangle_pick(index);
        if (!within) {
            r.material = tri.material;
            r.shape = tri.shape;
        }
#if HAS_PROJECTIONS
        r.ng = normalize(cross(tri.v1 - tri.v0, tri.v2 - tri.v0));
#if HAS_INSTANCES
        if (within) r.ng = instance_normal(instance_load(instance_number(hit.id)), r.ng);
#endif
#endif
#if HAS_TEXTURES
        triangle_detail(index, vec3(1.0 - hit.uv.x - hit.uv.y, hit.uv), r);
#endif
    }
#endif
    return r;
}
#endif

// The next float above x, or below.
float shapes_next(float x, bool up) {
    if (x == 0.0) return up ? 1.4e-45 : -1.4e-45;
    int i = floatBitsToInt(x);
    return intBitsToFloat((x > 0.0) == up ? i + 1 : i - 1);
}

// The origin of a ray that leaves the point towards w: beyond the point's error along the geometric normal, rounded
// away from the surface [Pharr, Jakob, Humphreys 2023, section 6.8].
vec3 shapes_leave(SurfacePoint s, vec3 w) {
    float d = dot(abs(s.ng), s.error);
    vec3 by = dot(w, s.ng) < 0.0 ? -d * s.ng : d * s.ng;
    vec3 o = s.p + by;
    o.x = by.x == 0.0 ? o.x : shapes_next(o.x, by.x > 0.0);
    o.y = by.y == 0.0 ? o.y : shapes_next(o.y, by.y > 0.0);
    o.z = by.z == 0.0 ? o.z : shapes_next(o.z, by.z > 0.0);
    return o;
}
