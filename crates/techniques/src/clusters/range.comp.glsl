// The range of view distances that the depth buffer shows. A thread a pixel.
//
// In: cluster_depth. Out: DepthRange, two words, zero before: the complement of the bits of the nearest, the bits of the
// farthest (bits of non-negative floats order as unsigned integers). Dispatch: 16x16 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "frame.glsl"

layout(local_size_x = 16, local_size_y = 16) in;
layout(set = 0, binding = 8) uniform texture2D cluster_depth;
layout(set = 0, binding = 9, scalar) buffer DepthRange {
    uint not_nearest;
    uint farthest;
};

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    float depth = all(lessThan(pixel, frame.size_px)) ? texelFetch(cluster_depth, ivec2(pixel), 0).r : 0.0;
    uint bits = floatBitsToUint(distance_from_depth(depth));
    bool covered = depth > 0.0;
    uint near = subgroupMax(covered ? ~bits : 0u);
    uint far = subgroupMax(covered ? bits : 0u);
    if (subgroupElect() && near != 0u) {
        atomicMax(not_nearest, near);
        atomicMax(farthest, far);
    }
}
