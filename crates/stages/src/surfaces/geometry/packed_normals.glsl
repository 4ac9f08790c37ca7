// The normals and tangents of a triangle's three vertices. Normals in four words: directions, octahedral, 2 x 16 bits each; then their
// lengths over that of the longest, 3 x 10 bits. Normals of displaced surfaces are not of unit length, and interpolation weighs them by
// their lengths: unit ones bend otherwise. A tangent takes two words, four halves: the tangent over the length of the longest normal, so
// that it keeps its ratio to the normals, and the bitangent's sign times that length, since the bitangent is a product of both.
#ifndef AFTERLIGHT_PACKED_NORMALS
#define AFTERLIGHT_PACKED_NORMALS
#include "packing.glsl"

const float LENGTH_STEPS = 1023.0;

uint packed_direction(vec3 n) {
    return packSnorm2x16(dot(n, n) > 0.0 ? octahedral_encode(n) : vec2(0.0));
}

// Length of the longest normal; 1 where none has a length.
float longest_normal(vec3 n0, vec3 n1, vec3 n2) {
    float longest = max(max(length(n0), length(n1)), length(n2));
    return longest > 1e-6 ? longest : 1.0;
}

// Three directions and their lengths.
uvec4 packed_normals(vec3 n0, vec3 n1, vec3 n2) {
    vec3 lengths = vec3(length(n0), length(n1), length(n2));
    float longest = max(max(lengths.x, lengths.y), lengths.z);
    uvec3 steps = uvec3(round(lengths * (LENGTH_STEPS / max(longest, 1e-30))));
    return uvec4(packed_direction(n0), packed_direction(n1), packed_direction(n2),
                 steps.x | steps.y << 10 | steps.z << 20);
}

// Normals, a column a vertex, the longest of unit length.
mat3 unpacked_normals(uvec4 bits) {
    vec3 lengths = vec3(bits.w & 0x3ffu, bits.w >> 10 & 0x3ffu, bits.w >> 20) / LENGTH_STEPS;
    return mat3(unpack_normal(bits.x) * lengths.x, unpack_normal(bits.y) * lengths.y, unpack_normal(bits.z) * lengths.z);
}

// A tangent, and in w the bitangent's sign, beside normals the longest of which has that length.
uvec2 packed_tangent(vec4 tangent, float longest_normal) {
    return uvec2(packHalf2x16(tangent.xy / longest_normal),
                 packHalf2x16(vec2(tangent.z / longest_normal, tangent.w * longest_normal)));
}

// The tangent beside unpacked_normals.
vec4 unpacked_tangent(uvec2 bits) {
    return vec4(unpackHalf2x16(bits.x), unpackHalf2x16(bits.y));
}

#endif
