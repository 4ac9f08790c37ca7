// Counts of pairs of a light and a surface as colours: all that were tested, or with LIGHT_ERROR those of them that are not lit.
// In: light_pairs, RGBA16F, what a technique sums in the place of radiance. Out: hdr, RGBA16F, display-linear. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "heat.glsl"
#include "light_pairs.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 8) const uint LIGHT_ERROR = 0u;
layout(set = 0, binding = 8) uniform texture2D light_pairs;
layout(set = 0, binding = 9, rgba16f) writeonly uniform image2D hdr;

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.size_px))) {
        return;
    }
    vec2 count = texelFetch(light_pairs, ivec2(pixel), 0).rg / LIGHT_PAIR;
    vec3 color = pairs_color(LIGHT_ERROR > 0u ? count.x - count.y : count.x);
    imageStore(hdr, ivec2(pixel), vec4(color, 1.0));
}
