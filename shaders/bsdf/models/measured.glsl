// The model `measured`: reflection by the tables of a MERL or an RGL file (gpu/layout/measured_records.py), drawn by a
// density that goes with it. A share of directions is drawn by the cosine alone, so that light is found where a
// density is 0 between its nodes and reflection is not.
#include "bsdf/lobes/lambert.glsl"
#include "bsdf/lobes/measured/angles.glsl"
#include "bsdf/lobes/measured/warp.glsl"
#include "bsdf/lobes/measured/half_difference.glsl"
#include "bsdf/lobes/measured/adaptive.glsl"

#if HAS_MEASURED
const float MEASURED_COSINE = 0.1; // that share

void measured_surface(Material m, vec2 tangent, inout Surface s) {
    s.measured = measured_load(m.number);
    s.tangent = tangent;
}

// What the viewer's direction decides.
struct MeasuredView {
    vec3 wo;
    vec2 flip;     // into the part of the circle that was measured
    float azimuth; // from which those of facets count
    MeasuredSlices slices;
};

MeasuredView measured_view(Surface s, vec3 wo) {
    MeasuredView view;
    view.flip = vec2(1.0);
    view.wo = wo;
#if HAS_ANISOTROPIC
    view.wo = bsdf_turn(s, wo);
    if (s.measured.symmetry > 1u) {
        view.flip.y = view.wo.y > 0.0 ? -1.0 : 1.0;
        view.flip.x = s.measured.symmetry == 4u ? (view.wo.x > 0.0 ? -1.0 : 1.0) : view.flip.y;
        view.wo.xy *= view.flip;
    }
#endif
    float azimuth = atan(view.wo.y, view.wo.x);
    if (s.measured.symmetry > 1u) azimuth = -abs(azimuth); // y is not above 0; of 0 the angle may be pi
    view.azimuth = s.measured.phis > 1u ? 0.0 : azimuth;
    view.slices = measured_slices(s.measured, view.wo, azimuth);
    return view;
}

vec3 measured_into(Surface s, MeasuredView view, vec3 w) {
#if HAS_ANISOTROPIC
    w = bsdf_turn(s, w);
    w.xy *= view.flip;
#endif
    return w;
}

vec3 measured_back(Surface s, MeasuredView view, vec3 w) {
#if HAS_ANISOTROPIC
    w.xy *= view.flip;
    w = bsdf_turn_back(s, w);
#endif
    return w;
}

Scatter measured_eval(Surface s, vec3 wo, vec3 wi) {
    Measured m = s.measured;
    MeasuredView view = measured_view(s, wo);
    vec3 there = measured_into(s, view, wi), sum = view.wo + there;
    float cos_d = 0.5 * length(sum);
    vec3 wm = sum / (2.0 * cos_d);
    vec2 at = measured_square(wm, view.azimuth);
    MeasuredWarp sampling = measured_warp(m.sampling, m.sampling_size);
    vec3 f = vec3(0.0);
    float density = 0.0;
#if HAS_MEASURED_ANGLES
    if (m.kind == MEASURED_HALF_DIFFERENCE) {
        f = half_difference_eval(m, view.wo, there);
        density = measured_density(sampling, view.slices, at);
    }
#endif
#if HAS_MEASURED_ADAPTIVE
    if (m.kind == MEASURED_ADAPTIVE) {
        vec2 drawn = measured_undraw(measured_warp(m.visible, m.visible_size), view.slices, at, density);
        f = adaptive_value(m, view.slices, view.wo, at, drawn) / there.z;
        density *= measured_density(sampling, view.slices, drawn);
    }
#endif
#if HAS_MEASURED_LIMITS
    f *= measured_limit(m, view.wo) * measured_limit(m, there);
#endif
    return Scatter(f, mix(density / measured_area(at, wm, cos_d), lambert_pdf(wi), MEASURED_COSINE));
}

LobeSample measured_sample(Surface s, vec3 wo, float u_lobe, vec2 u) {
    Measured m = s.measured;
    MeasuredView view = measured_view(s, wo);
    float density;
    vec2 at = measured_draw(measured_warp(m.sampling, m.sampling_size), view.slices, u, density);
#if HAS_MEASURED_ADAPTIVE
    if (m.kind == MEASURED_ADAPTIVE) {
        at = measured_draw(measured_warp(m.visible, m.visible_size), view.slices, at, density);
    }
#endif
    vec3 wm = measured_normal(at, view.azimuth);
    vec3 mirrored = measured_back(s, view, 2.0 * dot(view.wo, wm) * wm - view.wo);
    return bsdf_rough_sample(u_lobe < MEASURED_COSINE ? lambert_sample(u) : mirrored);
}
#endif
