// Irradiance at a lower rate than a pixel (Schied and Dachsbacher 2015, section 4.4): neighbouring pixels that show the same
// triangle share one shading sample. A group finds, evaluates and reads its shading samples in shared memory: the paper's
// visibility buffer of shading samples, their records and a pass of their own are not needed, since the visibility buffer is finished
// and all that can share a sample stand in one group.
//
// What is shared is the irradiance, not the radiance: the material stays at full rate.
//
// Two ways to find what shares a sample:
//   LOW_RATE_QUADS  rate 1/2: the four threads of a quad ask each other. Where one triangle fills all four pixels, they gather a quarter
//                   each, for the mean of their places and normals; else each pixel gathers for itself. Nothing is stored.
//   else            the shading grid (Ragan-Kelley et al. 2011) with a memoization table: a sample for each triangle of a cell of
//                   CELL_PX x CELL_PX pixels, at the mean of the pixels that show it. Where all do that is the cell's centre; where
//                   few do it is still among them, so that nothing is extrapolated off the triangle. Results are LogLuv.
//
// Both give the same image whatever order threads run in. Needs a source of triangles and shading.glsl.
#ifndef AFTERLIGHT_LOW_RATE
#define AFTERLIGHT_LOW_RATE

#ifdef LOW_RATE_QUADS
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_quad : require

uint quad_name;         // the triangle that fills the pixel; NO_TRIANGLE where none does

// Four threads in a row have four pixels that stand together.
ivec2 invocation_pixel() {
    uint quad = gl_LocalInvocationIndex / 4u, quads_a_row = gl_WorkGroupSize.x / 2u;
    uvec2 corner = uvec2(quad % quads_a_row, quad / quads_a_row) * 2u;
    uvec2 in_quad = uvec2(gl_LocalInvocationIndex & 1u, gl_LocalInvocationIndex >> 1 & 1u);
    return ivec2(gl_WorkGroupID.xy * gl_WorkGroupSize.xy + corner + in_quad);
}

vec3 quad_sum(vec3 v) {
    v += subgroupQuadSwapHorizontal(v);
    return v + subgroupQuadSwapVertical(v);
}

// Keeps the triangle that a pixel has come to, for low_rate_share.
void low_rate_next(ivec2 pixel, uint name, uint weight) {
    bool quad_inside = all(lessThan(uvec2(pixel | 1), frame.size_px));
    quad_name = weight == SAMPLES && quad_inside ? name : NO_TRIANGLE;
}

// Whether one triangle fills the four pixels of the quad, which then share a sample. A triangle that fills its pixel is the pixel's first
// and last, so that where it fills four all four come here with it at once. Vulkan does not say which threads make a quad of a compute
// shader: where they are not four in a row, nothing is shared.
bool quad_is_whole(bool found) {
    uint mine = found ? quad_name : NO_TRIANGLE, thread = gl_LocalInvocationIndex;
    uint beside = subgroupQuadSwapHorizontal(mine), below = subgroupQuadSwapVertical(mine);
    bool in_order = subgroupQuadSwapHorizontal(thread) == (thread ^ 1u) && subgroupQuadSwapVertical(thread) == (thread ^ 2u);
    uint same = uint(in_order && mine != NO_TRIANGLE && mine == beside && mine == below);
    uint same_beside = subgroupQuadSwapHorizontal(same);
    return (same & same_beside) != 0u;
}

// Finds the irradiance of the surface that each thread has come to; those without one only keep the others company. Every thread of the
// subgroup calls it, so that no thread asks one that is not here. Threads of whole quads gather a quarter, others all: one loop, so that a
// subgroup of both takes no longer than the others alone.
void low_rate_share(bool found, Surface s) {
    bool whole = quad_is_whole(found);
    vec3 positions_ws = quad_sum(found ? s.position_ws : vec3(0.0)), normals_ws = quad_sum(found ? s.normal_ws : vec3(0.0));
    uint first = 0u, end = found ? INDIRECT_SAMPLES : 0u;
    if (whole) {
        s.position_ws = 0.25 * positions_ws;
        s.normal_ws = unit_or_zero(normals_ws);
        uint quarter = INDIRECT_SAMPLES / 4u;
        first = (gl_SubgroupInvocationID & 3u) * quarter;
        end = first + quarter;
    }
    vec3 mine = found ? gathered_irradiance(s, first, end) : vec3(0.0);
    vec3 of_quad = quad_sum(mine);
    low_rate_irradiance = whole ? of_quad : mine;
}

// Nothing is found before.
void low_rate_fill(ivec2 pixel, bool inside) {}

#else
#include "logluv.glsl"

// Width of a cell, pixels: 1, 2, 4 or 8.
layout(constant_id = 12) const uint CELL_PX = 2u;

const uint TILE_PX = gl_WorkGroupSize.x;
const uint GROUP_THREADS = TILE_PX * TILE_PX;

// Triangles that can show in a tile, cell by cell: the table cannot overflow.
const uint SLOTS = TILE_PX * TILE_PX * SAMPLES;
const uint SLOTS_A_CELL = SLOTS / (TILE_PX / CELL_PX * (TILE_PX / CELL_PX));

shared uint grid_names[SLOTS];
// First the pixels that show the triangle, x and y in the cell summed, 10 bits each, and their number; then the irradiance.
shared uint grid_values[SLOTS];
shared uint grid_used[SLOTS];       // slots that hold a triangle, in any order
shared uint grid_used_count;
shared vec3 grid_parts[GROUP_THREADS];

ivec2 invocation_pixel() {
    return ivec2(gl_GlobalInvocationID.xy);
}

uint cell_first_slot(ivec2 pixel) {
    uvec2 cell = (uvec2(pixel) % TILE_PX) / CELL_PX;
    return (cell.y * (TILE_PX / CELL_PX) + cell.x) * SLOTS_A_CELL;
}

uint first_probe(uint name) {
    return (name * 2654435761u >> 16) % SLOTS_A_CELL;
}

// The triangle's slot in a cell, taken where it is new.
uint memoized_slot(uint first, uint name) {
    uint probe = first_probe(name);
    for (;;) {
        uint found = atomicCompSwap(grid_names[first + probe], NO_TRIANGLE, name);
        if (found == NO_TRIANGLE) {
            grid_used[atomicAdd(grid_used_count, 1u)] = first + probe;
        }
        if (found == NO_TRIANGLE || found == name) {
            return first + probe;
        }
        probe = (probe + 1u) % SLOTS_A_CELL;
    }
}

void add_shading_samples(ivec2 pixel) {
    uint first = cell_first_slot(pixel);
    uvec2 in_cell = uvec2(pixel) % CELL_PX;
    uint name, weight;
    source_begin(pixel);
    while (source_next_triangle(name, weight)) {
        atomicAdd(grid_values[memoized_slot(first, name)], in_cell.x | in_cell.y << 10 | 1u << 20);
    }
}

// What of a surface irradiance needs. `pixel` is a place in pixels, whole at pixel centres; normal maps are read as wide as the
// pixels that share the sample.
Surface receiver(uint place, vec2 pixel, float width_px) {
    uint material;
    SurfacePoint p = interpolated_point(place, pixel, material);
    p.uv0.ddx *= width_px;
    p.uv0.ddy *= width_px;
    p.uv1.ddx *= width_px;
    p.uv1.ddy *= width_px;
    Surface s;
    s.position_ws = p.position_ws;
    s.normal_ws = mapped_normal(load_material(material), p);
    return s;
}

// Part of the irradiance of a slot's triangle, where the pixels that show it stand in the mean.
vec3 slot_irradiance(uint slot, uint first_sample, uint end_sample) {
    uint cells_a_row = TILE_PX / CELL_PX, cell = slot / SLOTS_A_CELL, sums = grid_values[slot];
    uvec2 cell_px = gl_WorkGroupID.xy * TILE_PX + uvec2(cell % cells_a_row, cell / cells_a_row) * CELL_PX;
    float count = float(sums >> 20);
    vec2 mean = vec2(sums & 0x3ffu, sums >> 10 & 0x3ffu) / count;
    // As wide as the pixels that share it.
    Surface s = receiver(source_place(grid_names[slot]), vec2(cell_px) + mean, sqrt(count));
    return gathered_irradiance(s, first_sample, end_sample);
}

// Finds and evaluates the shading samples of the group's tile. Every thread calls it once.
void low_rate_fill(ivec2 pixel, bool inside) {
    uint thread = gl_LocalInvocationIndex;
    for (uint slot = thread; slot < SLOTS; slot += GROUP_THREADS) {
        grid_names[slot] = NO_TRIANGLE;
        grid_values[slot] = 0u;
    }
    if (thread == 0u) {
        grid_used_count = 0u;
    }
    barrier();
    if (inside) {
        add_shading_samples(pixel);
    }
    barrier();
    // A few samples at once and at least four threads each: a tile has about as many as it has cells.
    uint used = grid_used_count, at_once = 4u;
    while (at_once < used && at_once < GROUP_THREADS / 4u) {
        at_once *= 2u;
    }
    uint parts = GROUP_THREADS / at_once;
    uint part = thread / at_once, share = INDIRECT_SAMPLES / parts;
    for (uint first = 0u; first < used; first += at_once) {
        uint mine = first + thread % at_once;
        uint slot = mine < used ? grid_used[mine] : 0u;
        grid_parts[thread] = mine < used ? slot_irradiance(slot, part * share, (part + 1u) * share) : vec3(0.0);
        barrier();
        if (part == 0u && mine < used) {
            vec3 sum = vec3(0.0);
            for (uint i = 0u; i < parts; ++i) {
                sum += grid_parts[i * at_once + thread];
            }
            grid_values[slot] = logluv_encode(sum);
        }
        barrier();
    }
}

// Finds the irradiance of the triangle that a pixel has come to.
void low_rate_next(ivec2 pixel, uint name, uint weight) {
    uint first = cell_first_slot(pixel), probe = first_probe(name);
    while (grid_names[first + probe] != name) {
        probe = (probe + 1u) % SLOTS_A_CELL;
    }
    low_rate_irradiance = logluv_decode(grid_values[first + probe]);
}
#endif

#endif
