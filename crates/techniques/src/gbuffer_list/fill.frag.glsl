// Builds the lists as the paper does (Fridvalszky and Toth 2020, section 3): after a depth pre-pass each fragment knows by
// post-depth coverage which samples it shows; the one with sample 0 writes the pixel's own block, others take one from the
// counter and link it.
//
// In: gbuffer_depth (for filters). Out: Blocks, BlockCount; with ALPHA_MASK SampleClaims.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_post_depth_coverage : require
#include "shading.glsl"
#include "surface_in.glsl"
#include "gbuffer_list/build_list.glsl"
#include "gbuffer_list/filter.glsl"
#include "surfaces/claims/claims.glsl"

layout(early_fragment_tests) in;
layout(post_depth_coverage) in;

void main() {
    Surface s = visible_surface();
    float distance_m = distance_from_position(s.position_ws);

    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uint head = pixel_block(pixel);
    uint mask = uint(gl_SampleMaskIn[0]);
#ifdef ALPHA_MASK
    mask = claim(head, mask);
#endif
    if (mask == 0u) {
        return;
    }
    bool single_pixel = FILTERS != 0u && single_sample_pixel(pixel);
    bool single = single_pixel || FILTERS != 0u && single_sample_surface(draw_material.x, distance_m);
    Coverage own = Coverage(uint(bitCount(mask)), uint(findLSB(mask)));
    if (own.index == 0u) {
        // Other surfaces of the pixel may be stored too, so a filtered surface weighs only the samples that it covers.
        own.count = single_pixel ? SAMPLES : own.count;
        store_block(head, s, distance_m, own);
    } else if (!single) {
        uint place = atomicAdd(blocks_needed, 1u);
        if (place < BLOCK_CAPACITY) {
            uint block = frame.size_px.x * frame.size_px.y + place;
            store_block(block, s, distance_m, own);
            uint next = atomicExchange(blocks[pointer_word(head)], pack_pointer(block, own));
            blocks[pointer_word(block)] = next;
        } else {
            atomicAdd(samples_dropped, own.count);
        }
    }
}
