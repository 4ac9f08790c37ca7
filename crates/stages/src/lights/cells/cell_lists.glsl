// Light by the lists of cells. Lights are visited in their order, so that sums do not depend on the schedule.
#ifndef AFTERLIGHT_CLUSTER_LISTS
#define AFTERLIGHT_CLUSTER_LISTS
#include "lights/cells/grid.glsl"
#include "lights/bvh/visit.glsl"
#include "shading.glsl"

layout(set = 0, binding = 32, scalar) readonly buffer Cells {
    Cell cells[];
};
// Of each word of bits: the bits, a slice each, and the number of cells before them. Of tiles without slices: whether there is a cell,
// and its number.
layout(set = 0, binding = 33, scalar) readonly buffer CellWords {
    uvec2 cell_words[];
};
// First and end of the list of each cell.
layout(set = 0, binding = 34, scalar) readonly buffer ListEnds {
    uvec2 list_ends[];
};
layout(set = 0, binding = 35, scalar) readonly buffer CellLists {
    uint cell_lists[];
};

// Finds the cell of a surface. False if no cell was made for its place, or there was no room for that cell.
bool cell_of(uvec2 pixel, float distance_m, out uint place) {
    uint tile = tile_of(pixel);
    if (DIVISION != CLUSTERS) {
        uvec2 word = cell_words[tile];
        place = word.y;
        if (word.x == 0u || place >= uint(cells.length())) {
            return false;
        }
        Cell cell = cells[place];
        return distance_m >= cell.nearest_m && distance_m <= cell.farthest_m &&
               (cell.steps >> step_of(distance_m, cell.nearest_m, cell.farthest_m) & 1u) != 0u;
    }
    place = 0u;
    // Asked before the slice is: what is no number has none, and would read anywhere.
    if (!(distance_m >= frame.distance_range_m.x && distance_m <= frame.distance_range_m.y)) {
        return false;
    }
    uint slice = slice_of(distance_m);
    uvec2 word = cell_words[tile * WORDS + slice / 32u];
    uint bit = 1u << (slice & 31u);
    place = word.y + uint(bitCount(word.x & (bit - 1u)));
    return (word.x & bit) != 0u && place < uint(cells.length());
}

// A colour of its own for the cell of a surface; white where none holds it.
vec3 cell_color(uvec2 pixel, float distance_m) {
    uint place;
    if (!cell_of(pixel, distance_m, place)) {
        return vec3(1.0);
    }
    uint bits = (cells[place].number + 1u) * 2654435761u;   // a multiplicative hash: 2^32 over the golden ratio
    bits ^= bits >> 15;
    return vec3(bits & 255u, bits >> 8 & 255u, bits >> 16 & 255u) / 320.0;
}

// Radiance of the lights with an end that reach a surface of a pixel at a view distance. A surface may be
// shaded at a place where no sample shows it; if no cell was made there, it asks the tree over the lights.
vec3 cell_radiance(ShadingPoint p, uvec2 pixel, float distance_m) {
    uint place;
    if (!cell_of(pixel, distance_m, place)) {
        return tree_radiance(p);
    }
    vec3 radiance = vec3(0.0);
    uvec2 list = list_ends[place];
    for (uint i = list.x; i < list.y; ++i) {
        radiance += light_radiance(p, cell_lists[i]);
    }
    return radiance;
}

#endif
