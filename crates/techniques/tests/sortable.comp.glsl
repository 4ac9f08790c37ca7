// Sortable bits of floats, and the floats made of them again: 256 floats of all magnitudes and both signs.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/sort/sortable.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 8, scalar) writeonly buffer Found {
    float found[];
};

void main() {
    uint place = gl_GlobalInvocationID.x;
    float value = uintBitsToFloat(place * 0x00effff1u);    // no NaN among them
    // Halves of 16 bits, which a float holds.
    uint bits = sortable_bits(value);
    found[3u * place] = float(bits >> 16);
    found[3u * place + 1u] = float(bits & 0xffffu);
    found[3u * place + 2u] = from_sortable_bits(bits) == value ? 1.0 : 0.0;
}
