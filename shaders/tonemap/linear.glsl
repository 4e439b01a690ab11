vec3 linear_curve(vec3 c) { return c; }
