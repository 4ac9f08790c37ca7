#version 460
#extension GL_EXT_samplerless_texture_functions : require
// The greatest of four texels.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform texture2D finer;
layout(set = 0, binding = 1, r32f) writeonly uniform image2D coarser;
void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(coarser)))) { return; }
    ivec2 last = textureSize(finer, 0) - 1;
    float value = 0.0;
    for (int i = 0; i < 4; ++i) {
        value = max(value, texelFetch(finer, min(pixel * 2 + ivec2(i & 1, i >> 1), last), 0).r);
    }
    imageStore(coarser, pixel, vec4(value));
}
