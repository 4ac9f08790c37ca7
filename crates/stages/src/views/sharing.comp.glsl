// How many visibility samples of the image refer to the records that a pixel refers to, as a colour: the mean over the pixel's
// samples with a surface of the count's logarithm. Black without a surface.
//
// In: the source of records, RecordSamples. Out: hdr, RGBA16F, display-linear. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "views/records.glsl"
#include "heat.glsl"

layout(set = 0, binding = 15, scalar) readonly buffer RecordSamples {
    uint record_samples[];
};
layout(set = 0, binding = 14, rgba16f) writeonly uniform image2D hdr;

void main() {
    if (!in_image()) {
        return;
    }
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    source_begin(pixel);
    uint name, weight;
    float sum = 0.0, weights = 0.0;
    while (source_next_triangle(name, weight)) {
        uint count = record_samples[min(source_place(name), uint(record_samples.length()) - 1u)];
        sum += float(weight) * log2(float(max(count, 1u)));
        weights += float(weight);
    }
    imageStore(hdr, pixel, vec4(weights > 0.0 ? sharing_color(sum / weights) : vec3(0.0), 1.0));
}
