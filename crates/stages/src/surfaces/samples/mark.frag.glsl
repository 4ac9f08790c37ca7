// Lets pixels through that a triangle's edge crosses, for the stencil buffer. In: gbuffer_roughness, whose blue channel
// samples.frag.glsl marks.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "samples.glsl"
#include "surfaces/samples/edge_mark.glsl"

void main() {
    if (!is_edge(ivec2(gl_FragCoord.xy))) {
        discard;
    }
}
