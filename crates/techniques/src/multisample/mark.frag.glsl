// Lets pixels through that a triangle's edge crosses, for the stencil buffer. In: gbuffer_roughness, whose blue channel
// samples.frag.glsl marks.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "multisample/samples.glsl"

layout(set = 0, binding = 11) uniform texture2DMS gbuffer_roughness;

void main() {
    float edge = 0.0;
    for (uint i = 0u; i < SAMPLES; ++i) {
        edge = max(edge, texelFetch(gbuffer_roughness, ivec2(gl_FragCoord.xy), int(i)).b);
    }
    if (edge < 0.5) {
        discard;
    }
}
