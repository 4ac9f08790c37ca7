// Writes blocks of the lists. Needs shading.glsl, samples.glsl.
#ifndef AFTERLIGHT_BUILD_LIST
#define AFTERLIGHT_BUILD_LIST
#include "gbuffer_list/list.glsl"

layout(set = 0, binding = 10, scalar) buffer Blocks {
    uint blocks[];
};
layout(set = 0, binding = 11, scalar) buffer BlockCount {
    uint blocks_needed;     // dynamic blocks asked for
    uint samples_dropped;   // for want of blocks
};
layout(constant_id = 13) const uint BLOCK_CAPACITY = 0u;

uint pixel_block(ivec2 pixel) {
    return uint(pixel.y) * frame.size_px.x + uint(pixel.x);
}

// Everything of a block but its pointer. Two blocks share the word of roughness: bits are added to the cleared word.
void store_block(uint block, Surface s, float distance_m, Coverage own) {
    vec3 srgb = srgb_from_linear(clamp(s.base_color, 0.0, 1.0));
    blocks[color_word(block)] = packUnorm4x8(vec4(srgb, s.metallic));
    blocks[normal_word(block)] = pack_normal(s.normal_ws, own);
    uint roughness = s.unlit ? 0u : uint(round(clamp(s.roughness, MIN_ROUGHNESS, 1.0) * 255.0));
    uint occlusion = uint(round(clamp(s.occlusion, 0.0, 1.0) * 255.0));
    atomicOr(blocks[roughness_word(block)], (roughness | occlusion << 16) << (block & 1u) * 8u);
    if (POINTER_WORDS == 2u) {
        blocks[pointer_word(block) + 1u] = own.count | own.index << 8;
    }
    if (DISTANCE_WORDS != 0u) {
        blocks[distance_word(block)] = floatBitsToUint(distance_m);
    }
    if (EMISSION_WORDS != 0u) {
        blocks[emission_word(block)] = pack_emission(s.emission);
    }
}

#endif
