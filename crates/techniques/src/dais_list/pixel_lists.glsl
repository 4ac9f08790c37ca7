// Words of the lists (Schied and Dachsbacher 2015, section 4.1, "Per Pixel Visibility Sample Linked Lists").
//
// A pixel has a word, its head, which is zero, an entry, or a link; a node has two: an entry, and what the head was before it. So the
// first triangle of a pixel takes no node, and k triangles take k - 1.
//   entry  bit 31 set; samples covered less one, three bits, four at 16 samples; reference to the triangle
//   link   a node's number plus one
//
// Departure: the paper's head is an entry only where one triangle covers every sample.
#ifndef AFTERLIGHT_LISTS
#define AFTERLIGHT_LISTS
#include "samples.glsl"

const uint ENTRY = 0x80000000u;
const uint REFERENCE_BITS = SAMPLES > 8u ? 27u : 28u;

// A reference that no triangle has, for one that found no place.
const uint NO_REFERENCE = (1u << REFERENCE_BITS) - 1u;

uint list_entry(uint reference, uint samples) {
    return ENTRY | (samples - 1u) << REFERENCE_BITS | min(reference, NO_REFERENCE);
}

uint entry_reference(uint entry) {
    return entry & ((1u << REFERENCE_BITS) - 1u);
}

uint entry_samples(uint entry) {
    return ((entry & ~ENTRY) >> REFERENCE_BITS) + 1u;
}

#endif
