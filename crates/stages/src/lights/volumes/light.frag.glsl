// One light over the pixels of its volume: reads the G-buffer, adds to the accumulation (Petrescu et al. 2016, section
// 4.3, second pass).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gbuffer.glsl"

layout(location = 0) flat in uint light_index;
layout(location = 0) out vec4 radiance_out;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Surface s;
    radiance_out = vec4(0.0);
    if (gbuffer_load(pixel, texelFetch(gbuffer_depth, pixel, 0).r, s)) {
        radiance_out.rgb = light_radiance(shading_point_for(s, light_index), light_index);
    }
}
