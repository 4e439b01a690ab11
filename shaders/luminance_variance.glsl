// The second moment of the luminance from those of the channels, taken to vary together, which they nearly do.
float luminance_variance(vec3 moments) {
    float s = dot(sqrt(max(moments, vec3(0.0))), vec3(0.2126, 0.7152, 0.0722));
    return s * s;
}
