// A view distance in 24 bits: 7 of exponent (2^-63 to 2^64 m), 17 of mantissa (2^-18 of the distance).
const uint LEAST_DISTANCE_BITS = 64u << 23;
const uint GREATEST_DISTANCE_BITS = (192u << 23) - 1u;

uint word_from_distance(float distance_m) {
    uint bits = clamp(floatBitsToUint(max(distance_m, 0.0)) + 32u, LEAST_DISTANCE_BITS, GREATEST_DISTANCE_BITS);
    return (bits - LEAST_DISTANCE_BITS) >> 6;
}

float distance_from_word(uint word) {
    return uintBitsToFloat((word << 6) + LEAST_DISTANCE_BITS);
}
