// How far a surface has moved on screen since the frame before, pixels: x to the right, y down.
//
// In: clip coordinates x, y, w of the surface in both frames, from surface.vert.glsl#velocity. They are linear over the triangle in world space,
// so that perspective interpolation is exact.
// Out: velocity, RG16F; the place in the frame before is the pixel's centre minus that.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#ifdef ALPHA_MASK
#include "surface_in.glsl"
#endif

layout(location = 7) in vec3 clip_now;
layout(location = 8) in vec3 clip_before;

layout(location = 0) out vec2 velocity_px;

// Farther than any image is wide: where the surface was, there is no pixel. Twin: NOWHERE_PX in mod.rs.
const float NOWHERE_PX = 32768.0;

void main() {
#ifdef ALPHA_MASK
    visible_base_color(load_material(draw_material.y), surface_point());
#endif
    // What was behind the eye was nowhere on screen.
    bool was_in_front = clip_before.z > 0.0;
    vec2 moved_ndc = clip_now.xy / clip_now.z - clip_before.xy / clip_before.z;
    vec2 moved_px = 0.5 * vec2(frame.size_px) * moved_ndc;
    velocity_px = was_in_front ? clamp(moved_px, -NOWHERE_PX, NOWHERE_PX) : vec2(NOWHERE_PX);
}
