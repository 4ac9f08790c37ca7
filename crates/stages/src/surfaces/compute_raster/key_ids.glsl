// Triangle IDs from the keys that compute_raster leaves. Needs frame.glsl, scene.glsl; SAMPLES_IN_KEYS.
#ifndef AFTERLIGHT_KEY_IDS
#define AFTERLIGHT_KEY_IDS
#include "samples.glsl"

// VkDrawIndexedIndirectCommand: index count, 1, first index, vertex offset, draw.
layout(set = 0, binding = 9, scalar) readonly buffer DrawCommands {
    uint draw_commands[];
};

// A triangle's place in the order of draws, which tells triangles apart as well as an ID does; NO_TRIANGLE where there is none.
uint sample_order(ivec2 pixel, uint i) {
    return ~sample_keys[sample_word(pixel, i)];
}

uint triangle_id_from_order(uint order) {
    return draw_commands[(order >> TRIANGLE_BITS) * 5u + 4u] << TRIANGLE_BITS | order & ((1u << TRIANGLE_BITS) - 1u);
}

#endif
