// Vertices of tessellated surfaces: points of a flat triangle, displaced (Schied and Dachsbacher 2015, section 5).
//
// In: patches of surface.tesc.glsl. Out: what surface.vert.glsl hands to fragment shaders, by the same variants. One path
// for the position in all of them, `invariant`, so that passes with an equal depth test meet the depths of the pass before.
//
// A point of an edge is a sum of two products, the third being zero, and a sum of two does not depend on their order: both
// triangles at an edge find the same bits, `precise` keeping the compiler from fusing one of the products with the sum.
//
// Equal spacing: triangles of about one size are what is asked for. Fractional spacing would move without jumps, at the price
// of slivers beside each corner.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "surfaces/geometry/displacement.glsl"

// Vulkan looks at the patch with the origin in the upper left corner: clockwise there is the order of the three vertices.
layout(triangles, equal_spacing, cw) in;

layout(constant_id = 1) const float DISPLACEMENT_M = 0.0;

layout(location = 0) patch in uvec2 patch_draw_material;
layout(location = 1) in vec4 patch_uv0_uv1[];
layout(location = 2) in vec4 patch_color[];
layout(location = 3) in vec3 patch_position_ws[];
layout(location = 4) in vec3 patch_normal_ws[];
layout(location = 5) in vec4 patch_tangent_ws[];
#ifdef VELOCITY
layout(location = 6) in vec3 patch_before_ws[];
#include "surfaces/geometry/clip_before.glsl"
#endif

invariant gl_Position;

layout(location = 0) flat out uvec2 draw_material;
#ifndef POSITION_ONLY
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

#define AT_POINT(values) (gl_TessCoord.x * values[0] + gl_TessCoord.y * values[1] + gl_TessCoord.z * values[2])

void main() {
    precise vec3 world = AT_POINT(patch_position_ws);
    mat3 columns = mat3(1.0);
    if (DISPLACEMENT_M > 0.0) {
        world = displaced(world, DISPLACEMENT_M, columns);
    }
    gl_Position = frame.clip_from_world * vec4(world, 1.0);
    draw_material = patch_draw_material;
#ifdef VELOCITY
    // The field of displacement stands still in the world: a surface that moves through it is displaced elsewhere.
    vec3 before = AT_POINT(patch_before_ws);
    mat3 unused;
    if (DISPLACEMENT_M > 0.0) {
        before = displaced(before, DISPLACEMENT_M, unused);
    }
    clip_now = gl_Position.xyw;
    clip_before = clip_of_before(before, clip_now);
#endif
#ifndef POSITION_ONLY
    uv0_uv1 = AT_POINT(patch_uv0_uv1);
    color = AT_POINT(patch_color);
#ifndef WITH_UV
    position_ws = world;
#ifdef CENTROID
    centroid_position_ws = world;
#endif
    normal_ws = AT_POINT(patch_normal_ws);
    tangent_ws = AT_POINT(patch_tangent_ws);
    if (DISPLACEMENT_M > 0.0) {
        normal_ws = displaced_normal(columns, normal_ws);
        tangent_ws.xyz = columns * tangent_ws.xyz;
    }
#endif
#endif
}
