// Writes the indices of the triangles in their order, and a command for each run: a thread a place of the order.
//
// In: BlendedTriangles, Keys, Values, RunCounts, SceneIndices, draw_data. Out: Indices, counted from the first vertex of their draw;
// DrawCommands: VkDrawIndexedIndirectCommand; DrawCount: their number.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#include "group_sum.glsl"
#include "compose/transparent/runs.glsl"
#include "scene.glsl"

layout(set = 0, binding = 1) uniform utexture2D draw_data;
layout(set = 0, binding = 11, scalar) readonly buffer RunCounts {
    uint run_counts[];
};
layout(set = 0, binding = 12, scalar) buffer DrawCommands {
    uint draw_commands[];
};
layout(set = 0, binding = 13, scalar) readonly buffer SceneIndices {
    uint scene_indices[];
};
layout(set = 0, binding = 14, scalar) writeonly buffer Indices {
    uint indices[];
};
layout(set = 0, binding = 15, scalar) writeonly buffer DrawCount {
    uint draw_count;
};

// Runs that begin in the groups before one, summed by the whole group; `all_runs` is those of all groups.
uint runs_before(uint group, out uint all_runs) {
    uint groups = (triangle_count + THREADS - 1u) / THREADS, before = 0u, behind = 0u;
    for (uint other = gl_LocalInvocationIndex; other < groups; other += THREADS) {
        before += other < group ? run_counts[other] : 0u;
        behind += other < group ? 0u : run_counts[other];
    }
    uint total_before, total_behind;
    sum_before(before, total_before);
    barrier();
    sum_before(behind, total_behind);
    barrier();
    all_runs = total_before + total_behind;
    return total_before;
}

void main() {
    uint place = own_place();
    uint all_runs, of_group;
    uint first_run = runs_before(group_number(), all_runs);
    bool begins = begins_run(place);
    uint run = first_run + sum_before(uint(begins), of_group) + uint(begins) - 1u;
    if (place == 0u) {
        draw_count = all_runs;
    }
    if (!is_in_view_at(place)) {
        return;
    }
    BlendedTriangle triangle = triangles[values[place]];
    for (uint corner = 0u; corner < 3u; ++corner) {
        indices[place * 3u + corner] = scene_indices[triangle.first_index + corner];
    }
    // First minus and end plus: their sum, modulo 2^32, is the number of indices, whichever comes first.
    if (begins) {
        uint at = run * 5u;
        atomicAdd(draw_commands[at], -(place * 3u));
        draw_commands[at + 1u] = 1u;
        draw_commands[at + 2u] = place * 3u;
        draw_commands[at + 3u] = load_draw(draw_data, triangle.draw).first_vertex;
        draw_commands[at + 4u] = triangle.draw;
    }
    if (ends_run(place)) {
        atomicAdd(draw_commands[run * 5u], (place + 1u) * 3u);
    }
}
