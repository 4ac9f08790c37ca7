// Sums over a group of 256 threads that end at the greatest number instead of beginning again at 0: what does not fit must not
// look as if it did.
#ifndef AFTERLIGHT_GROUP_SUM
#define AFTERLIGHT_GROUP_SUM

layout(local_size_x = 256) in;
shared uint sums[256];

uint saturating_add(uint a, uint b) {
    uint sum = a + b;
    return sum < a ? 0xffffffffu : sum;
}

// Sum of the threads before this one; `total` is that of all. Hillis and Steele's scan.
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

// First and end of the elements of this thread, of `count` in all.
uvec2 elements_of_thread(uint count) {
    uint a_thread = (count + 255u) / 256u;
    uint first = min(gl_LocalInvocationID.x * a_thread, count);
    return uvec2(first, min(first + a_thread, count));
}

#endif
