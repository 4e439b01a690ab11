// Adaptive sampling: which pixels a dispatch renders, and how many samples each of them shall have
// (gpu/picture/sample_plan.py).
#if ADAPTIVE
// The plan's counts, by area and class of rows; areas are x, y << 16.
layout(std430, binding = SLOT_SAMPLE_PLAN) readonly buffer sample_plan_buffer { uvec4 sample_plan_counts[]; };
layout(std430, binding = SLOT_PLANNED_AREAS) readonly buffer planned_area_buffer { uint sample_plan_areas[]; };

// Finds the pixel of this invocation; false where there is none. tile_size.x is the number of areas.
bool sample_plan_pixel(out uvec2 pixel, out uint slot) {
    uint at = camera_group().x;
    uint area = at < uniforms.tile_size.x ? sample_plan_areas[at] : 0xffffffffu;
    pixel = PLAN_AREA * uvec2(area & 0xffffu, area >> 16u) + gl_LocalInvocationID.xy;
    slot = pixel.y * uniforms.slot_width + pixel.x - uniforms.slot_first;
    return all(lessThan(pixel, uniforms.resolution));
}

// The number of samples that this dispatch adds to a pixel that has `done` samples.
uint sample_plan_due(uvec2 pixel, uint done) {
    uvec2 area = pixel / PLAN_AREA;
    uint columns = (uniforms.resolution.x + PLAN_AREA - 1u) / PLAN_AREA;
    uint wanted = sample_plan_counts[area.y * columns + area.x][pixel.y % PLAN_CLASSES];
    return min(wanted - min(done, wanted), uniforms.sample_count);
}
#endif
