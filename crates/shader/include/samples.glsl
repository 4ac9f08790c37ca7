// Samples of a pixel: how many, and where they stand (Vulkan 1.3, table "Standard sample locations").
#ifndef AFTERLIGHT_SAMPLES
#define AFTERLIGHT_SAMPLES

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
    const vec2 LOCATIONS[31] = vec2[](
        vec2(0.5, 0.5),
        vec2(0.75, 0.75), vec2(0.25, 0.25),
        vec2(0.375, 0.125), vec2(0.875, 0.375), vec2(0.125, 0.625), vec2(0.625, 0.875),
        vec2(0.5625, 0.3125), vec2(0.4375, 0.6875), vec2(0.8125, 0.5625), vec2(0.3125, 0.1875),
        vec2(0.1875, 0.8125), vec2(0.0625, 0.4375), vec2(0.6875, 0.9375), vec2(0.9375, 0.0625),
        vec2(0.5625, 0.5625), vec2(0.4375, 0.3125), vec2(0.3125, 0.625), vec2(0.75, 0.4375),
        vec2(0.1875, 0.375), vec2(0.625, 0.8125), vec2(0.8125, 0.6875), vec2(0.6875, 0.1875),
        vec2(0.375, 0.875), vec2(0.5, 0.0625), vec2(0.25, 0.125), vec2(0.125, 0.75),
        vec2(0.0, 0.5), vec2(0.9375, 0.25), vec2(0.875, 0.9375), vec2(0.0625, 0.0));
    return LOCATIONS[SAMPLES - 1u + i];
}

// Normalised device coordinates of a sample.
vec2 ndc_from_sample(ivec2 pixel, uint i) {
    return (vec2(pixel) + sample_location(i)) * 2.0 / vec2(frame.size_px) - 1.0;
}

#endif
