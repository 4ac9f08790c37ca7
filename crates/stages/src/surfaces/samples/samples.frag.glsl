// Fills the multisampled G-buffer of 12 bytes a sample, without depth (Fridvalszky and Toth 2020, section 3: the same
// attributes as their blocks): what the samples that the fragment covers show.
//
// Out: 0 base colour and metalness, RGBA8 sRGB (alpha linear); 1 normal, world space, octahedral, RG16; 2 the word of word.glsl, RGBA8;
// with EMISSION 3 radiance, B10G11R11.
// Evaluated at the pixel's centre, as forward shading is.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"
#include "surfaces/samples/word.glsl"

// Interpolated inside of the part of the pixel that the triangle covers. Where that is not the whole pixel, it differs from the centre.
layout(location = 6) centroid in vec3 centroid_position_ws;

layout(location = 0) out vec4 base_color_metallic;
layout(location = 1) out vec2 normal_oct;
layout(location = 2) out vec4 word_out;
#ifdef EMISSION
layout(location = 3) out vec3 emission;
#endif

void main() {
    // Derivatives come before an alpha test may end neighbours of the fragment.
    vec3 pixel = fwidth(position_ws);
    float depth = depth_from_position(position_ws);
    float depth_change = abs(dFdx(depth)) + abs(dFdy(depth));
    Surface s = visible_surface();
    // Where the surface is lit, which is the plane's place but at its horizon.
    depth = depth_from_position(s.position_ws);
    base_color_metallic = vec4(s.base_color, s.metallic);
    normal_oct = octahedral_encode(s.normal_ws) * 0.5 + 0.5;
    float roughness = s.unlit ? 0.0 : max(s.roughness, MIN_ROUGHNESS);
    // The two positions differ by more than a hundredth of a pixel, which is more than rounding of the two interpolations explains.
    vec3 off = abs(centroid_position_ws - position_ws);
    bool edge = off.x + off.y + off.z > 0.01 * (pixel.x + pixel.y + pixel.z);
    uint word = packUnorm4x8(vec4(roughness, s.occlusion, 0.0, 0.0));
    word |= pack_center_depth(depth, depth_change) << 16;
    word_out = unpackUnorm4x8(edge ? word | SAMPLE_EDGE : word);
#ifdef EMISSION
    emission = s.unlit ? vec3(0.0) : s.emission;
#endif
}
