// The event that a path's ray ends with. path_event (path/path_trace.glsl) finds it. All other code asks for it, by the
// functions below where kernels may be without such an event: they are constant there.
const uint EVENT_NONE = 0u;     // nothing: the path had ended before, or ends here, under a surface
const uint EVENT_ESCAPE = 1u;   // nothing: the path leaves the scene
const uint EVENT_SURFACE = 2u;  // a surface, whose BSDF scatters
const uint EVENT_PARTICLE = 3u; // a particle of a medium, by its phase function
const uint EVENT_PASSAGE = 4u;  // a surface that is not there for the path, which goes straight on
const uint EVENT_EXIT = 5u;     // the surface under which the path has walked, from below: light comes out evenly

bool event_is_particle(uint event) {
#if HAS_SCATTERING
    return event == EVENT_PARTICLE;
#else
    return false;
#endif
}

bool event_is_passage(uint event) {
#if HAS_PRIORITIES || HAS_WALKS
    return event == EVENT_PASSAGE;
#else
    return false;
#endif
}

bool event_is_exit(uint event) {
#if HAS_WALKS
    return event == EVENT_EXIT;
#else
    return false;
#endif
}
