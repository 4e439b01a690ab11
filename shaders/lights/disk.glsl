// A disk that shines: a quad with the bit ROUND, sampled uniformly by its area.

// The place along u and v, 0..1, of the square's number u.
vec2 disk_light_place(vec2 u) { return 0.5 + 0.5 * sampling_disk(u); }
