// Marks the triangles that show in any sample: a thread a pixel.
//
// In: ids, RGBA8 as 32 bits, or the keys of compute_raster. Out: MarkedBits, a bit a triangle of the scene. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#define IDS_BINDING 8
#include "surfaces/visible/triangles.glsl"
#include "surfaces/triangles/marks.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, frame.size_px))) {
        return;
    }
    uint before = NO_TRIANGLE;
    for (uint i = 0u; i < SAMPLES; ++i) {
        uint id = sample_triangle(pixel, i);
        if (id == before || id == NO_TRIANGLE) {
            continue;
        }
        before = id;
        mark_triangle(id);
    }
}
