// Where a vertex stood in the frame before, for surfaces/velocity/.
#ifndef AFTERLIGHT_BEFORE
#define AFTERLIGHT_BEFORE
#include "frame.glsl"
#include "scene.glsl"
#include "surfaces/geometry/clip_before.glsl"

layout(set = 0, binding = 26) uniform utexture2D draw_data_before;
layout(set = 0, binding = 27, scalar) readonly buffer PositionsBefore {
    float positions_before[];       // three a vertex, of deformed vertices alone
};
layout(constant_id = 16) const uint FIRST_DEFORMED = 0u;
layout(constant_id = 17) const uint END_DEFORMED = 0u;

// World position in the frame before of the vertex that stands at `now_os` in this one. Without history a deformed mesh counts as rigid.
vec3 position_before(vec3 now_os) {
    vec3 p = now_os;
    uint vertex = uint(gl_VertexIndex);
    if (vertex >= FIRST_DEFORMED && vertex < END_DEFORMED && (frame.before & BEFORE_HISTORY) != 0u) {
        uint i = 3u * (vertex - FIRST_DEFORMED);
        p = vec3(positions_before[i], positions_before[i + 1u], positions_before[i + 2u]);
    }
    DrawData draw = load_draw(draw_data_before, uint(gl_InstanceIndex));
    return position_to_world(draw.object_row0, draw.object_row1, draw.object_row2, p);
}

#ifdef TESSELLATION
layout(location = 6) out vec3 position_before_ws;
#endif

#endif
