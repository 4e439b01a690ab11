// Coordinates by the shape's own space, for textures on what has none: the side of a box that the surface faces, or a
// ball around the middle.
#if HAS_SOLID_TEXTURES || HAS_PROJECTIONS
ShapeSpace space_of(SurfacePoint at) {
    return shape_space_load(at.shape & ~SHAPE_BITS);
}

vec3 space_place(ShapeSpace own, vec3 p) {
    return vec3(dot(own.row_x, p), dot(own.row_y, p), dot(own.row_z, p)) + vec3(own.move_x, own.move_y, own.move_z);
}
#endif

#if HAS_PROJECTIONS
// Coordinates of a point, and their gradients in the world.
struct Projection {
    vec2 uv;
    vec3 grow_u;
    vec3 grow_v;
};

// By how much a later axis must exceed an earlier one: on facets that lie between two sides roundings do not decide.
const float PROJECTION_TIE = 1.0001;

// The outward geometric normal in the shape's own space, of any length.
vec3 projection_normal(ShapeSpace own, vec3 ng) {
    vec3 x = cross(own.row_y, own.row_z), y = cross(own.row_z, own.row_x), z = cross(own.row_x, own.row_y);
    return vec3(dot(x, ng), dot(y, ng), dot(z, ng)) * (dot(own.row_x, x) < 0.0 ? -1.0 : 1.0);
}

// The directions of u and v on the side of the box that a normal points out of: as a box has them, seen from outside u
// to the right and v up with +y; on the top u along +x and v along -z, on the bottom u along +x and v along +z.
void projection_side(vec3 n, out vec3 u, out vec3 v) {
    vec3 a = abs(n);
    bool along_x = a.x * PROJECTION_TIE >= max(a.y, a.z), along_y = a.y * PROJECTION_TIE >= a.z;
    vec3 s = mix(vec3(1.0), vec3(-1.0), lessThan(n, vec3(0.0)));
    u = along_x ? vec3(0.0, 0.0, -s.x) : along_y ? vec3(1.0, 0.0, 0.0) : vec3(s.z, 0.0, 0.0);
    v = !along_x && along_y ? vec3(0.0, 0.0, -s.y) : vec3(0.0, 1.0, 0.0);
}

Projection projection_make(TextureSlot s, SurfacePoint at) {
    ShapeSpace own = space_of(at);
    vec3 q = space_place(own, at.p), u, v;
    projection_side(projection_normal(own, at.ng), u, v);
    vec2 uv = vec2(dot(q, u), dot(q, v));
    float far2 = max(dot(q, q), 1e-30), side2 = max(dot(q.xz, q.xz), 1e-12 * far2); // at a pole u has no direction
    if ((s.flags & TEXTURE_SLOT_ROUND) != 0u) {
        uv = sphere_uv(q * inversesqrt(far2));
        u = vec3(q.z, 0.0, -q.x) * (0.5 * INV_PI / side2);
        v = (vec3(0.0, 1.0, 0.0) - (q.y / far2) * q) * (INV_PI * inversesqrt(side2));
    }
    return Projection(uv, u.x * own.row_x + u.y * own.row_y + u.z * own.row_z,
                      v.x * own.row_x + v.y * own.row_y + v.z * own.row_z);
}

// How a point of the plane across n moves with both; 0 where they do not span it.
mat2x3 projection_chart(Projection by, vec3 n) {
    float area = dot(n, cross(by.grow_u, by.grow_v));
    return area != 0.0 ? mat2x3(cross(by.grow_v, n), cross(n, by.grow_u)) / area : mat2x3(0.0);
}
#endif
