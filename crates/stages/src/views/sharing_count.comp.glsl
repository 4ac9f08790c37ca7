// Counts the visibility samples of the image that refer to each record of the triangle buffer (Schied and Dachsbacher 2015,
// Figure 1, right). A thread a pixel.
//
// In: the source of records. Out: RecordSamples, a word a record. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "views/records.glsl"

layout(set = 0, binding = 15, scalar) buffer RecordSamples {
    uint record_samples[];
};

void main() {
    if (!in_image()) {
        return;
    }
    source_begin(ivec2(gl_GlobalInvocationID.xy));
    uint name, weight;
    while (source_next_triangle(name, weight)) {
        uint place = source_place(name);
        // A frame that has more triangles than room is recorded again.
        if (place < uint(record_samples.length())) {
            atomicAdd(record_samples[place], weight);
        }
    }
}
