// What the passes that put triangles with alpha blending in order share.
#ifndef AFTERLIGHT_TRANSPARENT_ORDER
#define AFTERLIGHT_TRANSPARENT_ORDER
#include "group_rows.glsl"

const uint NO_KEY = 0xffffffffu;    // of a triangle whose draw is out of view: behind all others
const uint THREADS = 256u;          // GROUP_TRIANGLES of device.rs

// BlendedTriangle in crates/shader/src/structs.rs.
struct BlendedTriangle {
    vec3 centroid_os;
    uint draw;
    uint first_index;
};

layout(set = 0, binding = 8, scalar) readonly buffer BlendedTriangles {
    BlendedTriangle triangles[];
};
layout(push_constant) uniform Push {
    uint triangle_count;
};

// The triangle, or its place in the order, that this thread has: groups stand in rows.
uint own_place() {
    return group_number() * THREADS + gl_LocalInvocationIndex;
}

#endif
