// Keeps positions of deformed vertices for the next frame: a thread a float.
// In: Positions, three floats a vertex. Out: Remembered, those from float `first` on. Dispatch: groups of 64, in rows.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "group_rows.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer Positions { float positions_os[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Remembered { float remembered[]; };
layout(push_constant, scalar) uniform Push {
    uint first;
    uint count;
};

void main() {
    uint i = 64u * group_number() + gl_LocalInvocationIndex;
    if (i < count) {
        remembered[i] = positions_os[first + i];
    }
}
