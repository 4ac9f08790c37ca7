// Finds the cells that hold a surface: a group a tile, in rows that the device takes; the last row may have groups without a tile.
//
// In: what the source reads. Out: Cells; CellWords: bits of the slices, number of cells before
// them; CellCount: cells in all, and those without room. Numbers of cells depend on the order in which groups run; lists do not.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "group_rows.glsl"
#include "lights/cells/grid.glsl"
#include "source"

layout(local_size_x = 256) in;
layout(set = 0, binding = 48, scalar) writeonly buffer Cells {
    Cell cells[];
};
layout(set = 0, binding = 49, scalar) writeonly buffer CellWords {
    uvec2 cell_words[];
};
layout(set = 0, binding = 50, scalar) buffer CellCount {
    uint cells_needed;
    uint cells_dropped;
};

// Capacities are read from the buffers' lengths and are not specialization constants: a frame that is recorded again with more room keeps
// its pipelines.
uint cell_capacity() {
    return uint(cells.length());
}

const uint MOST_WORDS = 8u;
shared uint tile_bits[MOST_WORDS];
shared uint tile_before[MOST_WORDS + 1u];
shared uint tile_nearest;   // bits of non-negative floats order as unsigned integers
shared uint tile_farthest;

void mark(uint bit) {
    uint word = bit >> 5, mask = 1u << (bit & 31u);
    // If this plain read is out of date, an atomic is done that was not needed; no bit is ever lost.
    if ((tile_bits[word] & mask) == 0u) {
        atomicOr(tile_bits[word], mask);
    }
}

void include_distance(float distance_m) {
    if (DIVISION == CLUSTERS) {
        mark(slice_of(distance_m));
    } else {
        atomicMin(tile_nearest, floatBitsToUint(max(distance_m, 0.0)));
        atomicMax(tile_farthest, floatBitsToUint(max(distance_m, 0.0)));
    }
}

// View distances between which the tile's surfaces lie, widened a little for rounding.
vec2 tile_range_m() {
    return vec2(uintBitsToFloat(tile_nearest) * (1.0 - DISTANCE_SLACK),
                uintBitsToFloat(tile_farthest) * (1.0 + DISTANCE_SLACK));
}

void mark_step(float distance_m) {
    vec2 range_m = tile_range_m();
    mark(step_of(distance_m, range_m.x, range_m.y));
}

bool by_step;   // whether visit_surfaces marks steps (else it finds the range of distances)

void visit_distance(float distance_m) {
    if (by_step) {
        mark_step(distance_m);
    } else {
        include_distance(distance_m);
    }
}

// Visits all surfaces of the tile: their distances, or the steps that hold them.
void visit_surfaces(uint tile) {
    uvec2 first = uvec2(tile % tiles_across(), tile / tiles_across()) * LIGHT_TILE_PX;
    uvec2 size = min(first + LIGHT_TILE_PX, frame.size_px) - first;
    for (uint i = gl_LocalInvocationIndex; i < size.x * size.y; i += 256u) {
        visit_pixel(ivec2(first + uvec2(i % size.x, i / size.x)));
    }
}

Cell tile_cell(uint tile) {
    vec2 range_m = tile_range_m();
    return Cell(tile, range_m.x, range_m.y, DIVISION == TILES_25D ? tile_bits[0] : 0xffffffffu);
}

Cell cluster_cell(uint tile, uint slice) {
    return Cell(tile * SLICES + slice, slice_begin_m(slice) * (1.0 - DISTANCE_SLACK),
                slice_begin_m(slice + 1u) * (1.0 + DISTANCE_SLACK), 0xffffffffu);
}

// Number of the tile's cells before each of its words, and the place of the tile's first cell among all cells.
void place_cells(uint tile) {
    uint count = 0u;
    for (uint w = 0u; w < WORDS; ++w) {
        tile_before[w] = count;
        count += uint(bitCount(tile_bits[w]));
    }
    if (DIVISION != CLUSTERS) {
        count = tile_nearest <= tile_farthest ? 1u : 0u;
    }
    uint first = count > 0u ? atomicAdd(cells_needed, count) : 0u;
    uint end = first + count;
    if (end > cell_capacity()) {
        atomicAdd(cells_dropped, end - max(first, cell_capacity()));
    }
    for (uint w = 0u; w < WORDS; ++w) {
        tile_before[w] += first;
    }
    tile_before[MOST_WORDS] = count;
}

void write_cell(uint place, Cell cell) {
    if (place < cell_capacity()) {
        cells[place] = cell;
    }
}

void main() {
    uint tile = group_number(), thread = gl_LocalInvocationIndex;
    if (tile >= tile_count()) {
        return;
    }
    if (thread < MOST_WORDS) {
        tile_bits[thread] = 0u;
    }
    if (thread == 0u) {
        tile_nearest = 0x7f7fffffu;
        tile_farthest = 0u;
    }
    barrier();
    by_step = false;
    visit_surfaces(tile);
    barrier();
    if (DIVISION == TILES_25D) {
        by_step = true;
        visit_surfaces(tile);
        barrier();
    }
    if (thread == 0u) {
        place_cells(tile);
    }
    barrier();
    if (thread < WORDS) {
        uint bits = DIVISION == CLUSTERS ? tile_bits[thread] : tile_before[MOST_WORDS];
        cell_words[tile * WORDS + thread] = uvec2(bits, tile_before[thread]);
    }
    if (DIVISION != CLUSTERS) {
        if (thread == 0u && tile_before[MOST_WORDS] > 0u) {
            write_cell(tile_before[0], tile_cell(tile));
        }
        return;
    }
    uint word = thread >> 5, bit = 1u << (thread & 31u);
    if (word < WORDS && (tile_bits[word] & bit) != 0u) {
        write_cell(tile_before[word] + uint(bitCount(tile_bits[word] & (bit - 1u))), cluster_cell(tile, thread));
    }
}
