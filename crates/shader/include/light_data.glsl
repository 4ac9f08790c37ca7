// Lights as records.
#ifndef AFTERLIGHT_LIGHT_DATA
#define AFTERLIGHT_LIGHT_DATA
// A light is four texels of an RGBA32UI image, 256 lights a row. It is an image and not a buffer because
// lavapipe loads a texel with one vector instruction, but a buffer word by word and lane by lane.
//
//   0  position in world space, m; 1 / range^2, 1/m^2, 0 where it has no end
//   1  intensity, candela, or lux where directional; the kind
//   2  unit direction in which it shines; range, m
//   3  spot: scale and offset of the angular falloff clamp(cos * scale + offset)^2; unused; unused
layout(set = 0, binding = 4) uniform utexture2D light_data;
const uint LIGHT_POINT = 0u;
const uint LIGHT_SPOT = 1u;
const uint LIGHT_DIRECTIONAL = 2u;

vec4 light_texel(uint index, uint texel) {
    return uintBitsToFloat(texelFetch(light_data, ivec2((index & 255u) * 4u + texel, index >> 8), 0));
}

// 1 where every light is a point light: the compiler then removes the code for other kinds.
layout(constant_id = 6) const uint ONLY_POINT_LIGHTS = 0u;

uint light_kind(uint index) {
    return texelFetch(light_data, ivec2((index & 255u) * 4u + 1u, index >> 8), 0).w;
}

#endif
