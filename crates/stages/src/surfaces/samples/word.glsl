// Four bytes of a sample: roughness (0: takes no light), occlusion, 15 bits of center_depth.glsl, and the highest bit where the fragment may
// cover its pixel in part. All zero: no surface.
#ifndef AFTERLIGHT_SAMPLE_WORD
#define AFTERLIGHT_SAMPLE_WORD
#include "surfaces/samples/center_depth.glsl"

const uint SAMPLE_EDGE = 0x80000000u;

uint sample_center_bits(uint word) {
    return word >> 16 & 0x7fffu;
}

#endif
