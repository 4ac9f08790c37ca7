// How far away a surface is lit that covers samples of a pixel and perhaps not its centre.
//
// Surfaces are lit at the pixel's centre. The plane of one that is seen at a flat angle may end before the centre, at its horizon: what is
// continued to there lies far beyond the samples that show it, or behind the eye, and means nothing. The inverse of the view distance is
// affine on the screen, and above 0 at every sample that shows. So it is raised, at the centre, to the least with which all samples could
// show: a surface that fills its pixel is lit where it is, and one that ends within it is lit nearer than its horizon, by every technique
// alike.
#ifndef AFTERLIGHT_CENTER_DISTANCE
#define AFTERLIGHT_CENTER_DISTANCE
#include "frame.glsl"
#include "sample_locations.glsl"

// The inverse of the view distance, 1/m, at which a surface is lit that has `inverse` at the pixel's centre, with its changes a pixel to the
// right and one down. At one sample a pixel, and under an orthographic camera, whose surfaces have an inverse of 1, it is what it was.
float center_inverse_distance(float inverse, vec2 change) {
    // No sample stands farther from the centre than half a pixel along each axis.
    if (frame.samples <= 1u || inverse >= 0.5 * (abs(change.x) + abs(change.y))) {
        return inverse;
    }
    for (uint i = 0u; i < frame.samples; ++i) {
        inverse = max(inverse, dot(change, 0.5 - sample_location_of(frame.samples, i)));
    }
    return inverse;
}

#endif
