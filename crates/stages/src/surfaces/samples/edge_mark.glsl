// The mark that samples.frag.glsl leaves where a triangle's edge crosses a pixel. Needs samples.glsl.
#ifndef AFTERLIGHT_EDGE_MARK
#define AFTERLIGHT_EDGE_MARK

layout(set = 0, binding = 11) uniform texture2DMS gbuffer_roughness;

bool is_edge(ivec2 pixel) {
    float edge = 0.0;
    for (uint i = 0u; i < SAMPLES; ++i) {
        edge = max(edge, texelFetch(gbuffer_roughness, pixel, int(i)).b);
    }
    return edge > 0.5;
}

#endif
