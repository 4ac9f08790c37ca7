// Vertices of surfaces, for every pass that rasterises the scene.
//
// One path for the position in all variants, `invariant`, so that passes with an equal depth test meet the depths of
// the pass before. Variants: POSITION_ONLY (depth and IDs of opaque surfaces), WITH_UV (the same with coordinates for an
// alpha test), none (all attributes), CENTROID (and the position once more). VELOCITY beside the first two: where the
// surface stood in the frame before. TESSELLATION hands world space on to
// surface.tesc.glsl; whichever of the others runs then is a variant of surface.tese.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"

layout(location = 0) in vec3 position_os;
layout(location = 1) in uvec4 packed_normal_tangent_uv;   // normal, tangent, uv0.x, uv0.y
layout(location = 2) in uvec3 packed_uv1_color;           // uv1.x, uv1.y, colour
layout(location = 4) in vec4 object_row0;                 // one DrawData a draw, by the instance
layout(location = 5) in vec4 object_row1;
layout(location = 6) in vec4 object_row2;
layout(location = 7) in uvec4 draw_tail;                  // first index, first vertex, material, flags

#ifndef TESSELLATION
invariant gl_Position;
#endif

#ifdef VELOCITY
#include "surfaces/geometry/before.glsl"
#endif

#ifdef POSITION_ONLY
layout(location = 0) flat out uvec2 draw_material;
#else
layout(location = 0) flat out uvec2 draw_material;
layout(location = 1) out vec4 uv0_uv1;
layout(location = 2) out vec4 color;
#ifndef WITH_UV
layout(location = 3) out vec3 position_ws;
layout(location = 4) out vec3 normal_ws;
layout(location = 5) out vec4 tangent_ws;
#ifdef CENTROID
layout(location = 6) out vec3 centroid_position_ws;     // the same, read with centroid interpolation
#endif
#endif
#endif

void main() {
    vec3 world = position_to_world(object_row0, object_row1, object_row2, position_os);
#ifndef TESSELLATION
    gl_Position = frame.clip_from_world * vec4(world, 1.0);
#endif
    draw_material = uvec2(gl_InstanceIndex, draw_tail.z);
#ifdef VELOCITY
    vec3 world_before = position_before(position_os);
#ifdef TESSELLATION
    position_before_ws = world_before;
#else
    clip_now = gl_Position.xyw;
    clip_before = clip_of_before(world_before, clip_now);
#endif
#endif
#ifndef POSITION_ONLY
    uv0_uv1 = vec4(uintBitsToFloat(packed_normal_tangent_uv.zw), uintBitsToFloat(packed_uv1_color.xy));
    color = unpackUnorm4x8(packed_uv1_color.z);
#ifndef WITH_UV
    bool mirrored = (draw_tail.w & DRAW_MIRRORED) != 0u;
    position_ws = world;
#ifdef CENTROID
    centroid_position_ws = world;
#endif
    normal_ws = normal_to_world(object_row0, object_row1, object_row2, mirrored, unpack_normal(packed_normal_tangent_uv.x));
    tangent_ws = tangent_to_world(object_row0, object_row1, object_row2, mirrored, unpack_tangent(packed_normal_tangent_uv.y),
                                  normal_ws);
#endif
#endif
}
