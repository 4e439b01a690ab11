vec3 exponential_curve(vec3 c) { return 1.0 - exp(-c); }
