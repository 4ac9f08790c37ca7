// Chooses the lights that a surface visits. Every technique that shades a surface in one go uses this code, however the surface is stored.
#ifndef AFTERLIGHT_LIGHT_STEP
#define AFTERLIGHT_LIGHT_STEP
#include "lights/cells/cell_lists.glsl"
#include "lights/pixel_lists/pixel_lists.glsl"

// lights/step/mod.rs
const uint STEP_ALL = 0u;       // all
const uint STEP_CELLS = 1u;     // those on the list of its cell: tiles, tiles with bits of depth, clusters
const uint STEP_TREE = 2u;      // those that the tree over the lights leads to
const uint STEP_LISTS = 3u;     // those on the list of its pixel
const uint STEP_NONE = 4u;      // none: other passes add them
layout(constant_id = 46) const uint LIGHT_STEP = STEP_ALL;

// Radiance from the lights at a surface of a pixel; `distance_m` is its view distance.
vec3 lights_radiance(ShadingPoint p, uvec2 pixel, float distance_m) {
    if (LIGHT_PAIRS == CELL_COLORS) {
        return cell_color(pixel, distance_m);
    }
    if (LIGHT_STEP == STEP_ALL) {
        return all_lights_radiance(p);
    }
    vec3 radiance = vec3(0.0);
    if (LIGHT_STEP == STEP_NONE) {
        return radiance;
    }
    for (uint i = 0u; i < frame.unbounded_light_count; ++i) {
        radiance += light_radiance(p, i);
    }
    if (LIGHT_STEP == STEP_CELLS) {
        radiance += cell_radiance(p, pixel, distance_m);
    } else if (LIGHT_STEP == STEP_TREE) {
        radiance += tree_radiance(p);
    } else {
        radiance += listed_radiance(p, pixel, distance_m);
    }
    return radiance;
}

// Radiance that leaves a surface of a pixel: as surface_radiance, but only over the lights that the step finds for it.
vec3 stepped_radiance(Surface s, uvec2 pixel) {
    vec3 radiance = unlit_radiance(s);
    if (!s.unlit) {
        float distance_m = distance_from_position(s.position_ws);
        radiance += lights_radiance(shading_point(s), pixel, distance_m);
    }
    return radiance;
}

#endif
