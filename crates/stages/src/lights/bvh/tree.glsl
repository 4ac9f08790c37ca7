// A tree over the lights with an end (Olsson et al. 2012, section 3.4: a tree 32 wide, complete but for its end, so that no node
// holds a link). Level 0 are the lights; node i of a level has the children 32 i to 32 i + 31 of the level below; the top level has
// at most 32 nodes. Lights lie along a Morton curve (crates/frame/src/scene/lights.rs), so that children are neighbours.
//
// Departure: the lights are put in order when they are uploaded, not in every frame; boxes are made anew in every frame
// (boxes.comp), so that a light that moves makes boxes larger, and no result wrong.
#ifndef AFTERLIGHT_LIGHT_TREE
#define AFTERLIGHT_LIGHT_TREE
#include "culling.glsl"

const uint TREE_WIDTH = 32u;
const uint TREE_WIDTH_LOG2 = 5u;

uint tree_lights() {
    return frame.light_count - frame.unbounded_light_count;
}

// Nodes of a level.
uint tree_count(uint level) {
    uint shift = TREE_WIDTH_LOG2 * level;
    return (tree_lights() + (1u << shift) - 1u) >> shift;
}

// Number of a level's first node; level 1 comes first.
uint tree_first(uint level) {
    uint first = 0u;
    for (uint below = 1u; below < level; ++below) {
        first += tree_count(below);
    }
    return first;
}

uint tree_top() {
    uint level = 0u;
    while (tree_count(level) > TREE_WIDTH) {
        ++level;
    }
    return level;
}

// Two texels a node, 512 nodes a row.
ivec2 tree_texel(uint node) {
    return ivec2((node & 511u) * 2u, node >> 9);
}

// Sphere of a light by its place in the tree.
vec4 tree_sphere(uint place) {
    return light_sphere(frame.unbounded_light_count + place);
}

#endif
