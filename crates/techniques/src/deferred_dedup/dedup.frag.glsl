// Fills the G-buffer of the DAIS paper's baseline, 20 bytes a sample with depth (Schied and Dachsbacher 2015, section 5):
// surface albedo, a triangle ID, linear depth, quantised normal. Where they have a material ID, here are metalness,
// roughness and occlusion: textures vary them, and the triangle ID names the material as well.
//
// Out, RGBA8 each, since some devices have no multisampled integer formats: 0 base colour (sRGB) and metalness; 1 normal, world
// space, octahedral, 2 x 12 bits, and roughness (0: takes no light); 2 triangle ID; 3 view distance, m, at the pixel's
// centre, 24 bits as distance.glsl has them, and occlusion; with EMISSION 4 radiance, B10G11R11. With NUMBERED
// surfaces/geometry/number.geom has numbered the triangles that tessellation made.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shading.glsl"
#include "surface_in.glsl"
#include "deferred_dedup/distance.glsl"

layout(location = 0) out vec4 base_color_metallic;
layout(location = 1) out vec4 normal_roughness;
layout(location = 2) out vec4 triangle_id;
layout(location = 3) out vec4 distance_occlusion;
#ifdef EMISSION
layout(location = 4) out vec3 emission;
#endif

void main() {
    Surface s = visible_surface();
    base_color_metallic = vec4(s.base_color, s.metallic);
    uvec2 normal = uvec2(round((octahedral_encode(s.normal_ws) * 0.5 + 0.5) * 4095.0));
    uint roughness = s.unlit ? 0u : uint(round(clamp(s.roughness, MIN_ROUGHNESS, 1.0) * 255.0));
    normal_roughness = unpackUnorm4x8(normal.x | normal.y << 12 | roughness << 24);
#ifdef NUMBERED
    uint id = uint(gl_PrimitiveID);
#else
    uint id = draw_material.x << TRIANGLE_BITS | uint(gl_PrimitiveID);
#endif
    triangle_id = unpackUnorm4x8(id);
    uint distance_bits = word_from_distance(distance_from_position(s.position_ws));
    distance_occlusion = unpackUnorm4x8(distance_bits | uint(round(s.occlusion * 255.0)) << 24);
#ifdef EMISSION
    emission = s.unlit ? vec3(0.0) : s.emission;
#endif
}
