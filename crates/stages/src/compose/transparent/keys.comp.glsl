// The key of every triangle with alpha blending, by which the farthest comes first: a thread a triangle.
//
// In: ViewBlock, BlendedTriangles, draw_data, draw_bounds. Out: Keys, Values: the triangles by their numbers.
// CPU twin: Blended::order in crates/frame/src/scene/blended.rs, operation by operation.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#include "compose/transparent/order.glsl"
#include "shared/cull/choice.glsl"
#include "shared/sort/sortable.glsl"

layout(local_size_x = 256) in;      // THREADS
layout(set = 0, binding = 1) uniform utexture2D draw_data;
layout(set = 0, binding = 9) uniform utexture2D draw_bounds;
layout(set = 0, binding = 10, scalar) uniform ViewBlock {
    DrawChoiceConstants view;       // half-spaces and view distance: nothing else of it is used
};
layout(set = 0, binding = 11, scalar) writeonly buffer Keys {
    uint keys[];
};
layout(set = 0, binding = 12, scalar) writeonly buffer Values {
    uint values[];
};

float view_distance_m(DrawData draw, vec3 p_os) {
    vec4 rows[3] = vec4[3](draw.object_row0, draw.object_row1, draw.object_row2);
    vec3 p_ws;
    for (uint axis = 0u; axis < 3u; ++axis) {
        precise float moved = dot_in_order(rows[axis].xyz, p_os) + rows[axis].w;
        p_ws[axis] = moved;
    }
    precise float distance_m = dot_in_order(view.distance_from_world.xyz, p_ws) + view.distance_from_world.w;
    return distance_m;
}

void main() {
    uint number = own_place();
    if (number >= triangle_count) {
        return;
    }
    BlendedTriangle triangle = triangles[number];
    DrawData draw = load_draw(draw_data, triangle.draw);
    uint index_count;
    Bounds bounds_os = load_draw_bounds(draw_bounds, triangle.draw, index_count);
    Bounds reached = displaced(transformed_bounds(bounds_os, draw), view.displacement_m);
    uint key = NO_KEY;
    if (is_in_view(view, reached)) {
        // The last key is of those out of view; of distances none but a NaN has it.
        key = min(~sortable_bits(view_distance_m(draw, triangle.centroid_os)), NO_KEY - 1u);
    }
    keys[number] = key;
    values[number] = number;
}
