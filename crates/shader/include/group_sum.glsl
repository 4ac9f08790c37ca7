// Sums over a group of 256 threads. A sum that overflows stays at the largest number instead of wrapping around to 0: a list that does
// not fit must not look as if it did.
#ifndef AFTERLIGHT_GROUP_SUM
#define AFTERLIGHT_GROUP_SUM

layout(local_size_x = 256) in;
shared uint sums[256];

uint saturating_add(uint a, uint b) {
    uint sum = a + b;
    return sum < a ? 0xffffffffu : sum;
}

// The sum over the threads before this one (Hillis and Steele's scan); `total` is the sum over all.
uint sum_before(uint own, out uint total) {
    uint lane = gl_LocalInvocationID.x;
    sums[lane] = own;
    barrier();
    for (uint step = 1u; step < 256u; step *= 2u) {
        uint other = lane >= step ? sums[lane - step] : 0u;
        barrier();
        sums[lane] = saturating_add(sums[lane], other);
        barrier();
    }
    total = sums[255];
    return lane == 0u ? 0u : sums[lane - 1u];
}

// The range of elements, first and end, that this thread handles of `count` in all.
uvec2 elements_of_thread(uint count) {
    uint a_thread = (count + 255u) / 256u;
    uint first = min(gl_LocalInvocationID.x * a_thread, count);
    return uvec2(first, min(first + a_thread, count));
}

#endif
