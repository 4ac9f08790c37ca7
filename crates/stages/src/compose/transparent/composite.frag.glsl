// Blended layers of a pixel, averaged over its samples: the sum of alpha x radiance of each, seen through those before it, and
// their transmittance. The blending over the opaque radiance is the pass's.
#version 460
#extension GL_EXT_samplerless_texture_functions : require

layout(set = 0, binding = 8) uniform texture2D layers;

layout(location = 0) out vec4 sum_transmittance;

void main() {
    sum_transmittance = texelFetch(layers, ivec2(gl_FragCoord.xy), 0);
}
