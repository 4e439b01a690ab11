// LOBE(name, f) stands around each lobe that a model adds up, and is f. Only in the kernel that tabulates values
// (bsdf_values.comp) it lets every lobe, or a single one of them, through; names and numbers are in gpu/layout/models.py.
#if LOBE_CHOICE
uniform uint lobe_shown; // LOBE_EVERY, or the lobe of which alone the values are

vec3 lobe_alone(uint lobe, vec3 f) { return lobe_shown == LOBE_EVERY || lobe_shown == lobe ? f : vec3(0.0); }
float lobe_alone(uint lobe, float f) { return lobe_alone(lobe, vec3(f)).x; }
#define LOBE(lobe, f) lobe_alone(lobe, f)
#else
#define LOBE(lobe, f) f
#endif
