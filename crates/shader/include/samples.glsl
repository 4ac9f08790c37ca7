// Samples of a pixel: how many, and where they stand.
#ifndef AFTERLIGHT_SAMPLES
#define AFTERLIGHT_SAMPLES
#include "sample_locations.glsl"

layout(constant_id = 8) const uint SAMPLES = 4u;

// Images of one sample are another type than those of several.
#ifdef ONE_SAMPLE
#define SAMPLED_IMAGE texture2D
#define FETCH_SAMPLE(image, pixel, i) texelFetch(image, pixel, 0)
#else
#define SAMPLED_IMAGE texture2DMS
#define FETCH_SAMPLE(image, pixel, i) texelFetch(image, pixel, int(i))
#endif

#ifdef SAMPLES_IN_KEYS
// Two words a sample (crates/stages, surfaces/compute_raster): the complement of its triangle's place in the order of draws, its depth.
layout(set = 0, binding = 8, scalar) readonly buffer SampleKeys {
    uint sample_keys[];
};
uint sample_word(ivec2 pixel, uint i) {
    return ((uint(pixel.y) * frame.size_px.x + uint(pixel.x)) * SAMPLES + i) * 2u;
}
#define SAMPLE_DEPTH(pixel, i) uintBitsToFloat(sample_keys[sample_word(pixel, i) + 1u])
#else
#define SAMPLE_DEPTH(pixel, i) FETCH_SAMPLE(gbuffer_depth, pixel, i).r
#endif

// Where sample i stands, pixels from the pixel's upper left corner.
vec2 sample_location(uint i) {
    return sample_location_of(SAMPLES, i);
}

// Normalised device coordinates of a sample.
vec2 ndc_from_sample(ivec2 pixel, uint i) {
    return (vec2(pixel) + sample_location(i)) * 2.0 / vec2(frame.size_px) - 1.0;
}

#endif
