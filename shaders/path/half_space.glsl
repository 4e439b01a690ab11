// The albedo of single scattering by which a half space shows a colour head-on under a constant sky, for a mean cosine g:
// gpu/tables/half_space.py has the constants, and says where they come from and how far they hold.
#if HAS_WALKS
vec3 half_space_albedo(vec3 color, float g) {
    vec3 over = 1.0 + color * (HALF_SPACE_NUMERATOR.x + color * HALF_SPACE_NUMERATOR.y);
    vec3 under = 1.0 + color * (HALF_SPACE_DENOMINATOR.x + color * HALF_SPACE_DENOMINATOR.y);
    vec3 root = (1.0 - color) * over / under, lost = root * root;
    return (1.0 - lost) / (1.0 - g * lost);
}
#endif
