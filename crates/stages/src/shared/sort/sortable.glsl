// 32-bit floats as keys of a sort: bits whose order as unsigned numbers is that of the floats. -0 comes before 0, NaN first or
// last by its sign.
//
// CPU twin: sortable_bits and from_sortable_bits in crates/frame/src/sort_words.rs.
#ifndef AFTERLIGHT_SORTABLE
#define AFTERLIGHT_SORTABLE

uint sortable_bits(float value) {
    uint bits = floatBitsToUint(value);
    return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

float from_sortable_bits(uint bits) {
    return uintBitsToFloat((bits & 0x80000000u) != 0u ? bits & 0x7fffffffu : ~bits);
}

#endif
