// Lists of lights, one a pixel (Petrescu et al. 2016, section 4.7, Figure 4): heads and nodes, each a link that is zero at the end
// of a list, else a node's number plus one.
#ifndef AFTERLIGHT_LIGHT_LISTS
#define AFTERLIGHT_LIGHT_LISTS
#include "shading.glsl"

layout(set = 0, binding = 14, scalar) readonly buffer LightHeads {
    uint light_heads[];
};
// A light's number, the link to the node before it.
layout(set = 0, binding = 15, scalar) readonly buffer LightNodes {
    uvec2 light_nodes[];
};

// Radiance of the lights without an end and of those in the pixel's list.
vec3 listed_radiance(ShadingPoint p, uvec2 pixel) {
    vec3 radiance = vec3(0.0);
    for (uint i = 0u; i < frame.unbounded_light_count; ++i) {
        radiance += light_radiance(p, i);
    }
    uint link = light_heads[pixel.y * frame.size_px.x + pixel.x];
    while (link != 0u) {
        uvec2 node = light_nodes[link - 1u];
        radiance += light_radiance(p, node.x);
        link = node.y;
    }
    return radiance;
}

#endif
