// The depth of a surface at its pixel's centre, where forward shading lights it, from its depth at a sample and 15 bits of one fragment.
//
// Depth is affine on the screen, so the two differ by no more than a fragment's greatest change of depth within its pixel. The bits are the
// last nine of the centre's depth, in steps of which 512 are at least twice that change, and six that tell the step: the sample's depth
// supplies the bits before them. A step is at most 1/128 of that change, the error half a step.
#ifndef AFTERLIGHT_CENTER_DEPTH
#define AFTERLIGHT_CENTER_DEPTH

const int CENTER_STEP_BITS = 9;                 // 512 steps
const uint CENTER_STEP_MASK = 511u;
const float MOST_DEPTH_CHANGE = 4.0;            // depths of visible samples are at most 1: more is a surface seen on its edge
const float LEAST_DEPTH_CHANGE = 1.7347235e-18;         // 2^-59
// The rasteriser's depth and the one computed here differ by rounding, which stays far below this share of it.
const float DEPTH_ROUNDING = 1.0 / 65536.0;

// 2^n exactly, for n from -126 to 127; exp2 is approximate on some devices.
float power_of_two(int n) {
    return uintBitsToFloat(uint(127 + n) << 23);
}

// 15 bits, never all zero, from the depth at the centre and its change from pixel to pixel: the sum of both directions' absolutes.
uint pack_center_depth(float depth, float change) {
    // What is not a number takes the greatest.
    float reach = change < MOST_DEPTH_CHANGE ? change : MOST_DEPTH_CHANGE * 0.99;
    depth = clamp(depth, -8.0, 8.0);
    reach = clamp(max(reach, abs(depth) * DEPTH_ROUNDING), LEAST_DEPTH_CHANGE, MOST_DEPTH_CHANGE * 0.99);
    int exponent = int(floatBitsToUint(reach) >> 23) - 126;     // 2^exponent is above reach, and at most twice it: from -58 to 2
    int steps = int(round(depth * power_of_two(CENTER_STEP_BITS - 1 - exponent)));
    return uint(3 - exponent) << CENTER_STEP_BITS | uint(steps) & CENTER_STEP_MASK;
}

// Depth at the centre of a surface that has `sample_depth` at a sample.
float unpack_center_depth(uint bits, float sample_depth) {
    int exponent = 3 - int(bits >> CENTER_STEP_BITS);
    int at_sample = int(round(sample_depth * power_of_two(CENTER_STEP_BITS - 1 - exponent)));
    // The difference modulo 512, from -256 to 255.
    int steps = at_sample + (int((bits & CENTER_STEP_MASK) - uint(at_sample)) << 23 >> 23);
    // Depth 0 is at infinity, a small part of a step is not.
    return (steps == 0 ? 1.0 / 1024.0 : float(steps)) * power_of_two(exponent + 1 - CENTER_STEP_BITS);
}

#endif
