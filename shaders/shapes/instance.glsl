// Instances: triangles with a tree of their own under an affine map. A ray is intersected in their space, where its
// direction is not of unit length, so that t is the same in both spaces; these functions map hits back to the world.
#if HAS_INSTANCES
uint instance_id(uint number, uint triangle) { return INSTANCED | (number << uniforms.instance_shift) | triangle; }

uint instance_number(uint id) { return (id & ~INSTANCED) >> uniforms.instance_shift; }

uint instance_triangle(uint id) { return id & ((1u << uniforms.instance_shift) - 1u); }

// The identity: the scene's own triangles as one instance.
Instance instance_none() {
    Instance r;
    r.row_x = r.axis_x = vec3(1.0, 0.0, 0.0);
    r.row_y = r.axis_y = vec3(0.0, 1.0, 0.0);
    r.row_z = vec3(0.0, 0.0, 1.0);
    r.axis_z_x = r.axis_z_y = 0.0;
    r.axis_z_z = 1.0;
    r.center = r.error = vec3(0.0);
    r.side = 1.0;
    return r;
}

vec3 instance_rows(Instance s, vec3 v) { return vec3(dot(s.row_x, v), dot(s.row_y, v), dot(s.row_z, v)); }

mat3 instance_axes(Instance s) { return mat3(s.axis_x, s.axis_y, vec3(s.axis_z_x, s.axis_z_y, s.axis_z_z)); }

// A normal under the inverse transpose: unit, and outward if n is.
vec3 instance_normal(Instance s, vec3 n) { return normalize(n.x * s.row_x + n.y * s.row_y + n.z * s.row_z); }

// A tangent in the plane of the normal that n is mapped to; unit.
vec3 instance_tangent(Instance s, vec3 n, vec3 tangent) {
    vec3 t = instance_axes(s) * tangent, across = instance_normal(s, n);
    return normalize(t - dot(t, across) * across);
}
#endif
