// The mark that samples.frag.glsl leaves where a triangle's edge crosses a pixel, and other pixels that several fragments share. Needs
// samples.glsl.
#ifndef AFTERLIGHT_EDGE_MARK
#define AFTERLIGHT_EDGE_MARK
#include "surfaces/samples/word.glsl"

layout(set = 0, binding = 11) uniform texture2DMS gbuffer_roughness;
// 1: a pixel whose samples hold several fragments is an edge as well, also where no triangle's edge crosses it or the device's centroids
// tell none. The words of two fragments differ where their depths at the centre do.
layout(constant_id = 10) const uint COMPARES_FRAGMENTS = 1u;

uint sample_word_at(ivec2 pixel, uint i) {
    return packUnorm4x8(texelFetch(gbuffer_roughness, pixel, int(i)));
}

bool is_edge(ivec2 pixel) {
    uint first = sample_word_at(pixel, 0u);
    uint marks = first & SAMPLE_EDGE;
    for (uint i = 1u; i < SAMPLES; ++i) {
        uint word = sample_word_at(pixel, i);
        marks |= word & SAMPLE_EDGE;
        marks |= COMPARES_FRAGMENTS != 0u ? word ^ first : 0u;
    }
    return marks != 0u;
}

#endif
