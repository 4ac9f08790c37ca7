// Marks the triangles that show in any sample: a thread a pixel. No lock and no cache, since a bit needs no slot.
//
// In: ids, RGBA8 as 32 bits, or the keys of compute_raster. Out: MarkedBits, a bit a triangle of the scene. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#ifdef SAMPLES_IN_KEYS
#include "compute_raster/key_ids.glsl"
#else
#include "multisample/samples.glsl"
layout(set = 0, binding = 8) uniform SAMPLED_IMAGE ids;
#endif

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 10, scalar) buffer MarkedBits {
    uint marked_bits[];
};

uint sample_triangle(ivec2 pixel, uint i) {
#ifdef SAMPLES_IN_KEYS
    return sample_order(pixel, i);
#else
    return packUnorm4x8(FETCH_SAMPLE(ids, pixel, i));
#endif
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, frame.size_px))) {
        return;
    }
    uint before = NO_TRIANGLE;
    for (uint i = 0u; i < SAMPLES; ++i) {
        uint id = sample_triangle(pixel, i);
        if (id == before || id == NO_TRIANGLE) {
            continue;
        }
        before = id;
        uint bit = 1u << (id & 31u);
        // A stale word costs an atomic, never a triangle.
        if ((marked_bits[id >> 5] & bit) == 0u) {
            atomicOr(marked_bits[id >> 5], bit);
        }
    }
}
