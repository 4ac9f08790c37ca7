// Shade and resolve of pixels that the stencil test lets through: SAMPLE_RATE where edges cross them, PIXEL_RATE inside.
// In: the source's images, gbuffer_depth. Out: linear radiance.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "surfaces/shade/shade.glsl"

layout(location = 0) out vec4 radiance_out;

void main() {
    vec3 radiance = vec3(0.0);
    Surface s;
    uint weight;
    shaded_count = 0u;
    weight_sum = 0u;
    source_begin(ivec2(gl_FragCoord.xy));
    while (source_next(s, weight)) {
        radiance += float(weight) * surface_radiance(s);
        ++shaded_count;
        weight_sum += weight;
    }
    radiance_out = vec4(resolved(radiance), 1.0);
}
