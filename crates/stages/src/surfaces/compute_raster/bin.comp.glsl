// Cuts large triangles into jobs: a triangle and a tile of 32x32 pixels that it touches. A group takes a triangle at a time.
//
// In: LargeTriangles, LargeCount. Out: TileJobs, JobCount. Dispatch: any number of groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "surfaces/compute_raster/raster.glsl"
#include "surfaces/compute_raster/tile_jobs.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 10, scalar) readonly buffer LargeTriangles {
    uint large_triangles[];
};
layout(set = 0, binding = 11, scalar) readonly buffer LargeCount {
    uint large_needed;
    uint large_dropped;
};
layout(set = 0, binding = 12, scalar) writeonly buffer TileJobs {
    uvec2 tile_jobs[];
};
layout(set = 0, binding = 14, scalar) buffer JobCount {
    uint jobs_needed;
    uint jobs_dropped;
};
layout(constant_id = 10) const uint LARGE_CAPACITY = 0u;
layout(constant_id = 11) const uint JOB_CAPACITY = 0u;

void main() {
    uint count = min(large_needed, LARGE_CAPACITY);
    for (uint place = gl_WorkGroupID.x; place < count; place += gl_NumWorkGroups.x) {
        uint order = large_triangles[place];
        RasterDraw d = load_raster_draw(order >> TRIANGLE_BITS);
        vec4 c0, c1, c2;
        uint triangle = order & ((1u << TRIANGLE_BITS) - 1u);
        vertices_clip(d.data, triangle_vertices(triangle, d.data), c0, c1, c2);
        for (uint part = 0u; part < 2u; ++part) {
            ScreenTriangle t;
            if (!screen_triangle(d, c0, c1, c2, part, t)) {
                continue;
            }
            ivec2 first, last;
            pixel_box(t, first, last);
            ivec2 tiles = max((last / TILE_PX) - (first / TILE_PX) + 1, ivec2(0));
            if (any(greaterThan(first, last))) {
                tiles = ivec2(0);
            }
            for (int i = int(gl_LocalInvocationID.x); i < tiles.x * tiles.y; i += int(gl_WorkGroupSize.x)) {
                ivec2 tile = first / TILE_PX + ivec2(i % tiles.x, i / tiles.x);
                if (!box_may_touch(t, tile * TILE_PX, TILE_PX)) {
                    continue;
                }
                uint slot = atomicAdd(jobs_needed, 1u);
                if (slot < JOB_CAPACITY) {
                    tile_jobs[slot] = uvec2(order, part << 31 | uint(tile.y) << 16 | uint(tile.x));
                } else {
                    atomicAdd(jobs_dropped, 1u);
                }
            }
        }
    }
}
