// Cuts large triangles into jobs: a triangle and a tile of 32x32 pixels that it touches. A group takes a triangle at a time. Those that
// leave the guard band or cross the near plane are clipped here, and their parts kept: whoever takes a job fetches the part.
//
// In: LargeTriangles, QueueCounts. Out: TileJobs, ClippedTriangles, QueueCounts. Dispatch: any number of groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "surfaces/compute_raster/raster.glsl"
#include "surfaces/compute_raster/tile_jobs.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 10, scalar) readonly buffer LargeTriangles {
    uint large_triangles[];
};
#define QUEUE_ACCESS
#include "surfaces/compute_raster/queue_counts.glsl"
layout(set = 0, binding = 12, scalar) writeonly buffer TileJobs {
    uvec2 tile_jobs[];
};
layout(set = 0, binding = 15, scalar) writeonly buffer ClippedTriangles {
    ClippedTriangle clipped_triangles[];
};
// Lists have room for what their buffers hold: a list that grows makes no pipeline anew.

// A clipped triangle's corners: three, and one more for each plane. Rounding may bend a polygon by a little, so there is room to spare.
const uint MOST_CORNERS = 12u;
const uint PLANES = 5u;
shared vec4 corners[2][MOST_CORNERS];
shared uint corner_count;
shared uint part_slot;

// Positive on the inner side of the near plane (0) and of the guard band's sides.
float inside_of(uint plane, vec4 clip) {
    if (plane == 0u) {
        return clip.w - clip.z;
    }
    bool is_x = plane < 3u;
    float at = is_x ? clip.x : clip.y;
    float side = 2.0 * GUARD_BAND_PX / float(is_x ? frame.size_px.x : frame.size_px.y) * clip.w;
    return side + ((plane & 1u) != 0u ? at : -at);
}

// Where an edge meets a plane: the same from both of its ends, and so in both triangles that have the edge.
vec4 crossing(uint plane, vec4 inside, vec4 outside) {
    float a = inside_of(plane, inside), b = -inside_of(plane, outside);
    vec4 c = mix(inside, outside, a / (a + b));
    if (plane == 0u) {
        // On the near plane depth is 1. Of z and w the one that is the same in all of space has not lost digits.
        bool orthographic = frame.eye_ws.w == 0.0;
        c.zw = orthographic ? c.ww : c.zz;
    }
    return c;
}

// Clips a triangle plane after plane (Sutherland and Hodgman 1974) into corners[PLANES & 1].
void clip_triangle(vec4 c0, vec4 c1, vec4 c2) {
    corners[0][0] = c0;
    corners[0][1] = c1;
    corners[0][2] = c2;
    uint count = 3u;
    for (uint plane = 0u; plane < PLANES; ++plane) {
        uint from = plane & 1u, kept = 0u;
        for (uint i = 0u; i < count; ++i) {
            vec4 a = corners[from][i], b = corners[from][i + 1u < count ? i + 1u : 0u];
            bool a_inside = inside_of(plane, a) >= 0.0, b_inside = inside_of(plane, b) >= 0.0;
            if (a_inside && kept < MOST_CORNERS) {
                corners[1u - from][kept++] = a;
            }
            if (a_inside != b_inside && kept < MOST_CORNERS) {
                corners[1u - from][kept++] = a_inside ? crossing(plane, a, b) : crossing(plane, b, a);
            }
        }
        count = kept;
    }
    corner_count = count;
}

// Lists the tiles that a triangle touches.
void list_tiles(ScreenTriangle t, uint job, uint is_clipped) {
    ivec2 first, last;
    pixel_box(t, first, last);
    if (any(greaterThan(first, last))) {
        return;
    }
    ivec2 tiles = (last / TILE_PX) - (first / TILE_PX) + 1;
    for (int i = int(gl_LocalInvocationID.x); i < tiles.x * tiles.y; i += int(gl_WorkGroupSize.x)) {
        ivec2 tile = first / TILE_PX + ivec2(i % tiles.x, i / tiles.x);
        if (!box_may_touch(t, tile * TILE_PX, TILE_PX)) {
            continue;
        }
        uint slot = atomicAdd(jobs_needed, 1u);
        if (slot < uint(tile_jobs.length())) {
            tile_jobs[slot] = uvec2(job, is_clipped | uint(tile.y) << 16 | uint(tile.x));
        } else {
            atomicAdd(jobs_dropped, 1u);
        }
    }
}

// Keeps a part of a clipped triangle and lists its tiles.
void list_part(ScreenTriangle t, uint order) {
    if (gl_LocalInvocationIndex == 0u) {
        part_slot = atomicAdd(clipped_needed, 1u);
        if (part_slot < uint(clipped_triangles.length())) {
            clipped_triangles[part_slot] = ClippedTriangle(t, order);
        } else {
            atomicAdd(clipped_dropped, 1u);
        }
    }
    barrier();
    if (part_slot < uint(clipped_triangles.length())) {
        list_tiles(t, part_slot, CLIPPED_JOB);
    }
    barrier();
}

// Clips a triangle and lists the tiles of its parts: a fan around the first corner. Facing is that of the whole: snapping may turn a part
// over that has next to no area, and what that covered is covered by the others.
void list_clipped(RasterDraw d, vec4 c0, vec4 c1, vec4 c2, uint order) {
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        clip_triangle(c0, c1, c2);
    }
    barrier();
    const uint LAST = PLANES & 1u;
    uint count = corner_count;
    ivec2 p0 = snapped(corners[LAST][0]);
    int64_t whole = 0L;
    for (uint i = 1u; i + 1u < count; ++i) {
        whole += doubled_area(p0, snapped(corners[LAST][i]), snapped(corners[LAST][i + 1u]));
    }
    if (count < 3u || !shows(d, whole)) {
        return;
    }
    for (uint i = 1u; i + 1u < count; ++i) {
        vec4 first = corners[LAST][0], a = corners[LAST][i], b = corners[LAST][i + 1u];
        ivec2 p1 = snapped(a), p2 = snapped(b);
        int64_t area = doubled_area(p0, p1, p2);
        if (area != 0L && (area < 0L) == (whole < 0L)) {
            list_part(ordered_triangle(p0, p1, p2, vec3(first.z / first.w, a.z / a.w, b.z / b.w), area), order);
        }
    }
}

void main() {
    uint count = min(large_needed, uint(large_triangles.length()));
    for (uint place = gl_WorkGroupID.x; place < count; place += gl_NumWorkGroups.x) {
        uint order = large_triangles[place];
        RasterDraw d = load_raster_draw(order >> TRIANGLE_BITS);
        vec4 c0, c1, c2;
        vertices_clip(d.data, triangle_vertices(order & ((1u << TRIANGLE_BITS) - 1u), d.data), c0, c1, c2);
        if (!(is_within(c0) && is_within(c1) && is_within(c2))) {
            list_clipped(d, c0, c1, c2, order);
            continue;
        }
        ScreenTriangle t;
        if (screen_triangle(d, c0, c1, c2, t)) {
            list_tiles(t, order, 0u);
        }
    }
}
