// (1 - c)^5, the angle's share in Schlick's reflectance [Schlick 1994, eq. 15].
float fresnel_schlick(float c) {
    float m = clamp(1.0 - c, 0.0, 1.0);
    float m2 = m * m;
    return m2 * m2 * m;
}
