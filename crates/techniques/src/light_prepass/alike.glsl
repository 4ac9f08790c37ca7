// Whose sums a fragment takes where a pixel has several samples and one sum: lights were gathered for the surface at each pixel's centre, which
// a fragment on an edge is not. It takes those of the pixel, of its own and the eight around it, whose surface is most alike.
#ifndef AFTERLIGHT_ALIKE
#define AFTERLIGHT_ALIKE
#include "shading.glsl"

// Roughness is not compared: with one texture more the shader has over 32, and lavapipe (Mesa 22.3) writes past its table of them and crashes.
layout(set = 0, binding = 11) uniform texture2D surface_depth;
layout(set = 0, binding = 12) uniform texture2D surface_normal;

// Where a fragment's plane lies.
struct FragmentPlane {
    float depth;        // at the pixel's centre
    vec2 change;        // of depth, a pixel to the right and one down
    float pixel_m;      // extent of a pixel on the surface
};

FragmentPlane fragment_plane(vec3 position_ws) {
    float depth = depth_from_position(position_ws);
    float pixel_m = 0.5 * (length(dFdx(position_ws)) + length(dFdy(position_ws)));
    return FragmentPlane(depth, vec2(dFdx(depth), dFdy(depth)), max(pixel_m, 1e-20));
}

const float NOT_ALIKE = 1e30;   // a pixel without a surface
const float SAME = 0.02;        // what rounding explains of one surface
// A turn of the normal by 30 degrees weighs as much as a pixel's extent of distance.
const float NORMAL_WEIGHT = 7.5;
// The light of another pixel is that of another place: it must be more alike by this.
const float NEIGHBOR_PENALTY = 0.1;

// How far the surface that a pixel keeps is from the fragment's, continued to that pixel.
float unlikeness(FragmentPlane plane, Surface s, ivec2 pixel, ivec2 to_pixel) {
    ivec2 at = pixel + to_pixel;
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(frame.size_px)))) {
        return NOT_ALIKE;
    }
    float depth = texelFetch(surface_depth, at, 0).r;
    if (depth == 0.0) {
        return NOT_ALIKE;
    }
    float expected = plane.depth + dot(plane.change, vec2(to_pixel));
    float off_m = abs(distance_from_depth(depth) - distance_from_depth(expected));
    vec3 normal = octahedral_decode(texelFetch(surface_normal, at, 0).rg * 2.0 - 1.0);
    return off_m / plane.pixel_m + NORMAL_WEIGHT * (1.0 - dot(normal, s.normal_ws));
}

ivec2 alike_pixel(FragmentPlane plane, Surface s, ivec2 pixel) {
    float least = unlikeness(plane, s, pixel, ivec2(0));
    ivec2 best = ivec2(0);
    if (least > SAME) {
        for (int i = 0; i < 9; ++i) {
            ivec2 to_pixel = ivec2(i % 3, i / 3) - 1;
            float found = unlikeness(plane, s, pixel, to_pixel) + NEIGHBOR_PENALTY;
            if (found < least) {
                least = found;
                best = to_pixel;
            }
        }
    }
    return pixel + best;
}

#endif
