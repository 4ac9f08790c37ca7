// The triangle records that a pixel's samples refer to, whatever holds them: source_begin(pixel), then source_next_triangle(name,
// weight) until it is false, and source_place(name), as in triangle_buffer/surface.glsl.
#ifndef AFTERLIGHT_VIEW_RECORDS
#define AFTERLIGHT_VIEW_RECORDS
#include "frame.glsl"
#include "material.glsl"
#include "surfaces/visible/sample_depth.glsl"

#if defined(SOURCE_DAIS)
#include "dais/source_dais.glsl"
#else
#include "dais_list/source_dais_list.glsl"
#endif

layout(local_size_x = 8, local_size_y = 8) in;

bool in_image() {
    return all(lessThan(gl_GlobalInvocationID.xy, frame.size_px));
}

#endif
