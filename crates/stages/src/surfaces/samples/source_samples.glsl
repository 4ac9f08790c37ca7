// Surfaces of a pixel from the multisampled G-buffer that samples.frag.glsl fills.
//
// EVERY_SAMPLE: all samples. Otherwise all samples where a triangle's edge crosses the pixel, else the first alone; PIXEL_RATE and
// SAMPLE_RATE say beforehand which of the two it is. Surfaces are lit at the pixel's centre, as in forward shading; with AT_SAMPLES at their
// samples where each is shaded.
#include "surfaces/samples/edge_mark.glsl"

layout(set = 0, binding = 9) uniform texture2DMS gbuffer_base_color;
layout(set = 0, binding = 10) uniform texture2DMS gbuffer_normal;
layout(constant_id = 11) const uint AT_SAMPLES = 0u;
#ifdef EMISSION
layout(set = 0, binding = 12) uniform texture2DMS gbuffer_emission;
#endif

ivec2 source_pixel;
uint source_index;          // next sample to look at
uint source_end;
uint source_weight;
uint source_background;     // samples without a surface

void source_begin(ivec2 pixel) {
    source_pixel = pixel;
    source_index = 0u;
    source_background = 0u;
#if defined(EVERY_SAMPLE) || defined(SAMPLE_RATE)
    bool sample_rate = true;
#elif defined(PIXEL_RATE)
    bool sample_rate = false;
#else
    bool sample_rate = is_edge(pixel);
#endif
    source_end = sample_rate ? SAMPLES : 1u;
    source_weight = sample_rate ? 1u : SAMPLES;
}

bool source_next(out Surface s, out uint weight) {
    float depth = 0.0;
    uint i = 0u;
    while (depth == 0.0 && source_index < source_end) {
        i = source_index++;
        depth = texelFetch(gbuffer_depth, source_pixel, int(i)).r;
        source_background += depth == 0.0 ? source_weight : 0u;
    }
    if (depth == 0.0) {
        return false;
    }
    vec4 base = texelFetch(gbuffer_base_color, source_pixel, int(i));
    uint word = sample_word_at(source_pixel, i);
    vec2 roughness_occlusion = unpackUnorm4x8(word).rg;
    bool at_center = AT_SAMPLES == 0u || source_weight == SAMPLES;
    s.position_ws = at_center ? position_from_depth(ndc_from_pixel(uvec2(source_pixel)),
                                                    unpack_center_depth(sample_center_bits(word), depth))
                              : position_from_depth(ndc_from_sample(source_pixel, i), depth);
    s.normal_ws = octahedral_decode(texelFetch(gbuffer_normal, source_pixel, int(i)).rg * 2.0 - 1.0);
    s.base_color = base.rgb;
    s.metallic = base.a;
    s.roughness = roughness_occlusion.r;
    s.occlusion = roughness_occlusion.g;
    s.unlit = s.roughness == 0.0;
    s.emission = vec3(0.0);
#ifdef EMISSION
    s.emission = texelFetch(gbuffer_emission, source_pixel, int(i)).rgb;
#endif
    weight = source_weight;
    return true;
}
