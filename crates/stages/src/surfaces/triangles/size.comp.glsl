// Groups for the derivative pass, from the count of triangles: no read-back. In: TriangleCount. Out: DispatchGroups. One thread.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "surfaces/triangles/groups.glsl"

layout(local_size_x = 1) in;
layout(set = 0, binding = 8, scalar) readonly buffer TriangleCount {
    uint triangles_needed;
    uint triangles_dropped;
};
layout(set = 0, binding = 9, scalar) writeonly buffer DispatchGroups {
    uvec3 dispatch_groups;
};
// No specialization constant: a buffer that grows makes no pipeline anew.
layout(push_constant, scalar) uniform Push {
    uint triangle_capacity;
};

void main() {
    dispatch_groups = derivative_groups(min(triangles_needed, triangle_capacity));
}
