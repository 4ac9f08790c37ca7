// Rasterises the tiles of large triangles: a group takes a job at a time, 8x8 pixels of it at once.
//
// In: TileJobs, QueueCounts, ClippedTriangles. Out: SampleKeys. Dispatch: any number of groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "surfaces/compute_raster/raster.glsl"
#include "surfaces/compute_raster/tile_jobs.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 10, scalar) readonly buffer TileJobs {
    uvec2 tile_jobs[];
};
#define QUEUE_ACCESS readonly
#include "surfaces/compute_raster/queue_counts.glsl"
layout(set = 0, binding = 15, scalar) readonly buffer ClippedTriangles {
    ClippedTriangle clipped_triangles[];
};

const int BLOCK_PX = 8;

// By how many whole STEPs an edge function may fall below its value here and still be inside: negative where it is not. No change between samples
// is 2^29 STEPs, so that the sum of the two, of which a sample needs only the sign, stays within 32 bits.
int steps_within(int64_t at, int least) {
    return int(clamp((at - int64_t(least)) >> 4, -int64_t(1 << 30), int64_t(1 << 30)));
}

void main() {
    uint count = min(jobs_needed, uint(tile_jobs.length()));
    for (uint place = gl_WorkGroupID.x; place < count; place += gl_NumWorkGroups.x) {
        uvec2 job = tile_jobs[place];
        bool is_clipped = (job.y & CLIPPED_JOB) != 0u;
        uint order = is_clipped ? clipped_triangles[job.x].order : job.x;
        RasterDraw d = load_raster_draw(order >> TRIANGLE_BITS);
        ScreenTriangle t;
        if (is_clipped) {
            t = clipped_triangles[job.x].triangle;
        } else {
            vec4 c0, c1, c2;
            vertices_clip(d.data, triangle_vertices(order & ((1u << TRIANGLE_BITS) - 1u), d.data), c0, c1, c2);
            if (!screen_triangle(d, c0, c1, c2, t)) {
                continue;
            }
        }
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
            ivec3 within = ivec3(steps_within(a0, e0.least), steps_within(a1, e1.least), steps_within(a2, e2.least));
            uint covered = 0u;
            for (uint i = 0u; i < SAMPLES; ++i) {
                ivec2 s = sample_steps(i);
                ivec3 change = ivec3(edge_change(e0.d, s), edge_change(e1.d, s), edge_change(e2.d, s));
                covered |= all(greaterThanEqual(within + change, ivec3(0))) ? 1u << i : 0u;
            }
            if (covered != 0u) {
                keep_nearest(pixel, covered, t, DepthEdges(a2, a0, e2.d, e0.d), order, d);
            }
        }
    }
}
