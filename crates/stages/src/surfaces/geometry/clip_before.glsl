// Clip coordinates x, y, w of a surface in this frame and in the one before: what shaders before the rasteriser hand to
// surfaces/velocity/velocity.frag.glsl.
#ifndef AFTERLIGHT_CLIP_BEFORE
#define AFTERLIGHT_CLIP_BEFORE
#include "frame.glsl"

#ifndef TESSELLATION
layout(location = 7) out vec3 clip_now;
layout(location = 8) out vec3 clip_before;
#endif

// Where no frame before is of use, nothing has moved.
vec3 clip_of_before(vec3 before_ws, vec3 now) {
    vec4 clip = frame.clip_from_world_before * vec4(before_ws, 1.0);
    return (frame.before & BEFORE_VIEW) != 0u ? clip.xyw : now;
}

#endif
