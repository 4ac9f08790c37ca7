// Writes the indirect command of every draw that has a bin: bins of a bucket follow each other, in a bin the order is the scene's. A group a batch.
// A group adds up the counts of its bucket's batches by itself, so that no pass stands between.
//
// In: DrawBins, BinCounts, draw_data, draw_bounds. Out: DrawCommands: VkDrawIndexedIndirectCommand, a range a bucket; DrawCounts: a word a bucket.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#include "group_sum.glsl"
#include "shared/cull/batches.glsl"
#include "shared/cull/choice.glsl"

layout(set = 0, binding = 1) uniform utexture2D draw_data;
layout(set = 0, binding = 8, scalar) readonly buffer DrawBins {
    uint draw_bins[];
};
layout(set = 0, binding = 9) uniform utexture2D draw_bounds;
layout(set = 0, binding = 10, scalar) readonly buffer BinCounts {
    uint bin_counts[];
};
layout(set = 0, binding = 11, scalar) writeonly buffer DrawCommands {
    uint draw_commands[];
};
layout(set = 0, binding = 12, scalar) writeonly buffer DrawCounts {
    uint draw_counts[];
};

const uint WORDS = THREADS / 32u;   // a bit for each thread of the group

// Threads of a round by their bin, a bit each: their order is that of their draws, whatever order the device runs them in.
shared uint marks[BINS * WORDS];
// Place of the next draw of each bin.
shared uint next[BINS];

// Threads of the same bin before this one.
uint rank_in_round(uint bin, uint thread) {
    uint rank = 0u;
    for (uint word = 0u; word < thread / 32u; ++word) {
        rank += uint(bitCount(marks[bin * WORDS + word]));
    }
    uint lower = (1u << thread % 32u) - 1u;
    return rank + uint(bitCount(marks[bin * WORDS + thread / 32u] & lower));
}

void write_command(uint draw, uint place) {
    uint index_count;
    load_draw_bounds(draw_bounds, draw, index_count);
    DrawData data = load_draw(draw_data, draw);
    uint at = place * 5u;
    draw_commands[at] = index_count;
    draw_commands[at + 1u] = 1u;
    draw_commands[at + 2u] = data.first_index;
    draw_commands[at + 3u] = data.first_vertex;
    draw_commands[at + 4u] = draw;
}

void main() {
    uint thread = gl_LocalInvocationIndex;
    Batch batch = own_batch();
    // A thread a bin: its draws in batches before this one, and in all of the bucket.
    uint before = 0u, of_bin = 0u;
    for (uint other = batch.first_of_bucket; other < batch.end_of_bucket; ++other) {
        uint count = bin_counts[other * BINS + thread];
        before += other < batch.number ? count : 0u;
        of_bin += count;
    }
    uint of_bucket;
    uint first_of_bin = sum_before(of_bin, of_bucket);
    next[thread] = bucket_first[batch.bucket] + first_of_bin + before;
    if (thread == 0u && batch.number == batch.first_of_bucket) {
        draw_counts[batch.bucket] = of_bucket;
    }
    for (uint word = 0u; word < WORDS; ++word) {
        marks[thread * WORDS + word] = 0u;
    }
    barrier();
    for (uint round = 0u; round < rounds; ++round) {
        uint draw = batch.first_draw + round * THREADS + thread;
        uint bin = draw < batch.end_draw ? draw_bins[draw] : NO_BIN;
        if (bin != NO_BIN) {
            atomicOr(marks[bin * WORDS + thread / 32u], 1u << thread % 32u);
        }
        barrier();
        if (bin != NO_BIN) {
            write_command(draw, next[bin] + rank_in_round(bin, thread));
        }
        barrier();
        for (uint word = 0u; word < WORDS; ++word) {
            next[thread] += uint(bitCount(marks[thread * WORDS + word]));
            marks[thread * WORDS + word] = 0u;
        }
        barrier();
    }
}
