// Sums the histogram: how many items of each digit stand in the batches before. A group a digit, so that no group waits for another.
//
// In, out: Histogram. Out: DigitTotals: items of each digit in all.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/sort/items.glsl"
#include "group_sum.glsl"

layout(set = 0, binding = 9, scalar) buffer Histogram {
    uint histogram[];
};
layout(set = 0, binding = 10, scalar) writeonly buffer DigitTotals {
    uint digit_totals[];
};

void main() {
    uint digit = gl_WorkGroupID.x;
    uint first = digit * batch_count();
    uvec2 batches = elements_of_thread(batch_count());
    uint own = 0u;
    for (uint batch = batches.x; batch < batches.y; ++batch) {
        own += histogram[first + batch];
    }
    uint total;
    uint before = sum_before(own, total);
    for (uint batch = batches.x; batch < batches.y; ++batch) {
        uint count = histogram[first + batch];
        histogram[first + batch] = before;
        before += count;
    }
    if (gl_LocalInvocationIndex == 0u) {
        digit_totals[digit] = total;
    }
}
