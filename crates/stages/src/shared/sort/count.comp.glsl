// Counts the digits of each batch: a group a batch, in rows.
//
// In: Keys. Out: Histogram: for each digit, the items of each batch that have it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/sort/items.glsl"

layout(local_size_x = 256) in;      // THREADS
layout(set = 0, binding = 9, scalar) readonly buffer Keys {
    uint keys[];
};
layout(set = 0, binding = 10, scalar) writeonly buffer Histogram {
    uint histogram[];
};

shared uint counts[DIGITS];

void main() {
    uint batch = group_number(), thread = gl_LocalInvocationIndex;
    if (batch >= batch_count()) {
        return;
    }
    counts[thread] = 0u;
    // All loads before the first addition, so that they wait for memory together.
    uint first = batch * BATCH_ITEMS + thread, end = item_count();
    uint own[ROUNDS];
    for (uint round = 0u; round < ROUNDS; ++round) {
        uint item = first + round * THREADS;
        own[round] = item < end ? keys[item] : 0u;
    }
    barrier();
    for (uint round = 0u; round < ROUNDS; ++round) {
        if (first + round * THREADS < end) {
            atomicAdd(counts[digit_of(own[round])], 1u);
        }
    }
    barrier();
    histogram[thread * batch_count() + batch] = counts[thread];
}
