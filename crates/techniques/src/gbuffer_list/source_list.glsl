// Surfaces of a pixel from its list: the pixel's own block, then those linked from it.
#include "gbuffer_list/list.glsl"

// No filter and no bound: a block that covers every sample is the only surface of its pixel.
layout(constant_id = 13) const uint KEEPS_ALL = 1u;

layout(set = 0, binding = 9, scalar) readonly buffer Blocks {
    uint blocks[];
};

ivec2 source_pixel;
uint source_block;          // block to visit next
Coverage source_coverage;   // what it covers
bool source_ended;
uint source_sum;            // weights so far
uint source_background;     // samples without a surface

// The coverage that a block itself stores; with narrow pointers only the pixel's own block does.
Coverage own_coverage(uint block, uint normal) {
    if (POINTER_WORDS == 2u) {
        uint bits = blocks[pointer_word(block) + 1u];
        return Coverage(bits & 0xffu, bits >> 8);
    }
    return unpack_normal_coverage(normal);
}

void follow_pointer(uint from) {
    uint pointer = blocks[pointer_word(from)];
    source_block = pointer_block(pointer);
    source_ended = source_block == 0u;
    source_coverage = Coverage((pointer >> 26 & 7u) + 1u, pointer >> 29);
    if (POINTER_WORDS == 2u && !source_ended) {
        source_coverage = own_coverage(source_block, 0u);
    }
}

void source_begin(ivec2 pixel) {
    source_pixel = pixel;
    source_sum = 0u;
    source_background = 0u;
    source_block = uint(pixel.y) * frame.size_px.x + uint(pixel.x);
    source_ended = false;
    uint normal = blocks[normal_word(source_block)];
    source_coverage = own_coverage(source_block, normal);
    if (normal == 0u) {
        // The pixel's own block is empty; dynamic blocks may be linked from it all the same.
        follow_pointer(source_block);
    }
}

bool source_next(out Surface s, out uint weight) {
    if (source_ended) {
        // If the weights already sum to all samples there is no background, so the depth buffer is read only at edges.
        source_background = source_sum < SAMPLES ? samples_without_surface(source_pixel) : 0u;
        return false;
    }
    uint block = source_block;
    uint sample_index = source_coverage.index;
    weight = source_coverage.count;
    source_sum += weight;
    vec4 base = unpackUnorm4x8(blocks[color_word(block)]);
    uint roughness_occlusion = blocks[roughness_word(block)] >> (block & 1u) * 8u;
    s.base_color = linear_from_srgb(base.rgb);
    s.metallic = base.a;
    s.normal_ws = unpack_block_normal(blocks[normal_word(block)]);
    s.roughness = float(roughness_occlusion & 0xffu) / 255.0;
    s.occlusion = float(roughness_occlusion >> 16 & 0xffu) / 255.0;
    s.unlit = (roughness_occlusion & 0xffu) == 0u;
    s.emission = EMISSION_WORDS != 0u ? unpack_emission(blocks[emission_word(block)]) : vec3(0.0);
    if (DISTANCE_WORDS != 0u) {
        float distance_m = uintBitsToFloat(blocks[distance_word(block)]);
        s.position_ws = position_from_depth(ndc_from_pixel(uvec2(source_pixel)), depth_from_distance(distance_m));
    } else {
        float depth = SAMPLE_DEPTH(source_pixel, sample_index);
        vec2 ndc = ndc_from_sample(source_pixel, sample_index);
        if (KEEPS_ALL != 0u && weight == SAMPLES && SAMPLES > 1u && SAMPLES <= 8u) {
            // Depth is affine on the screen, and this sample stands opposite to sample 0: between them is the centre.
            int opposite = SAMPLES == 4u ? 3 : 1;
            depth = 0.5 * (SAMPLE_DEPTH(source_pixel, 0u) + SAMPLE_DEPTH(source_pixel, uint(opposite)));
            ndc = ndc_from_pixel(uvec2(source_pixel));
        }
        s.position_ws = position_from_depth(ndc, depth);
    }
    follow_pointer(block);
    return true;
}
