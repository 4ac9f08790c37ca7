// Counts runs of a fragment shader, a pixel; with COUNT_INVOCATIONS alone.
#ifndef AFTERLIGHT_INVOCATIONS
#define AFTERLIGHT_INVOCATIONS

#ifdef COUNT_INVOCATIONS
#ifndef ALPHA_MASK
// A shader with stores is tested late unless it says otherwise: hidden fragments would count. With an alpha test they do.
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
