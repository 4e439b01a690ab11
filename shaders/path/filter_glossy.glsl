// A bias that a person may choose: after the first event of a path that is not perfectly specular, every surface counts as at
// least this rough. Light that few paths find, by way of mirrors and glass, is then blurred instead of missed.

void filter_glossy_begin(inout Path path) {
#if HAS_FILTER_GLOSSY
    path.spread = false;
#endif
}

// Notes the event at the surface that the path leaves.
void filter_glossy_note(bool is_delta, inout Path path) {
#if HAS_FILTER_GLOSSY
    path.spread = path.spread || !is_delta;
#endif
}

// Roughens the material that the path has come to. Measured reflection stays as it is; so do microfacets, whose parameter
// means something else in each distribution. So do surfaces that light goes straight through: it is sampled there.
void filter_glossy_floor(Path path, inout Material m) {
#if HAS_FILTER_GLOSSY
    float least = uniforms.filter_glossy;
    if (path.spread && !material_goes_straight(material_pick(path.at.material))) {
        m.roughness = max(m.roughness, least);
        if (m.clearcoat_roughness >= 0.0) m.clearcoat_roughness = max(m.clearcoat_roughness, least);
        // The exponent of a lobe as wide as alpha = roughness^2 [Walter et al. 2007, section 5.1].
        m.shininess = min(m.shininess, 2.0 / (least * least * least * least) - 2.0);
    }
#endif
}
