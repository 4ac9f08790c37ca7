// Counts the runs that begin in each group's part of the order, and empties the commands.
//
// In: BlendedTriangles, Keys, Values. Out: RunCounts: a word a group; DrawCommands: the number of indices of each is 0.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "group_sum.glsl"
#include "compose/transparent/runs.glsl"

layout(set = 0, binding = 11, scalar) writeonly buffer RunCounts {
    uint run_counts[];
};
layout(set = 0, binding = 12, scalar) writeonly buffer DrawCommands {
    uint draw_commands[];
};

void main() {
    uint place = own_place();
    uint runs;
    sum_before(uint(begins_run(place)), runs);
    if (gl_LocalInvocationIndex == 0u && place < triangle_count) {
        run_counts[place / THREADS] = runs;
    }
    if (place < triangle_count) {
        draw_commands[place * 5u] = 0u;
    }
}
