// The shading frame: z is the shading normal, x and y are any tangents [Duff et al. 2017].
struct Basis {
    vec3 x;
    vec3 y;
    vec3 z;
};

Basis basis_make(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return Basis(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

vec3 basis_to_local(Basis b, vec3 w) { return vec3(dot(w, b.x), dot(w, b.y), dot(w, b.z)); }
vec3 basis_to_world(Basis b, vec3 w) { return w.x * b.x + w.y * b.y + w.z * b.z; }

// The unit vector of a place e on the unfolded octahedron, each coordinate -1..1 [Cigolle et al. 2014].
vec3 basis_octahedral(vec2 e) {
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float fold = max(-n.z, 0.0);
    n.xy -= fold * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
    return normalize(n);
}

// v turned by the quaternion q (x, y, z, w).
vec3 basis_rotate(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
