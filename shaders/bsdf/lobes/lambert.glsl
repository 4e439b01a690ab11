// Lambertian reflection, by itself and as a part of several models. bsdf/bsdf.glsl has checked that wo.z and wi.z are
// positive.
vec3 lambert_eval(Surface s) { return s.base_color * INV_PI; }
vec3 lambert_sample(vec2 u) { return sampling_cosine(u); }
float lambert_pdf(vec3 wi) { return wi.z * INV_PI; }
