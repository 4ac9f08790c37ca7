// Shades the visibility buffer: a thread fetches the triangle of its pixel, interpolates its attributes, evaluates the material and
// lights it (Burns and Hunt 2013; Petrescu et al. 2016, section 4.11).
//
// Departure: no sort of tiles by shader, since all materials share one.
// In: ids, R32_UINT, or the keys of compute_raster. Out: hdr, RGBA16F, radiance. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#define EXPLICIT_GRADIENTS
#include "lights/step/radiance.glsl"
#include "visibility/surface.glsl"

layout(set = 0, binding = 12, rgba16f) writeonly uniform image2D hdr;

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    if (any(greaterThanEqual(gl_GlobalInvocationID.xy, frame.size_px))) {
        return;
    }
    uvec2 pixel = gl_GlobalInvocationID.xy;
    Surface s;
    vec3 radiance = visible_surface(pixel, s) ? stepped_radiance(s, pixel) : frame.background_radiance;
    imageStore(hdr, ivec2(pixel), vec4(radiance, 1.0));
}
