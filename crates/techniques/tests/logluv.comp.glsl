// Colours before and after LogLuv. Out: Found, a colour and what is left of it, a pair a thread. Dispatch: 512 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "logluv.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 8, scalar) writeonly buffer Found {
    vec4 found[];
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    // Eight steps a channel from 0.1 to 1, times 2^-32 to 2^31.
    vec3 steps = vec3(i & 7u, i >> 3 & 7u, i >> 6 & 7u) / 7.0;
    vec3 rgb = (0.1 + 0.9 * steps) * exp2(float(i >> 9) - 32.0);
    found[i * 2u] = vec4(rgb, 0.0);
    found[i * 2u + 1u] = vec4(logluv_decode(logluv_encode(rgb)), float(logluv_encode(vec3(0.0))));
}
