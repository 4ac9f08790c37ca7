// Boxes of one level of the tree over the lights, from those of the level below or the spheres of the lights. A thread a node.
//
// In: light_spheres. In and out: boxes, RGBA32F, two texels a node: least and greatest corner, world space.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "light_bvh/tree.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 8) const uint LEVEL = 1u;
layout(set = 0, binding = 8, rgba32f) uniform image2D boxes;

void include_child(uint child, inout vec3 low, inout vec3 high) {
    if (LEVEL == 1u) {
        vec4 sphere = tree_sphere(child);
        low = min(low, sphere.xyz - sphere.w);
        high = max(high, sphere.xyz + sphere.w);
    } else {
        ivec2 texel = tree_texel(tree_first(LEVEL - 1u) + child);
        low = min(low, imageLoad(boxes, texel).xyz);
        high = max(high, imageLoad(boxes, texel + ivec2(1, 0)).xyz);
    }
}

void main() {
    uint node = gl_GlobalInvocationID.x;
    if (node >= tree_count(LEVEL)) {
        return;
    }
    vec3 low = vec3(3.402823e38), high = vec3(-3.402823e38);
    uint end = min((node + 1u) * TREE_WIDTH, tree_count(LEVEL - 1u));
    for (uint child = node * TREE_WIDTH; child < end; ++child) {
        include_child(child, low, high);
    }
    ivec2 texel = tree_texel(tree_first(LEVEL) + node);
    imageStore(boxes, texel, vec4(low, 0.0));
    imageStore(boxes, texel + ivec2(1, 0), vec4(high, 0.0));
}
