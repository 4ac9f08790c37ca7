// Boxes of the tree over the lights, for those who read them.
#ifndef AFTERLIGHT_LIGHT_BOXES
#define AFTERLIGHT_LIGHT_BOXES
#include "lights/bvh/tree.glsl"

layout(set = 0, binding = 36) uniform texture2D light_boxes;

struct LightBox {
    vec3 low, high;     // world space, m
};

LightBox light_box(uint level, uint node) {
    ivec2 texel = tree_texel(tree_first(level) + node);
    return LightBox(texelFetch(light_boxes, texel, 0).xyz, texelFetch(light_boxes, texel + ivec2(1, 0), 0).xyz);
}

bool light_box_holds(uint level, uint node, vec3 point_ws) {
    LightBox box = light_box(level, node);
    return all(greaterThanEqual(point_ws, box.low)) && all(lessThanEqual(point_ws, box.high));
}

#endif
