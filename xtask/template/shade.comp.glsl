// Shades what the source holds, a thread a pixel, by the lights of each surface's cluster.
// Out: hdr, RGBA16F, radiance. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 8, local_size_y = 8) in;
#define READS_SURFACES
#include "technique_folder/source.glsl"
#include "light_step/radiance.glsl"

layout(set = 0, binding = 14, rgba16f) writeonly uniform image2D hdr;

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.size_px))) {
        return;
    }
    vec3 radiance = frame.background_radiance;
    Surface s;
    uint weight;
    source_begin(ivec2(pixel));
    if (source_next(s, weight)) {
        radiance = stepped_radiance(s, pixel);
    }
    imageStore(hdr, ivec2(pixel), vec4(radiance, 1.0));
}
