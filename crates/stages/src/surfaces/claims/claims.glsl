// Which fragment has a sample, where the stencil bit cannot tell.
#ifndef AFTERLIGHT_CLAIMS
#define AFTERLIGHT_CLAIMS
#include "samples.glsl"

#ifdef ALPHA_MASK
// Samples that a masked surface of the pixel has taken, 8 bits a pixel, 16 at 16 samples. Early tests come before the alpha
// test: were the stencil bit to be set by them, a fragment without alpha would take it from one of the same depth that shows.
layout(set = 0, binding = 16, scalar) buffer SampleClaims {
    uint sample_claims[];
};

// Takes samples for this fragment; of those asked for, the ones that no other has.
uint claim(uint pixel, uint samples) {
    uint bits = SAMPLES > 8u ? 16u : 8u, a_word = 32u / bits;
    uint shift = pixel % a_word * bits;
    return samples & ~(atomicOr(sample_claims[pixel / a_word], samples << shift) >> shift);
}
#endif

#endif
