// Light at a point by the tree over the lights: every surface walks down to the lights around it.
#ifndef AFTERLIGHT_LIGHT_TREE_VISIT
#define AFTERLIGHT_LIGHT_TREE_VISIT
#include "lights/bvh/boxes.glsl"
#include "shading.glsl"

vec3 tree_leaf_radiance(ShadingPoint p, uint leaf) {
    vec3 radiance = vec3(0.0);
    uint end = min((leaf + 1u) * TREE_WIDTH, tree_lights());
    for (uint place = leaf * TREE_WIDTH; place < end; ++place) {
        radiance += light_radiance(p, frame.unbounded_light_count + place);
    }
    return radiance;
}

// Radiance of the lights with an end that reach a point, in their order. Nodes are walked in depth first order; a node's
// number says where to go on, so that there is no stack.
vec3 tree_radiance(ShadingPoint p) {
    uint top = tree_top();
    if (top == 0u) {
        return tree_leaf_radiance(p, 0u);
    }
    vec3 radiance = vec3(0.0);
    uint level = top, node = 0u;
    // Once a node's number is past the end of its level, no node is left on any level.
    while (node < tree_count(level)) {
        if (light_box_holds(level, node, p.position_ws)) {
            if (level > 1u) {
                --level;
                node *= TREE_WIDTH;
                continue;
            }
            radiance += tree_leaf_radiance(p, node);
        }
        ++node;
        while (level < top && node % TREE_WIDTH == 0u) {
            node /= TREE_WIDTH;
            ++level;
        }
    }
    return radiance;
}

#endif
