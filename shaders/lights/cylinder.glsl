// The side of a cylinder, seen in a space where its cross-section is the unit circle, its axis y, and where its height is
// to its radius as in the world. There a direction is picked by its angle about the axis, uniformly within the arc that
// the circle fills, and then by the sine of its elevation, uniformly between the ends of the line that it meets: within
// each slice uniformly over the solid angle. From inside the arc is a full turn. Where the inner side shines, too, half
// of the samples go to the far half of it, if that may be seen through an open end or through the near half.

#if HAS_CYLINDER_LIGHTS
struct CylinderView {
    vec3 p;         // the place that sees it, from the middle
    float height;   // half of it, in radii
    float outside;  // |p.xz|^2 - 1
    bool both;      // near and far half each get half of the samples
};

CylinderView cylinder_light_view(Solid s, vec3 p, mat3 axes, uint sides, float transparency) {
    CylinderView w;
    w.p = solid_rows(s, p - s.center);
    w.height = length(axes[1]) * inversesqrt(length(axes[0]) * length(axes[2]));
    w.outside = dot(w.p.xz, w.p.xz) - 1.0;
    w.both = w.outside > 0.0 && sides == 2u && (transparency > 0.0 || abs(w.p.y) > 1.0);
    w.p.y *= w.height;
    return w;
}

float cylinder_light_arc(CylinderView w) {
    return w.outside > 0.0 ? 2.0 * asin(min(inversesqrt(1.0 + w.outside), 1.0)) : TWO_PI;
}

// The way across the axis to the near or the far half, in a direction in which the axis is nearest after `mid` at the
// distance `miss`. The larger root is a sum, and their product is w.outside, so that nothing cancels.
float cylinder_light_way(CylinderView w, float mid, float miss, bool far) {
    float half_chord = sqrt(max(1.0 - miss * miss, 0.0));
    float large = mid + (mid < 0.0 ? -half_chord : half_chord), other = w.outside / large;
    return far ? max(large, other) : min(large, other);
}

// The elevations of a line's lower and upper end, which is `way` from p across the axis: their sines and cosines, and
// the difference of their sines.
struct CylinderRise {
    vec2 sines, cosines;
    float range;
};

CylinderRise cylinder_light_rise(CylinderView w, float way) {
    CylinderRise r;
    vec2 y = vec2(-w.height, w.height) - w.p.y;
    vec2 inv = inversesqrt(way * way + y * y);
    r.sines = y * inv;
    r.cosines = way * inv;
    float c = r.cosines.x * r.cosines.y + r.sines.x * r.sines.y; // of the angle between the ends
    // sin b - sin a = sin(b - a) (cos a + cos b) / (1 + cos(b - a)), which does not cancel where the light is far
    float sine = 2.0 * w.height * way * inv.x * inv.y;
    r.range = c < 0.0 ? r.sines.y - r.sines.x : sine * (r.cosines.x + r.cosines.y) / (1.0 + c);
    return r;
}

// The density of the direction wi to a place whose outward normal is ng.
float cylinder_light_density(Solid s, mat3 axes, CylinderView w, vec3 wi, vec3 ng, uint sides) {
    bool far = dot(wi, ng) > 0.0;
    if (far ? sides != 2u || (w.outside > 0.0 && !w.both) : w.outside <= 0.0) return 0.0;
    vec3 d = solid_rows(s, wi);
    d.y *= w.height;
    float across2 = dot(d.xz, d.xz), length2 = across2 + d.y * d.y;
    if (across2 == 0.0) return 0.0;
    vec2 e = d.xz * inversesqrt(across2);
    float way = cylinder_light_way(w, -dot(w.p.xz, e), w.p.x * e.y - w.p.z * e.x, far);
    float range = cylinder_light_arc(w) * cylinder_light_rise(w, way).range;
    float stretch = w.height / (abs(determinant(axes)) * length2 * sqrt(length2)); // of solid angles, by the space
    return range > 0.0 ? (w.both ? 0.5 : 1.0) * stretch / range : 0.0;
}

float cylinder_light_pdf(Solid s, vec3 p, SurfacePoint at, vec3 wi, uint sides, float transparency) {
    mat3 axes = solid_axes(s);
    return cylinder_light_density(s, axes, cylinder_light_view(s, p, axes, sides, transparency), wi, at.ng, sides);
}

// The density per area of places that are drawn uniformly by turn and height; n is their normal in the cylinder's space.
float cylinder_light_area_density(Solid s, vec3 n) {
    return 1.0 / (4.0 * PI * abs(determinant(solid_axes(s))) * length(solid_gradient(s, n)));
}

LightSample cylinder_light_sample(Solid s, vec3 p, vec2 u, uint sides, float transparency) {
    mat3 axes = solid_axes(s);
    CylinderView w = cylinder_light_view(s, p, axes, sides, transparency);
    bool far = w.outside <= 0.0;
    if (far && sides != 2u) return lights_none();
    if (w.both) {
        far = u.x >= 0.5;
        u.x = far ? 2.0 * u.x - 1.0 : 2.0 * u.x;
    }
    float away = length(w.p.xz), angle = (u.x - 0.5) * cylinder_light_arc(w);
    vec2 back = away > 0.0 ? w.p.xz / away : vec2(1.0, 0.0); // from the axis to p
    // The circle's place is a corner of the triangle whose others are p and the axis.
    float miss = clamp(away * sin(angle), -1.0, 1.0);
    float turn = (far ? PI - asin(miss) : asin(miss)) - angle;
    vec2 place = cos(turn) * back + sin(turn) * vec2(back.y, -back.x);
    float way = cylinder_light_way(w, away * cos(angle), miss, far);
    CylinderRise r = cylinder_light_rise(w, way);
    // 1 - |sine| is a sum of what the nearer end leaves and of the way from there.
    float sine = r.sines.x + u.y * r.range;
    float left = sine > 0.0 ? r.cosines.y * r.cosines.y / (1.0 + r.sines.y) + (1.0 - u.y) * r.range
                            : r.cosines.x * r.cosines.x / (1.0 - r.sines.x) + u.y * r.range;
    float y = w.p.y + way * sine * inversesqrt(max(left * (2.0 - left), 1e-30));
    SurfacePoint at;
    at.ng = normalize(place.x * s.row_x + place.y * s.row_z);
    at.p = s.center + axes * vec3(place.x, clamp(y / w.height, -1.0, 1.0), place.y);
    at.error = solid_error(s, axes);
    vec3 to = shapes_leave(at, far ? -at.ng : at.ng) - p;
    float t = length(to), share = 1.0;
    vec3 wi = t > 0.0 ? to / t : at.ng;
    if (w.both && far && cylinder_near(s, p, wi) > 0.0) share = transparency;
    return LightSample(wi, t, vec3(share), cylinder_light_density(s, axes, w, wi, at.ng, sides), true, NONE);
}
#endif

void cylinder_light_sample_case(Light l, vec3 p, vec2 u, Emitter e, inout LightSample s) {
#if HAS_CYLINDER_LIGHTS
    if (l.kind == LIGHT_CYLINDER) {
        s = cylinder_light_sample(box_pick(l.index), p, u, e.sides, e.transparency);
        s.id = (SHAPE_BOX << LEAF_KIND_SHIFT) | l.index;
    }
#endif
}

void cylinder_light_pdf_case(Hit hit, vec3 p, SurfacePoint at, vec3 wi, Emitter e, inout float pdf) {
#if HAS_CYLINDER_LIGHTS
    if (hit.id >> LEAF_KIND_SHIFT == SHAPE_BOX) {
        pdf = cylinder_light_pdf(box_pick(hit.id & LEAF_FIRST_MASK), p, at, wi, e.sides, e.transparency);
    }
#endif
}

#if CAUSTICS
void cylinder_light_place_case(Light l, vec2 u, inout LightPlace at) {
#if HAS_CYLINDER_LIGHTS
    if (l.kind == LIGHT_CYLINDER) {
        Solid s = box_pick(l.index);
        vec3 n = vec3(cos(TWO_PI * u.x), 0.0, sin(TWO_PI * u.x));
        at.p = solid_point(s, vec3(n.x, 2.0 * u.y - 1.0, n.z), n).p;
        at.id = (SHAPE_BOX << LEAF_KIND_SHIFT) | l.index;
        at.pdf_area = cylinder_light_area_density(s, n);
    }
#endif
}
#endif

#if HAS_TEXTURED_LIGHTS
void cylinder_light_near_case(LightSample s, vec3 p, inout float near) {
#if HAS_CYLINDER_LIGHTS
    if (s.id >> LEAF_KIND_SHIFT == SHAPE_BOX) near = cylinder_near(box_pick(s.id & LEAF_FIRST_MASK), p, s.wi);
#endif
}
#endif
