// How the view is divided into cells that have a list of lights each.
//
//   CLUSTERS  tiles, each cut into SLICES between the nearest and the farthest view distance that the scene can show
//             (Olsson et al. 2012, section 3.1)
//   TILES     tiles, from the nearest to the farthest surface in each (Olsson and Assarsson 2011)
//   TILES_25D the same, and 32 bits that tell which of 32 equal steps between them hold a surface (Harada 2012)
//
// Tiles are LIGHT_TILE_PX pixels wide and high, by rows. A tile has WORDS words of bits, a bit a slice; those without slices have one.
//
// CPU twin: crates/oracle/src/clusters.rs.
#ifndef AFTERLIGHT_CLUSTER_GRID
#define AFTERLIGHT_CLUSTER_GRID
#include "frame.glsl"

const uint CLUSTERS = 0u;
const uint TILES = 1u;
const uint TILES_25D = 2u;

layout(constant_id = 40) const uint DIVISION = CLUSTERS;
layout(constant_id = 41) const uint LIGHT_TILE_PX = 32u;
layout(constant_id = 42) const uint SLICES = 32u;
layout(constant_id = 43) const uint LOGARITHMIC = 1u;

const uint WORDS = DIVISION == CLUSTERS ? (SLICES + 31u) / 32u : 1u;

// Relative error that rounding may cause in a view distance. Ends of cells are moved outwards by it.
const float DISTANCE_SLACK = 2e-4;

// A cell that holds a surface.
struct Cell {
    uint number;        // tile x SLICES + slice; the tile where there are no slices
    float nearest_m;    // view distances between which its surfaces lie
    float farthest_m;
    uint steps;         // TILES_25D: the 32 steps between them that hold a surface
};

uint tiles_across() {
    return (frame.size_px.x + LIGHT_TILE_PX - 1u) / LIGHT_TILE_PX;
}

// Tiles of the image.
uint tile_count() {
    return tiles_across() * ((frame.size_px.y + LIGHT_TILE_PX - 1u) / LIGHT_TILE_PX);
}

uint tile_of(uvec2 pixel) {
    uvec2 tile = pixel / LIGHT_TILE_PX;
    return tile.y * tiles_across() + tile.x;
}

// The slice that a view distance lies in, which must be a number; slices have equal ratios or equal steps. Distances outside of all slices
// belong to the first or the last.
uint slice_of(float distance_m) {
    float nearest_m = frame.distance_range_m.x, farthest_m = frame.distance_range_m.y;
    float share = LOGARITHMIC != 0u ? log2(distance_m / nearest_m) / log2(farthest_m / nearest_m)
                                    : (distance_m - nearest_m) / (farthest_m - nearest_m);
    return uint(clamp(share * float(SLICES), 0.0, float(SLICES - 1u)));
}

// View distance at which a slice begins.
float slice_begin_m(uint slice) {
    float nearest_m = frame.distance_range_m.x, farthest_m = frame.distance_range_m.y;
    float share = float(slice) / float(SLICES);
    return LOGARITHMIC != 0u ? nearest_m * pow(farthest_m / nearest_m, share) : mix(nearest_m, farthest_m, share);
}

// The step of a view distance between two ends, 0 to 31.
uint step_of(float distance_m, float nearest_m, float farthest_m) {
    return uint(clamp((distance_m - nearest_m) / (farthest_m - nearest_m) * 32.0, 0.0, 31.0));
}

#endif
