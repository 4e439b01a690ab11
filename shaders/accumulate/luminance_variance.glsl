// The second moment of the luminance from those of the channels, taken to vary together, which they nearly do.
float luminance_variance(vec3 moments) {
    float s = dot(sqrt(max(moments, vec3(0.0))), LUMINANCE);
    return s * s;
}
