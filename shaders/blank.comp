// Entry: uses each binding point and each texture unit, so that the driver lets go of what was bound there.
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer words_buffer { uint word; } bound[SLOTS];
layout(binding = 0) uniform sampler2D units[UNITS];

void main() {
    float sum = 0.0;
    for (int i = 0; i < UNITS; ++i) sum += float(textureSize(units[i], 0).x);
    for (int i = 0; i < SLOTS; ++i) sum += uintBitsToFloat(bound[i].word);
    bound[SLOTS - 1].word = floatBitsToUint(sum);
}
