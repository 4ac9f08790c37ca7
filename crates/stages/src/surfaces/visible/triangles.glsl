// The triangles that samples show: IDs, or the keys of compute_raster (SAMPLES_IN_KEYS). Needs frame.glsl, scene.glsl; IDS_BINDING.
#ifndef AFTERLIGHT_TRIANGLES
#define AFTERLIGHT_TRIANGLES
#include "samples.glsl"

#ifdef SAMPLES_IN_KEYS
#include "surfaces/compute_raster/key_ids.glsl"

// A number that identifies the sample's triangle among those of the pixel; NO_TRIANGLE where the sample shows none.
uint sample_triangle(ivec2 pixel, uint i) {
    return sample_order(pixel, i);
}

// The triangle ID that belongs to such a number.
uint triangle_id(uint name) {
    return triangle_id_from_order(name);
}
#else
layout(set = 0, binding = IDS_BINDING) uniform SAMPLED_IMAGE ids;

uint sample_triangle(ivec2 pixel, uint i) {
    return packUnorm4x8(FETCH_SAMPLE(ids, pixel, i));
}

uint triangle_id(uint name) {
    return name;
}
#endif

uint all_samples() {
    return 0xffffffffu >> (32u - SAMPLES);
}

// A triangle that shows in the pixel.
struct Visible {
    uint id;        // its name; NO_TRIANGLE: there is none
    uint samples;   // mask of the samples that show it
};

// Takes the samples of the first triangle out of a mask; samples without a surface are taken out in the same way.
Visible take_triangle(ivec2 pixel, inout uint mask) {
    uint first = uint(findLSB(mask));
    Visible v = Visible(sample_triangle(pixel, first), 1u << first);
    for (uint i = first + 1u; i < SAMPLES; ++i) {
        v.samples |= (mask >> i & 1u) != 0u && sample_triangle(pixel, i) == v.id ? 1u << i : 0u;
    }
    mask &= ~v.samples;
    return v;
}

#endif
