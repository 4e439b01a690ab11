// Per channel [Reinhard et al. 2002, eq. 3].
vec3 reinhard_curve(vec3 c) { return c / (1.0 + c); }
