// A light's index divided into parts, and how a channel keeps the parts of the last four lights (Petrescu et al. 2016, section
// 4.7: n = 4 parts of b = 2 bits).
//
// A channel is a 16-bit float that is blended as new + old / 4. A part is 0, 1 or 2, never 3: the part of the last light is the
// channel's integer, that of the light before it the next two bits, and so on. Eight bits are read, six
// of them after the point, where a float from 2 to 4 has nine: older lights leave three bits and what rounding makes of the rest.
// As their parts are no 3 either, that stays below 3/4 of the last bit that is read, and rounding cannot carry into it.
// Twin: tests of lights/indices/mod.rs.
#ifndef AFTERLIGHT_LIGHT_PARTS
#define AFTERLIGHT_LIGHT_PARTS

const uint PART_VALUES = 3u;

// Takes the next four parts off a code.
vec4 take_parts(inout uint code) {
    vec4 parts;
    for (int channel = 0; channel < 4; ++channel) {
        parts[channel] = float(code % PART_VALUES);
        code /= PART_VALUES;
    }
    return parts;
}

// Adds four channels to the codes of the last four lights, the last first; `weight` is that of the first channel, and becomes that
// of the channel after the last.
void add_parts(vec4 channels, inout uint weight, inout uvec4 codes) {
    for (int channel = 0; channel < 4; ++channel) {
        uint bits = uint(channels[channel] * 64.0);
        codes += weight * (uvec4(bits >> 6, bits >> 4, bits >> 2, bits) & 3u);
        weight *= PART_VALUES;
    }
}

#endif
