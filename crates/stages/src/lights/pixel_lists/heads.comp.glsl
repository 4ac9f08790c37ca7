// Empties the lists of all pixels, and leaves in each the view distances between which its surfaces lie.
//
// In: what the source reads. Out: LightHeads. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "source"
#include "lights/pixel_lists/head.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 48, scalar) writeonly buffer LightHeads {
    LightHead light_heads[];
};

float nearest_m, farthest_m;

void visit_distance(float distance_m) {
    nearest_m = min(nearest_m, distance_m);
    farthest_m = max(farthest_m, distance_m);
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, frame.size_px))) {
        return;
    }
    nearest_m = 3.402823e38;
    farthest_m = 0.0;
    visit_pixel(ivec2(pixel));
    const float SLACK = 1e-5;
    light_heads[pixel.y * frame.size_px.x + pixel.x] =
        LightHead(0u, nearest_m * (1.0 - SLACK), farthest_m * (1.0 + SLACK));
}
