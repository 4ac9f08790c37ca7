// The G-buffer of per-pixel lists (Fridvalszky and Toth 2020, section 4.1, Figures 3 and 4).
//
// Block i < pixels belongs to pixel i; those after are dynamic, linked from it. Blocks stand in pairs, 112 bits each:
//
//   word 0, 1  base colour (sRGB) and metalness, of the first and the second block
//   word 2, 3  normal, world space, octahedral 2 x 13 bits; samples covered, less one, and one of them, 3 bits each. A block
//              that holds its distance needs no sample: 15 + 14 bits and 3; with wide pointers, or one sample a pixel, 2 x 16
//   word 4     roughness 1, roughness 2, occlusion 1, occlusion 2, 8 bits each; roughness 0 takes no light
//   word 5, 6  pointer: 26 bits index of the next block, 0 at the end (block 0 is no dynamic one); 3 bits of samples that it
//              covers, less one; 3 bits with one of them
//
// Departure: some of the normal's bits hold the coverage of the pixel's own block, because no pointer leads to that block. Options lengthen blocks: a
// wide pointer (32 bits of index; a second word: samples covered, and one of them), the view distance at the pixel's centre
// (else positions come from the depth buffer at the sample), emission (R9G9B9E5) in scenes that have any.
//
// A block of all zeros is empty. The buffer is cleared before the lists are built.
#ifndef AFTERLIGHT_LIST
#define AFTERLIGHT_LIST
#include "packing.glsl"
#include "tonemap.glsl"
#include "samples.glsl"

layout(constant_id = 10) const uint POINTER_WORDS = 1u;
layout(constant_id = 11) const uint DISTANCE_WORDS = 0u;
layout(constant_id = 12) const uint EMISSION_WORDS = 0u;
const uint PAIR_WORDS = 5u + 2u * (POINTER_WORDS + DISTANCE_WORDS + EMISSION_WORDS);

uint pair_word(uint block) {
    return (block >> 1) * PAIR_WORDS;
}
uint color_word(uint block) {
    return pair_word(block) + (block & 1u);
}
uint normal_word(uint block) {
    return pair_word(block) + 2u + (block & 1u);
}
uint roughness_word(uint block) {
    return pair_word(block) + 4u;
}
uint pointer_word(uint block) {
    return pair_word(block) + 5u + (block & 1u) * POINTER_WORDS;
}
uint distance_word(uint block) {
    return pair_word(block) + 5u + 2u * POINTER_WORDS + (block & 1u);
}
uint emission_word(uint block) {
    return pair_word(block) + 5u + 2u * (POINTER_WORDS + DISTANCE_WORDS) + (block & 1u);
}

// Samples of a block: how many it covers, and one of them.
struct Coverage {
    uint count;
    uint index;
};

// A pointer's first word: the next block and, where it is narrow, what that covers.
uint pack_pointer(uint block, Coverage next) {
    return POINTER_WORDS == 2u ? block : block | (next.count - 1u) << 26 | next.index << 29;
}

uint pointer_block(uint pointer) {
    return POINTER_WORDS == 2u ? pointer : pointer & 0x3ffffffu;
}

// Bits of a normal's two coordinates; the word's others tell what the block covers.
const bool NORMAL_FILLS_WORD = POINTER_WORDS == 2u || SAMPLES == 1u;
const uint NORMAL_X_BITS = NORMAL_FILLS_WORD ? 16u : DISTANCE_WORDS != 0u ? 15u : 13u;
const uint NORMAL_Y_BITS = NORMAL_FILLS_WORD ? 16u : DISTANCE_WORDS != 0u ? 14u : 13u;
const uvec2 NORMAL_MAX = (uvec2(1u) << uvec2(NORMAL_X_BITS, NORMAL_Y_BITS)) - 1u;

// Never zero: the first coordinate is at least 1.
uint pack_normal(vec3 normal, Coverage own) {
    uvec2 oct = uvec2(round((octahedral_encode(normal) * 0.5 + 0.5) * vec2(NORMAL_MAX)));
    uint bits = max(oct.x, 1u) | oct.y << NORMAL_X_BITS;
    if (NORMAL_FILLS_WORD) {
        return bits;
    }
    bits |= (own.count - 1u) << (NORMAL_X_BITS + NORMAL_Y_BITS);
    return DISTANCE_WORDS != 0u ? bits : bits | own.index << 29;
}

vec3 unpack_block_normal(uint word) {
    vec2 oct = vec2(word & NORMAL_MAX.x, word >> NORMAL_X_BITS & NORMAL_MAX.y) / vec2(NORMAL_MAX);
    return octahedral_decode(oct * 2.0 - 1.0);
}

// The coverage that is stored in the normal's word of a block with narrow pointers.
Coverage unpack_normal_coverage(uint word) {
    if (NORMAL_FILLS_WORD) {
        return Coverage(1u, 0u);
    }
    uint bits = word >> (NORMAL_X_BITS + NORMAL_Y_BITS);
    return Coverage((bits & 7u) + 1u, DISTANCE_WORDS != 0u ? 0u : bits >> 3);
}

// Three channels of one exponent: nine bits each and five (Vulkan 1.3, "Conversion to E5B9G9R9").
uint pack_emission(vec3 radiance) {
    vec3 c = clamp(radiance, 0.0, 65408.0);
    float largest = max(c.r, max(c.g, c.b));
    if (largest <= 0.0) {
        return 0u;
    }
    int exponent = clamp(int(floor(log2(largest))) + 16, 0, 31);
    float scale = exp2(float(9 + 15 - exponent));
    if (round(largest * scale) > 511.0) {
        exponent = min(exponent + 1, 31);
        scale *= 0.5;
    }
    uvec3 bits = min(uvec3(round(c * scale)), uvec3(511u));
    return bits.r | bits.g << 9 | bits.b << 18 | uint(exponent) << 27;
}

vec3 unpack_emission(uint word) {
    float scale = exp2(float(word >> 27) - 24.0);
    return vec3(word & 511u, word >> 9 & 511u, word >> 18 & 511u) * scale;
}

#endif
