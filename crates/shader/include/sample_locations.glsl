// Where the samples of a pixel stand (Vulkan 1.3, table "Standard sample locations").
#ifndef AFTERLIGHT_SAMPLE_LOCATIONS
#define AFTERLIGHT_SAMPLE_LOCATIONS

// Those of one sample, of 2, 4, 8 and 16.
const vec2 SAMPLE_LOCATIONS[31] = vec2[](
    vec2(0.5, 0.5),
    vec2(0.75, 0.75), vec2(0.25, 0.25),
    vec2(0.375, 0.125), vec2(0.875, 0.375), vec2(0.125, 0.625), vec2(0.625, 0.875),
    vec2(0.5625, 0.3125), vec2(0.4375, 0.6875), vec2(0.8125, 0.5625), vec2(0.3125, 0.1875),
    vec2(0.1875, 0.8125), vec2(0.0625, 0.4375), vec2(0.6875, 0.9375), vec2(0.9375, 0.0625),
    vec2(0.5625, 0.5625), vec2(0.4375, 0.3125), vec2(0.3125, 0.625), vec2(0.75, 0.4375),
    vec2(0.1875, 0.375), vec2(0.625, 0.8125), vec2(0.8125, 0.6875), vec2(0.6875, 0.1875),
    vec2(0.375, 0.875), vec2(0.5, 0.0625), vec2(0.25, 0.125), vec2(0.125, 0.75),
    vec2(0.0, 0.5), vec2(0.9375, 0.25), vec2(0.875, 0.9375), vec2(0.0625, 0.0));

// Where sample i of so many stands, pixels from the pixel's upper left corner.
vec2 sample_location_of(uint samples, uint i) {
    return SAMPLE_LOCATIONS[samples - 1u + i];
}

#endif
