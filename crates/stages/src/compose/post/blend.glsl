// What filters share: radiance that was mixed, as it is shown.
#ifndef AFTERLIGHT_POST_BLEND
#define AFTERLIGHT_POST_BLEND
#include "tonemap.glsl"

// As present/tonemap.comp.glsl.
vec3 display_color(vec3 radiance) {
    return srgb_from_linear(clamp(pbr_neutral(radiance), 0.0, 1.0));
}

#endif
