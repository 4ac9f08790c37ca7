// Rasterises the tiles of large triangles: a group takes a job at a time, 8x8 pixels of it at once.
//
// In: TileJobs, JobCount. Out: SampleKeys. Dispatch: any number of groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "surfaces/compute_raster/raster.glsl"
#include "surfaces/compute_raster/tile_jobs.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 10, scalar) readonly buffer TileJobs {
    uvec2 tile_jobs[];
};
layout(set = 0, binding = 11, scalar) readonly buffer JobCount {
    uint jobs_needed;
    uint jobs_dropped;
};
layout(constant_id = 11) const uint JOB_CAPACITY = 0u;

const int BLOCK_PX = 8;

void main() {
    uint count = min(jobs_needed, JOB_CAPACITY);
    for (uint place = gl_WorkGroupID.x; place < count; place += gl_NumWorkGroups.x) {
        uvec2 job = tile_jobs[place];
        uint order = job.x;
        RasterDraw d = load_raster_draw(order >> TRIANGLE_BITS);
        vec4 c0, c1, c2;
        vertices_clip(d.data, triangle_vertices(order & ((1u << TRIANGLE_BITS) - 1u), d.data), c0, c1, c2);
        ScreenTriangle t;
        if (!screen_triangle(d, c0, c1, c2, job.y >> 31, t)) {
            continue;
        }
        DepthPlane plane = depth_plane(t);
        Edge e0 = edge_between(t.p0, t.p1), e1 = edge_between(t.p1, t.p2), e2 = edge_between(t.p2, t.p0);
        ivec2 tile = ivec2(job.y & 0xffffu, job.y >> 16 & 0x7fffu) * TILE_PX;
        for (int block = 0; block < (TILE_PX / BLOCK_PX) * (TILE_PX / BLOCK_PX); ++block) {
            ivec2 corner = tile + BLOCK_PX * ivec2(block % (TILE_PX / BLOCK_PX), block / (TILE_PX / BLOCK_PX));
            ivec2 pixel = corner + ivec2(gl_LocalInvocationID.xy);
            if (!edge_may_touch(e0, corner, BLOCK_PX) || !edge_may_touch(e1, corner, BLOCK_PX)
                || !edge_may_touch(e2, corner, BLOCK_PX) || any(greaterThanEqual(pixel, ivec2(frame.size_px)))) {
                continue;
            }
            int64_t a0 = edge_at(e0, pixel * SUBPIXELS), a1 = edge_at(e1, pixel * SUBPIXELS),
                    a2 = edge_at(e2, pixel * SUBPIXELS);
            uint covered = 0u;
            for (uint i = 0u; i < SAMPLES; ++i) {
                ivec2 s = ivec2(sample_location(i) * float(SUBPIXELS));
                bool inside = a0 + int64_t(e0.d.x) * s.y - int64_t(e0.d.y) * s.x >= 0L
                    && a1 + int64_t(e1.d.x) * s.y - int64_t(e1.d.y) * s.x >= 0L
                    && a2 + int64_t(e2.d.x) * s.y - int64_t(e2.d.y) * s.x >= 0L;
                covered |= inside ? 1u << i : 0u;
            }
            if (covered != 0u) {
                keep_nearest(pixel, covered, t, plane, order, d);
            }
        }
    }
}
