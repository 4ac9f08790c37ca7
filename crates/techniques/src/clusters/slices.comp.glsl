// View distances at which slices begin, from the range that the image shows: equal steps, or equal ratios (Olsson et al. 2012,
// section 3.1). One group.
//
// In: DepthRange. Out: SliceBegins, SLICES + 1 distances, m.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(set = 0, binding = 8, scalar) readonly buffer DepthRange {
    uint not_nearest;
    uint farthest;
};
layout(set = 0, binding = 9, scalar) writeonly buffer SliceBegins {
    float slice_begins_out[];
};
layout(constant_id = 9) const uint SLICES = 32u;
layout(constant_id = 10) const uint LOGARITHMIC = 1u;

// Where the eye almost touches a surface, ratios would spend most slices on what nobody sees: they start at this share of the
// farthest distance.
const float LEAST_SHARE = 1e-4;

void main() {
    float near_m = not_nearest == 0u ? 0.0 : uintBitsToFloat(~not_nearest);
    float far_m = uintBitsToFloat(farthest);
    float first_m = max(near_m, far_m * LEAST_SHARE);
    for (uint k = gl_LocalInvocationID.x; k <= SLICES; k += 64u) {
        float share = float(k) / float(SLICES);
        float begin_m = mix(near_m, far_m, share);
        if (LOGARITHMIC != 0u && first_m > 0.0) {
            begin_m = first_m * pow(far_m / first_m, share);
        }
        begin_m = k == 0u ? near_m : k == SLICES ? far_m : clamp(begin_m, near_m, far_m);
        slice_begins_out[k] = begin_m;
    }
}
