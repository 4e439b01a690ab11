// Surfaces that light goes straight through, by a perfectly specular lobe that bends nothing: smooth panes, with whatever
// lies on them, and boundaries of index 1, soap bubbles among them. Rays to lights pass them (path/shadow.glsl). A path
// that goes straight on there has met nothing, as far as lights are concerned: what it finds afterwards is weighted
// against the lights that were sampled at the surface before, where its direction comes from. Passages count as bounces.

#if HAS_STRAIGHT
// Whether textures may bend the normals of a material.
bool straight_is_mapped(uint material) {
    bool mapped = false;
#if HAS_TEXTURES
#if TEXTURE_NORMAL >= 0
    mapped = mapped || texture_use_pick(material, TEXTURE_NORMAL_USE).channel != TEXTURE_CHANNEL_NONE;
#endif
#if TEXTURE_COAT_NORMAL >= 0
    mapped = mapped || texture_use_pick(material, TEXTURE_COAT_NORMAL_USE).channel != TEXTURE_CHANNEL_NONE;
#endif
#if TEXTURE_HEIGHT >= 0
    mapped = mapped || texture_use_pick(material, TEXTURE_HEIGHT_USE).channel != TEXTURE_CHANNEL_NONE;
#endif
#endif
    return mapped;
}
#endif

// Whether the light that goes through the surface s by a perfectly specular lobe goes straight on. A body of which
// some rays see nothing does not count: whether they are in it would depend on the path.
bool straight_goes(Surface s, SurfacePoint at) {
#if HAS_STRAIGHT
    bool clear = s.index_matched, solid = true;
#if HAS_FILM
    clear = clear && s.film <= 0.0;
#endif
#if HAS_THIN_WALLS
    solid = !s.is_thin;
#endif
#if HAS_OPACITY
    if (solid && transparency_opacity(at, false) < 1.0) clear = s.is_delta = false;
#endif
    return (clear || s.is_delta) && (s.index_matched || !solid) && material_goes_straight(material_pick(at.material))
        && !straight_is_mapped(at.material);
#else
    return false;
#endif
}

#if HAS_STRAIGHT
// The share of light along d that goes straight through the surface, and the medium behind it. It is what a path along d
// finds there: its surface is that of interaction_surface, and bsdf_deltas gives the share.
vec3 straight_share(SurfacePoint at, vec3 d, inout Medium medium) {
    Interaction here;
    Material m;
    Surface s = interaction_lone(at, -d, medium, here, m);
    vec3 share = models_straight(here.wo, interaction_dense(here), s);
#if HAS_ATTENUATION
    if (!material_is_thin(m)) {
        Medium body = medium_body(m, at.shape);
        if (here.behind) medium = medium_left(medium, body);
        else medium = medium_entered(medium, body);
    }
#endif
    return straight_goes(s, at) ? share : vec3(0.0);
}
#endif
