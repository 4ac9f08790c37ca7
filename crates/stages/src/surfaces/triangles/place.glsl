// The visible triangle that stands at a place of the triangle buffer: the inverse of triangle_index.
#ifndef AFTERLIGHT_TRIANGLE_PLACE
#define AFTERLIGHT_TRIANGLE_PLACE
#include "surfaces/triangles/index.glsl"

// Not the lengths of buffers: those are rounded up.
layout(constant_id = 10) const uint DRAWS = 0u;

// Two binary searches, then one among the bits of a word.
uint visible_triangle(uint place) {
    // The last block whose base is not above the place. One without visible triangles has the base of the next one.
    uint block = 0u;
    for (uint end = (DRAWS * WORDS_A_DRAW + BLOCK_WORDS - 1u) / BLOCK_WORDS; end - block > 1u;) {
        uint middle = (block + end) / 2u;
        bool after = block_base[middle] > place;
        end = after ? middle : end;
        block = after ? block : middle;
    }
    uint rest = place - block_base[block];
    uint word = block * BLOCK_WORDS;
    for (uint end = min(word + BLOCK_WORDS, DRAWS * WORDS_A_DRAW); end - word > 1u;) {
        uint middle = (word + end) / 2u;
        bool after = visible_before[middle] > rest;
        end = after ? middle : end;
        word = after ? word : middle;
    }
    rest -= visible_before[word];
    uint bits = visible_bits[word];
    int bit = 0;
    for (int width = 16; width > 0; width /= 2) {
        uint lower = uint(bitCount(bitfieldExtract(bits, bit, width)));
        if (rest >= lower) {
            rest -= lower;
            bit += width;
        }
    }
    return word << 5 | uint(bit);
}

#endif
