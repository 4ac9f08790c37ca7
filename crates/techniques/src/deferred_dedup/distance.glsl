// A signed view distance in 24 bits: sign, 7 bits of exponent (2^-63 to 2^64 m), 16 of mantissa (2^-17 of the distance).
//
// The sign is needed where a triangle covers samples of a pixel and not its centre: its plane can end before the centre, at the
// horizon, and what is interpolated there lies behind the viewer.
const uint LEAST_DISTANCE_BITS = 64u << 23;
const uint GREATEST_DISTANCE_BITS = (192u << 23) - 1u;

uint word_from_distance(float distance_m) {
    uint bits = clamp(floatBitsToUint(abs(distance_m)) + 64u, LEAST_DISTANCE_BITS, GREATEST_DISTANCE_BITS);
    return (bits - LEAST_DISTANCE_BITS) >> 7 | (distance_m < 0.0 ? 1u << 23 : 0u);
}

float distance_from_word(uint word) {
    float distance_m = uintBitsToFloat(((word & 0x7fffffu) << 7) + LEAST_DISTANCE_BITS);
    return (word & 1u << 23) != 0u ? -distance_m : distance_m;
}
