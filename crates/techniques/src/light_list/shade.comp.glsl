// Shades the G-buffer by every pixel's list of lights (Petrescu et al. 2016, section 4.7).
// In: the G-buffer, the lists; hdr: accumulation, read and written. A thread a pixel.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gbuffer.glsl"
#include "light_lists/lists.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 12, rgba16f) uniform image2D hdr;

void main() {
    uvec2 place = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(place, frame.size_px))) {
        return;
    }
    ivec2 pixel = ivec2(place);
    Surface s;
    if (gbuffer_load(pixel, texelFetch(gbuffer_depth, pixel, 0).r, s)) {
        vec3 radiance = listed_radiance(shading_point(s), place);
        imageStore(hdr, pixel, vec4(imageLoad(hdr, pixel).rgb + radiance, 1.0));
    }
}
