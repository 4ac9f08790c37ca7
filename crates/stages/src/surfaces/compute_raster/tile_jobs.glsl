// Tiles that large triangles are cut into.
#ifndef AFTERLIGHT_TILE_JOBS
#define AFTERLIGHT_TILE_JOBS

// Each of 64 threads takes sixteen pixels. Smaller tiles would make more jobs, larger ones would leave threads idle at a triangle's edges.
const int TILE_PX = 32;
// Bit of a job's second word: the first is a place in ClippedTriangles, not in the order of draws.
const uint CLIPPED_JOB = 1u << 31;

// A part of a triangle that was clipped.
struct ClippedTriangle {
    ScreenTriangle triangle;
    uint order;     // place of the whole triangle in the order of draws
};

// An edge function over the image, 64 bits: exact for any triangle within the guard band.
struct Edge {
    int64_t at_origin;  // at the image's corner
    ivec2 d;
    int least;          // the least value that is inside
};

Edge edge_between(ivec2 a, ivec2 b) {
    ivec2 d = b - a;
    return Edge(int64_t(d.y) * int64_t(a.x) - int64_t(d.x) * int64_t(a.y), d, edge_least(a, b));
}

int64_t edge_at(Edge e, ivec2 subpixel) {
    return e.at_origin + int64_t(e.d.x) * int64_t(subpixel.y) - int64_t(e.d.y) * int64_t(subpixel.x);
}

// False if a box of size_px pixels lies completely outside of an edge.
bool edge_may_touch(Edge e, ivec2 pixel, int size_px) {
    int64_t gain = int64_t(size_px * SUBPIXELS) * int64_t(max(e.d.x, 0) + max(-e.d.y, 0));
    return edge_at(e, pixel * SUBPIXELS) + gain >= int64_t(e.least);
}

bool box_may_touch(ScreenTriangle t, ivec2 pixel, int size_px) {
    return edge_may_touch(edge_between(t.p0, t.p1), pixel, size_px)
        && edge_may_touch(edge_between(t.p1, t.p2), pixel, size_px)
        && edge_may_touch(edge_between(t.p2, t.p0), pixel, size_px);
}

#endif
