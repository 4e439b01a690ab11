// Predicates over a material's numbers, before it is a surface. gpu/kernels/flag_table.py has the same over arrays.

// Whether its surfaces are walls without an inside.
bool material_is_thin(Material m) {
#if HAS_THIN_WALLS
    return m.thin_walled > 0.0;
#else
    return false;
#endif
}

// Its refractive index.
float material_index(Material m) {
    float f = sqrt(0.08 * m.specular);
    return m.ior >= 1.0 ? m.ior : (1.0 + f) / (1.0 - f);
}

// Whether light passes through its surfaces.
bool material_transmits(Material m) {
#if HAS_THIN_WALLS
    bool through = m.transmission > 0.0 || (material_is_thin(m) && m.diffuse_transmission > 0.0);
    return model_transmits(m.model) && through && m.metallic < 1.0;
#elif HAS_TRANSMISSION
    return model_transmits(m.model) && m.transmission > 0.0 && m.metallic < 1.0;
#else
    return false;
#endif
}

// Whether light walks under its surfaces.
bool material_walks(Material m) {
#if HAS_WALKS
    bool deep = max_component(m.subsurface_radius) > 0.0 && !material_is_thin(m);
    return model_walks(m.model) && m.subsurface > 0.0 && deep && m.metallic < 1.0;
#else
    return false;
#endif
}

// Whether light may go straight through its surfaces (path/straight.glsl decides at each point): they are walls or have
// the index 1. Not where a texture gives what decides on that, as a path reads it over its footprint and a ray to a light
// at a point, nor where the surface shines, as a light's sample is the nearest place of a lamp.
bool material_goes_straight(Material m) {
#if HAS_STRAIGHT
    bool matched = m.specular <= 0.0 || abs(m.ior - 1.0) < 1e-4, thin = material_is_thin(m);
    bool given = all(notEqual(vec4(m.roughness, m.ior, m.specular, m.coat_ior), vec4(TEXTURED)))
              && all(notEqual(vec2(m.clearcoat, m.clearcoat_roughness), vec2(TEXTURED)));
    return material_transmits(m) && given && (thin || (matched && m.dispersion <= 0.0))
        && (matched || m.roughness < LEAST_ROUGHNESS) && max_component(m.emission) <= 0.0;
#else
    return false;
#endif
}

// Whether it only mirrors or refracts.
bool material_is_delta(Material m) {
    bool whole = m.metallic >= 1.0;
#if HAS_TRANSMISSION
    whole = whole || m.transmission >= 1.0;
#endif
    return whole && model_may_be_delta(m.model) && m.roughness < LEAST_ROUGHNESS && m.clearcoat <= 0.0
        && m.sheen <= 0.0;
}
