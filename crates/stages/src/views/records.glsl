// The triangle records that a pixel's samples refer to, whatever holds them. A technique names the header that is included as "source" in
// its variants.txt: source_begin(pixel), then source_next_triangle(name, weight) until it is false, and source_place(name), as in
// surfaces/triangles/surface.glsl.
#ifndef AFTERLIGHT_VIEW_RECORDS
#define AFTERLIGHT_VIEW_RECORDS
#include "frame.glsl"
#include "material.glsl"
#include "sample_depth.glsl"

#include "source"

layout(local_size_x = 8, local_size_y = 8) in;

bool in_image() {
    return all(lessThan(gl_GlobalInvocationID.xy, frame.size_px));
}

#endif
