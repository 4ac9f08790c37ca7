// Lists of lights, one a pixel (Petrescu et al. 2016, section 4.7, Figure 4): heads and nodes with a link each, which is zero at the end
// of a list, else a node's number plus one. A head also has the view distances between which the list holds.
#ifndef AFTERLIGHT_LIGHT_LISTS
#define AFTERLIGHT_LIGHT_LISTS
#include "lights/bvh/visit.glsl"
#include "lights/pixel_lists/head.glsl"
#include "shading.glsl"

layout(set = 0, binding = 37, scalar) readonly buffer LightHeads {
    LightHead light_heads[];
};
// A light's number, the link to the node before it.
layout(set = 0, binding = 38, scalar) readonly buffer LightNodes {
    uvec2 light_nodes[];
};

// 1 where surfaces may be shaded at places that the list was not made for. Otherwise the compiler removes the code that walks the tree,
// because its registers slow down the whole shader (light-list-forward: 21.7 ms instead of 6.5, NVIDIA H200, Sponza, 10,000 lights).
layout(constant_id = 47) const uint LISTS_SAMPLED = 1u;

// Radiance of the lights with an end that reach a surface of a pixel at a view distance. A surface outside of the range
// that the list was made for asks the tree over the lights.
vec3 listed_radiance(ShadingPoint p, uvec2 pixel, float distance_m) {
    LightHead head = light_heads[pixel.y * frame.size_px.x + pixel.x];
    if (LISTS_SAMPLED != 0u && (distance_m < head.nearest_m || distance_m > head.farthest_m)) {
        return tree_radiance(p);
    }
    vec3 radiance = vec3(0.0);
    for (uint link = head.link; link != 0u;) {
        uvec2 node = light_nodes[link - 1u];
        radiance += light_radiance(p, node.x);
        link = node.y;
    }
    return radiance;
}

#endif
