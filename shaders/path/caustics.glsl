// Caustics: light that reaches the first surface which the camera sees through perfectly specular events alone, where
// that surface scatters it by another event. With CAUSTICS it is traced from the lights (path/light_path.glsl), and the
// camera's paths leave it out: each path of light belongs to one of the two by its events, so that no weights are needed.
// A particle of a medium is no such surface, and an event that is none of a caustic's.
// Light that only goes straight through surfaces (path/straight.glsl) is none: the lights are sampled for it.
// The light of the environment stays with the camera's paths, except for that of the sun in it.

void caustics_begin(inout Path path) {
#if CAUSTICS
    path.caustic = false;
#endif
}

// Notes the event at the surface that the path leaves; path.bounce counts the events before it.
void caustics_note(bool is_delta, inout Path path) {
#if CAUSTICS
    path.caustic = path.bounce == 0u ? !is_delta : path.caustic && is_delta;
    path.caustic = path.caustic && !event_is_particle(path.event);
#endif
}

// Whether the emission that the path's ray finds is traced from the lights.
bool caustics_leave_out(Path path) {
#if CAUSTICS
    return path.caustic && path.bounce > 1u + path.passed;
#else
    return false;
#endif
}
