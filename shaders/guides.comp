// Entry: albedo, normal, depth and incidence of the first hit, over the camera rays of the picture's first samples, and
// the shape and the material that the first of these rays hits.
#include "layout.glsl"
layout(local_size_x = WORK_GROUP, local_size_y = WORK_GROUP) in;
layout(std430, binding = SLOT_ALBEDO) buffer albedo_buffer { vec4 albedos[]; }; // a: the number of hits
layout(std430, binding = SLOT_NORMAL) buffer normal_buffer { vec4 normals[]; }; // a: sum of distances
// x and y: index + 1 of the shape and of the material, 0: none; z: the sum of angles of incidence, degrees, as a float.
layout(std430, binding = SLOT_FIRST_HITS) buffer hit_buffer { uvec4 hits[]; };
#include "math/constants.glsl"
#include "math/sobol.glsl"
#include "math/sampling.glsl"
#include "math/fresnel.glsl"
#include "shapes/shapes.glsl"
#include "material/texture.glsl"
#include "material/height.glsl"
#include "camera/camera.glsl"
#include "shapes/transparency.glsl"
#include "path/cone.glsl"

void main() {
    uvec2 pixel;
    uint slot;
    if (!camera_pixel(pixel, slot)) return;
    vec4 albedo = albedos[slot], normal = normals[slot];
    float incidence = uintBitsToFloat(hits[slot].z);
    uint i = 0u;
    do {
        Sampler rng = sobol_begin(pixel, uniforms.sample_first + i, 0u);
        vec3 o, d;
        camera_ray(pixel, rng, o, d);
        SurfacePoint at;
        budget_begin();
        Hit hit = transparency_nearest(o, d, NONE, 0u, rng, at);
        if (!budget_lasts()) hit.id = NONE;
        if (uniforms.sample_first + i == 0u) {
            uint shape = (at.shape & ~SHAPE_BITS) + 1u;
            hits[slot].xy = hit.id != NONE ? uvec2(shape, at.material + 1u) : uvec2(0u);
        }
        if (hit.id != NONE) {
#if HAS_TEXTURES
            vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)];
            texture_look(at, cone_footprint(cone_after(cone_begin(d), hit.t), at, d), texels);
            Material m = material_at(at, texels);
#if HAS_HEIGHTS
            height_normal(at, at.ns);
#endif
#if HAS_NORMAL_MAPS
            float lost;
            texture_normal(at, texels, at.ns, lost);
#endif
#else
            Material m = material_load(at.material);
#endif
            vec3 seen = m.base_color;
#if HAS_CONDUCTOR
            if (m.conductor_eta.x > 0.0) seen = mix(seen, fresnel_conductor(m.conductor_eta, m.conductor_k, 1.0), m.metallic);
#endif
#if HAS_TRANSMISSION
            if (model_transmits(m.model)) seen = mix(seen, vec3(1.0), m.transmission * (1.0 - m.metallic));
#endif
            albedo += vec4(seen, 1.0);
            vec3 n = dot(at.ng, d) > 0.0 ? -at.ns : at.ns;
            normal += vec4(n, hit.t);
            incidence += degrees(atan(length(cross(d, n)), -dot(d, n)));
        }
    } while (++i < uniforms.sample_count);
    albedos[slot] = albedo;
    normals[slot] = normal;
    hits[slot].z = floatBitsToUint(incidence);
}
