// Rasterises small triangles, a thread each, and lists the others. Eight groups share a draw of at most 1,024 triangles.
//
// In: the scene, draw commands. Out: SampleKeys; LargeTriangles: place in the order of draws. Dispatch: draws of a bucket
// x 8. ALPHA_MASK tests alpha where a material has a cutoff.
#version 460
#extension GL_GOOGLE_include_directive : require
// Exact for small triangles.
#define EDGE int
#include "surfaces/compute_raster/raster.glsl"

layout(local_size_x = 128) in;
layout(set = 0, binding = 10, scalar) readonly buffer DrawCounts {
    uint draw_counts[];     // a bucket
};
layout(set = 0, binding = 11, scalar) writeonly buffer LargeTriangles {
    uint large_triangles[];
};
#define QUEUE_ACCESS
#include "surfaces/compute_raster/queue_counts.glsl"
layout(push_constant, scalar) uniform Push {
    uint bucket;
    uint first_command;     // of the bucket
    uint first_draw;        // of those in view
};

// Largest side of a small triangle's bounding box, pixels. For larger ones a loop in a single thread costs more than handing the triangle
// to a group. 32-bit edge functions are exact up to 64 pixels.
layout(constant_id = 11) const uint SMALL_PX = 16u;

void rasterize_small(ScreenTriangle t, ivec2 first, ivec2 last, uint order, RasterDraw d) {
    ivec2 d0 = t.p1 - t.p0, d1 = t.p2 - t.p1, d2 = t.p0 - t.p2;
    ivec3 least = ivec3(edge_least(t.p0, t.p1), edge_least(t.p1, t.p2), edge_least(t.p2, t.p0));
    for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
            ivec2 corner = ivec2(x, y) * SUBPIXELS;
            ivec2 q0 = corner - t.p0, q1 = corner - t.p1, q2 = corner - t.p2;
            ivec3 edge = ivec3(d0.x * q0.y - d0.y * q0.x, d1.x * q1.y - d1.y * q1.x, d2.x * q2.y - d2.y * q2.x);
            // The most that each edge function grows within a pixel.
            ivec3 gain = SUBPIXELS * (max(ivec3(d0.x, d1.x, d2.x), 0) + max(-ivec3(d0.y, d1.y, d2.y), 0));
            if (any(lessThan(edge + gain, least))) {
                continue;
            }
            uint covered = 0u;
            for (uint i = 0u; i < SAMPLES; ++i) {
                ivec2 s = sample_steps(i);
                ivec3 at = edge + STEP * ivec3(edge_change(d0, s), edge_change(d1, s), edge_change(d2, s));
                covered |= all(greaterThanEqual(at, least)) ? 1u << i : 0u;
            }
            if (covered != 0u) {
                keep_nearest(ivec2(x, y), covered, t, DepthEdges(edge.z, edge.x, d2, d0), order, d);
            }
        }
    }
}

// Whether a triangle that leaves the guard band lies beyond one side of the view. A hundredth is left beside the image, so that snapping
// moves none that this leaves out onto a sample.
bool misses_view(vec4 c0, vec4 c1, vec4 c2) {
    vec3 x = vec3(c0.x, c1.x, c2.x), y = vec3(c0.y, c1.y, c2.y), z = vec3(c0.z, c1.z, c2.z), w = vec3(c0.w, c1.w, c2.w);
    vec3 side = 1.01 * w;
    return all(greaterThan(x, side)) || all(greaterThan(-x, side)) || all(greaterThan(y, side)) || all(greaterThan(-y, side))
        || all(greaterThan(z, w)) || all(lessThan(z, vec3(0.0)));
}

void main() {
    uint place = first_draw + gl_WorkGroupID.x;
    if (place >= draw_counts[bucket]) {
        return;
    }
    uint command = first_command + place;
    RasterDraw d = load_raster_draw(command);
    uint triangles = draw_commands[command * 5u] / 3u;
    uint triangle = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    if (triangle >= triangles) {
        return;
    }
    vec4 c0, c1, c2;
    vertices_clip(d.data, triangle_vertices(triangle, d.data), c0, c1, c2);
    bool is_large = !(is_within(c0) && is_within(c1) && is_within(c2));
    ScreenTriangle t;
    ivec2 first, last;
    if (is_large) {
        if (misses_view(c0, c1, c2)) {
            return;
        }
    } else {
        if (!screen_triangle(d, c0, c1, c2, t)) {
            return;
        }
        pixel_box(t, first, last);
        if (any(greaterThan(first, last))) {
            return;
        }
        ivec2 size = (max(t.p0, max(t.p1, t.p2)) - min(t.p0, min(t.p1, t.p2))) >> 8;
        is_large = max(size.x, size.y) >= int(SMALL_PX);
    }
    uint order = command << TRIANGLE_BITS | triangle;
    if (!is_large) {
        rasterize_small(t, first, last, order, d);
    } else {
        uint slot = atomicAdd(large_needed, 1u);
        if (slot < uint(large_triangles.length())) {
            large_triangles[slot] = order;
        } else {
            atomicAdd(large_dropped, 1u);
        }
    }
}
