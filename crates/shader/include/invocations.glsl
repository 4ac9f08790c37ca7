// Counts how often the fragment shader runs in each pixel; only with COUNT_INVOCATIONS.
#ifndef AFTERLIGHT_INVOCATIONS
#define AFTERLIGHT_INVOCATIONS

#ifdef COUNT_INVOCATIONS
#ifndef ALPHA_MASK
// A fragment shader that stores is depth-tested after it runs unless it asks for early tests; hidden fragments would be counted too.
// Shaders with an alpha test cannot ask for early tests, so that their hidden fragments are counted.
layout(early_fragment_tests) in;
#endif
layout(set = 0, binding = 14, r32ui) uniform uimage2D invocation_count;

void count_invocation() {
    imageAtomicAdd(invocation_count, ivec2(gl_FragCoord.xy), 1u);
}
#else
void count_invocation() {}
#endif

#endif
