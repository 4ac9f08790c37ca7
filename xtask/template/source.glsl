// The source of surfaces by which the templates of surfaces/shade/ read what fill.frag.glsl has packed. A source hands out the surfaces of a
// pixel one by one, each with its weight, the number of samples that show it; here there is one sample, so one surface or none.
#include "technique_folder/layout.glsl"

layout(set = 0, binding = 9) uniform utexture2D surface_words;

ivec2 source_pixel;
bool source_done;
uint source_background;     // samples without a surface

void source_begin(ivec2 pixel) {
    source_pixel = pixel;
    source_done = false;
    source_background = 0u;
}

// False once there is no surface left.
bool source_next(out Surface s, out uint weight) {
    if (source_done) {
        return false;
    }
    source_done = true;
    float depth = SAMPLE_DEPTH(source_pixel, 0u);
    if (depth == 0.0) {
        source_background = 1u;
        return false;
    }
    vec3 position_ws = position_from_depth(ndc_from_pixel(uvec2(source_pixel)), depth);
    s = unpacked_surface(texelFetch(surface_words, source_pixel, 0), position_ws);
    weight = 1u;
    return true;
}
