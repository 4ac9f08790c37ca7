// Finds the bin of every draw, and counts the bins of each batch: a group a batch.
//
// In: CullBlock, draw_data, draw_bounds. Out: DrawBins: a word a draw; BinCounts: 256 words a batch.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared/cull/batches.glsl"
#include "shared/cull/choice.glsl"

layout(local_size_x = 256) in;      // THREADS
layout(set = 0, binding = 1) uniform utexture2D draw_data;
layout(set = 0, binding = 8, scalar) uniform CullBlock {
    DrawChoiceConstants choice;
};
layout(set = 0, binding = 9) uniform utexture2D draw_bounds;
layout(set = 0, binding = 10, scalar) writeonly buffer DrawBins {
    uint draw_bins[];
};
layout(set = 0, binding = 11, scalar) writeonly buffer BinCounts {
    uint bin_counts[];
};

shared uint counts[BINS];

void main() {
    uint thread = gl_LocalInvocationIndex;
    Batch batch = own_batch();
    counts[thread] = 0u;
    barrier();
    for (uint round = 0u; round < rounds; ++round) {
        uint draw = batch.first_draw + round * THREADS + thread;
        if (draw < batch.end_draw) {
            uint index_count;
            Bounds bounds_os = load_draw_bounds(draw_bounds, draw, index_count);
            uint bin = bin_of(choice, transformed_bounds(bounds_os, load_draw(draw_data, draw)));
            draw_bins[draw] = bin;
            if (bin != NO_BIN) {
                atomicAdd(counts[bin], 1u);
            }
        }
    }
    barrier();
    bin_counts[batch.number * BINS + thread] = counts[thread];
}
