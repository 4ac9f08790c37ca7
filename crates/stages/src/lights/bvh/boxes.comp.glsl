// Boxes of one level of the tree over the lights, from those of the level below or the spheres of the lights. A group of 32 threads
// makes a node, one thread for each child. One thread for each node took 22 to 30 us a level instead of 17 (NVIDIA H200, where an empty
// pass takes 14).
//
// In: light_spheres. In and out: boxes, RGBA32F, two texels a node: least and greatest corner, world space.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "lights/bvh/tree.glsl"

layout(local_size_x = 32) in;   // TREE_WIDTH
layout(constant_id = 8) const uint LEVEL = 1u;
layout(set = 0, binding = 8, rgba32f) uniform image2D boxes;

const uint GROUPS_A_ROW = 32768u;    // lights/bvh/mod.rs
shared vec3 lows[TREE_WIDTH];
shared vec3 highs[TREE_WIDTH];

// Box of a child; an empty box where there is no child.
void load_child(uint child, out vec3 low, out vec3 high) {
    low = vec3(3.402823e38);
    high = vec3(-3.402823e38);
    if (child >= tree_count(LEVEL - 1u)) {
        return;
    }
    if (LEVEL == 1u) {
        vec4 sphere = tree_sphere(child);
        low = sphere.xyz - sphere.w;
        high = sphere.xyz + sphere.w;
    } else {
        ivec2 texel = tree_texel(tree_first(LEVEL - 1u) + child);
        low = imageLoad(boxes, texel).xyz;
        high = imageLoad(boxes, texel + ivec2(1, 0)).xyz;
    }
}

void main() {
    uint node = gl_WorkGroupID.y * GROUPS_A_ROW + gl_WorkGroupID.x, lane = gl_LocalInvocationIndex;
    load_child(node * TREE_WIDTH + lane, lows[lane], highs[lane]);
    for (uint step = TREE_WIDTH / 2u; step > 0u; step /= 2u) {
        barrier();
        if (lane < step) {
            lows[lane] = min(lows[lane], lows[lane + step]);
            highs[lane] = max(highs[lane], highs[lane + step]);
        }
    }
    if (lane == 0u && node < tree_count(LEVEL)) {
        ivec2 texel = tree_texel(tree_first(LEVEL) + node);
        imageStore(boxes, texel, vec4(lows[0], 0.0));
        imageStore(boxes, texel + ivec2(1, 0), vec4(highs[0], 0.0));
    }
}
