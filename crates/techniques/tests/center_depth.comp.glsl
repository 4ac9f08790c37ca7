// Depths at the centre before and after center_depth.glsl. Out: Found, a vec4 a thread: the depth, its change within the pixel, the depth at a
// sample, and what is read back. Dispatch: 1,024 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "surfaces/samples/center_depth.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 8, scalar) writeonly buffer Found {
    vec4 found[];
};

// A number from 0 to 1 by a thread and a place in its sequence (Jarzynski and Olano 2020, PCG).
float random(uint thread, uint place) {
    uint bits = (thread * 747796405u + place * 2891336453u) * 747796405u + 2891336453u;
    bits = ((bits >> ((bits >> 28) + 4u)) ^ bits) * 277803737u;
    return float((bits >> 22 ^ bits) >> 8) / 16777215.0;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    float at_sample = exp2(-40.0 * random(i, 0u));
    // From what faces the eye to what is seen on its edge.
    float change = min(at_sample * exp2(30.0 * random(i, 1u) - 24.0), 2.0);
    change = (i & 15u) == 0u ? 0.0 : change;
    float at_center = at_sample + 0.5 * change * (2.0 * random(i, 2u) - 1.0);
    uint bits = pack_center_depth(at_center, change);
    // Fifteen bits, some of them set.
    float read = bits == 0u || bits > 0x7fffu ? 1e9 : unpack_center_depth(bits, at_sample);
    found[i] = vec4(at_center, change, at_sample, read);
}
