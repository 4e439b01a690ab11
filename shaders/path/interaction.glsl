// The point where a path meets a surface, or something else that scatters: its frame, its material and the bodies on both sides.
struct Interaction {
    vec3 wo;       // in the shading frame
    bool behind;   // it is seen from the inner side of the geometry
    vec3 front;    // the geometric normal on the viewer's side
    vec3 fold;     // the normal of the plane about which lobes of bent normals are folded
    vec3 facing;   // the normal that decides on which side of the surface a direction is
    Basis basis;   // the shading frame
    vec2 tangent;  // the direction in it that anisotropy stretches along
    bool mapped;   // a texture bends the normal of the base or of the coat
    vec3 coat;     // the coat's own normal, as the viewer sees it; only with HAS_COAT_NORMALS
    bool transmits;
    Medium beyond; // the medium on the other side
#if HAS_PRIORITIES
    float around;  // the index of what the body lies in
    bool sparser;  // its own index is less than that
#endif
    uint event;    // what the path has met there: path/event.glsl
#if HAS_SCATTERING
    float g;       // mean cosine of what a particle scatters
#endif
};

#include "path/scatter.glsl"

#if ANY_CHAINS
// That of no point, for path/delta_chain.glsl.
Interaction interaction_none() {
    Interaction r;
    r.wo = r.front = r.fold = r.facing = r.coat = vec3(0.0);
    r.behind = r.mapped = r.transmits = false;
    r.basis = Basis(vec3(0.0), vec3(0.0), vec3(0.0));
    r.tangent = vec2(0.0);
    r.beyond = medium_none();
#if HAS_PRIORITIES
    r.around = 1.0;
    r.sparser = false;
#endif
    r.event = EVENT_NONE;
#if HAS_SCATTERING
    r.g = 0.0;
#endif
    return r;
}
#endif

#if HAS_PRIORITIES
// Finds what the body lies in: it is around the outer side of the surface.
void interaction_around(Material m, bool clear, Medium near, inout Interaction here) {
    here.around = 1.0;
    if (clear && here.behind) here.around = bodies_index(here.beyond.bodies);
    if (clear && !here.behind) here.around = bodies_index(near.bodies);
    here.sparser = material_index(m) < here.around;
}
#endif

// The material with its index in what is around it. Where that is denser, the two change places.
Material interaction_material(Interaction here, Material m) {
#if HAS_PRIORITIES
    float index = material_index(m);
    if (here.around != 1.0) m.ior = max(here.sparser ? here.around / index : index / here.around, 1.0);
#endif
    return m;
}

// Whether the surface is seen from its denser side.
bool interaction_dense(Interaction here) {
#if HAS_PRIORITIES
    return here.behind != here.sparser;
#else
    return here.behind;
#endif
}

// Finds the bodies on both sides of the surface.
void interaction_media(Material m, inout Interaction here, inout Path path) {
#if HAS_ATTENUATION
    Medium body = medium_body(m, path.at.shape);
    bool surface = !event_is_particle(path.event) && !event_is_exit(path.event) && !walk_goes_on(path);
    bool clear = surface && here.transmits && !material_is_thin(m);
    if (clear && here.behind && path.medium.depth < 0.5) {
        // This is the back of an open sheet: the path counts as inside a body since it began.
        path.medium = medium_entered(path.medium, body);
        if (path.bounce == 0u) path.throughput = medium_share(path.medium, path.hit.t);
    }
    here.beyond = path.medium;
    if (clear && here.behind) here.beyond = medium_left(path.medium, body);
    if (clear && !here.behind) here.beyond = medium_entered(path.medium, body);
#if HAS_PRIORITIES
    interaction_around(m, clear, path.medium, here);
#endif
#else
    here.beyond = path.medium;
#endif
}

// Finds the direction that anisotropy stretches along.
void interaction_tangent(SurfacePoint at, inout Material m, inout Interaction here) {
    here.tangent = vec2(1.0, 0.0);
#if HAS_ANISOTROPIC
    vec2 along = vec2(dot(at.tangent, here.basis.x), dot(at.tangent, here.basis.y));
    float along2 = dot(along, along);
    if (along2 > 0.0) here.tangent = along * inversesqrt(along2);
    // The angle turns from u towards v on both sides: else the inside of a body would not mirror its outside.
    m.anisotropic_rotation *= here.behind ? -at.handed : at.handed;
#endif
}

// The point that the path has come to, and the material m there.
Interaction interaction_make(inout Path path, out Material m) {
    Interaction here;
    here.event = path.event;
    vec3 wo_w = -path.d;
    here.behind = dot(path.at.ng, wo_w) < 0.0;
    here.front = here.behind ? -path.at.ng : path.at.ng;
    here.mapped = false;
#if HAS_TEXTURES
    vec4 texels[max(TEXTURE_SURFACE_SLOTS, 1)];
    texture_look(path.at, cone_footprint(path.cone, path.at, path.d), texels);
    m = material_at(path.at, texels);
#else
    m = material_pick(path.at.material);
#endif
    filter_glossy_floor(path, m);
    vec3 smooth_w = sides_normal(path.at, wo_w);
#if HAS_HEIGHTS
    here.mapped = height_normal(path.at, path.at.ns); // that of the surface on which coat and base lie
#endif
#if HAS_COAT_NORMALS
    SurfacePoint coat_at = path.at;
    float coat_lost;
    here.mapped = texture_coat_normal(path.at, texels, coat_at.ns, coat_lost) || here.mapped;
    here.coat = sides_normal(coat_at, wo_w);
#endif
#if HAS_NORMAL_MAPS
    float lost;
    here.mapped = texture_normal(path.at, texels, path.at.ns, lost) || here.mapped;
#if HAS_COAT_NORMALS
    surface_roughen(lost, coat_lost, m);
#else
    surface_roughen(lost, lost, m); // the coat has the base's normals
#endif
#endif
    here.basis = basis_make(sides_normal(path.at, wo_w));
    here.wo = basis_to_local(here.basis, wo_w);
    here.transmits = material_transmits(m);
    if (path.event == EVENT_SURFACE) hues_meet(m, path.hues);
    interaction_tangent(path.at, m, here);
    interaction_media(m, here, path);
    here.fold = here.front;
    bool level = here.transmits || medium_around(path.medium) || event_is_particle(path.event);
    bool exits = event_is_exit(path.event); // from below: what follows is seen from outside
    bool lifts = terminator_begin(exits ? path.at.ng : here.front, here.behind && !exits, level, path.at);
    if (lifts) here.fold = smooth_w;
    here.facing = here.mapped ? here.fold : here.basis.z; // a folded lobe reaches all directions in front
    scatter_interaction(path, here);
    return here;
}

// The surface as seen from here.wo, ready for the lobes.
Surface interaction_surface(Interaction here, Material m) {
    Surface s = surface_make(interaction_material(here, m), here.tangent);
#if HAS_COAT_NORMALS
    s.coat = basis_make(basis_to_local(here.basis, here.coat));
#endif
    models_face(here.wo, interaction_dense(here), s);
    scatter_surface(here, s);
    return s;
}

#if HAS_STRAIGHT || HAS_LAYERED_LIGHTS
// The surface at a point that no path has come to, seen along w without normal maps. Of `here` it fills in what lobes ask
// for: wo, behind, basis and tangent, and what decides on the index in `medium`.
Surface interaction_lone(SurfacePoint at, vec3 w, Medium medium, out Interaction here, out Material m) {
    here.behind = dot(at.ng, w) < 0.0;
    here.basis = basis_make(sides_normal(at, w));
    here.wo = basis_to_local(here.basis, w);
    m = material_at(at);
    interaction_tangent(at, m, here);
#if HAS_PRIORITIES
    bool clear = material_transmits(m) && !material_is_thin(m);
    here.beyond = medium_left(medium, medium_body(m, at.shape));
    interaction_around(m, clear, medium, here);
#endif
    Surface s = surface_make(interaction_material(here, m), here.tangent);
#if HAS_COAT_NORMALS
    s.coat = basis_make(vec3(0.0, 0.0, 1.0));
#endif
    return s;
}
#endif

// The medium on the other side of the surface where `crosses`, else that on this side.
Medium interaction_medium(bool crosses, Medium near, Medium beyond) {
    Medium medium = near;
    if (crosses) medium = beyond;
    return medium;
}
