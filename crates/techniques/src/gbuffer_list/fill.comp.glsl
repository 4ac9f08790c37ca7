// Builds the lists from a multisampled visibility buffer: one thread a pixel finds the triangles that show in it,
// interpolates and evaluates each once and writes its blocks.
//
// Departure from the paper, whose lists are filled by a second raster pass: no second pass over the geometry, no stencil bit
// against double writes, since a sample's triangle is one; a pixel's blocks are neighbours in memory. Where a pixel keeps one
// sample (a filter, or no blocks left) it is the surface at the pixel's centre, as at one sample a pixel.
//
// In: ids, RGBA8 as 32 bits, and gbuffer_depth, or the keys of compute_raster; the scene. Out: Blocks, BlockCount. Dispatch: 8x8 groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#define EXPLICIT_GRADIENTS
#include "shading.glsl"
#include "triangle.glsl"
#include "gbuffer_list/build_list.glsl"
#include "gbuffer_list/filter.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
#define IDS_BINDING 8
#include "surfaces/visible/triangles.glsl"

ivec2 pixel;

float sample_distance(uint i) {
    return distance_from_depth(SAMPLE_DEPTH(pixel, i));
}

bool is_filtered(Visible v) {
    return FILTERS != 0u && single_sample_surface(triangle_id(v.id) >> TRIANGLE_BITS, sample_distance(uint(findLSB(v.samples))));
}

// Takes the next triangle that a block is written for; `NO_TRIANGLE` where there is none left.
Visible next_stored(inout uint mask) {
    while (mask != 0u) {
        Visible v = take_triangle(pixel, mask);
        if (v.id != NO_TRIANGLE && !is_filtered(v)) {
            return v;
        }
    }
    return Visible(NO_TRIANGLE, 0u);
}

// The surface at the pixel's centre, which may be none.
Visible center_triangle() {
    vec2 ndc = ndc_from_pixel(uvec2(pixel));
    Visible nearest = Visible(NO_TRIANGLE, 0u), most = nearest;
    float nearest_depth = -1.0;
    bool background = false;
    for (uint mask = all_samples(); mask != 0u;) {
        Visible v = take_triangle(pixel, mask);
        if (v.id == NO_TRIANGLE) {
            background = true;
            continue;
        }
        float depth;
        if (triangle_at(triangle_id(v.id), ndc, depth) && depth > nearest_depth) {
            nearest_depth = depth;
            nearest = v;
        }
        if (bitCount(v.samples) > bitCount(most.samples)) {
            most = v;
        }
    }
    // A triangle may miss the pixel's centre and still show in every sample.
    return nearest.id != NO_TRIANGLE || background ? nearest : most;
}

// The detector of our own: surfaces of a pixel differ in material, in their normals, or lie apart by more than the pixel sees
// of them. Edges between triangles of one smooth surface do not count.
bool surfaces_differ() {
    vec2 ndc = ndc_from_pixel(uvec2(pixel));
    uint mask = all_samples();
    uint first_material, material;
    Visible v = take_triangle(pixel, mask);
    if (v.id == NO_TRIANGLE) {
        return mask != 0u;
    }
    SurfacePoint first = triangle_point(triangle_id(v.id), ndc, first_material);
    vec3 normal = unit_or_zero(first.normal_ws);
    // World size of a pixel at this distance, m.
    float distance_m = sample_distance(uint(findLSB(v.samples)));
    vec3 right = position_from_depth(ndc + vec2(2.0 / float(frame.size_px.x), 0.0), depth_from_distance(distance_m))
               - position_from_depth(ndc, depth_from_distance(distance_m));
    float pixel_m = length(right);
    while (mask != 0u) {
        v = take_triangle(pixel, mask);
        if (v.id == NO_TRIANGLE) {
            return true;
        }
        SurfacePoint point = triangle_point(triangle_id(v.id), ndc, material);
        // Where the surface shows, not at the centre, which it may not cover.
        uint i = uint(findLSB(v.samples));
        vec3 shown_ws = position_from_depth(ndc_from_sample(pixel, i), SAMPLE_DEPTH(pixel, i));
        float apart_m = abs(dot(normal, shown_ws - first.position_ws));
        if (material != first_material || dot(normal, unit_or_zero(point.normal_ws)) < 1.0 - EDGE_THRESHOLD
            || apart_m > 2.0 * pixel_m) {
            return true;
        }
    }
    return false;
}

void main() {
    pixel = ivec2(gl_GlobalInvocationID.xy);
    bool inside = all(lessThan(gl_GlobalInvocationID.xy, frame.size_px));

    // The triangles to store, and the samples of those that are not stored.
    uint stored = 0u, covered = 0u, stored_samples = 0u;
    bool single = false;
    if (inside) {
        for (uint mask = all_samples(); mask != 0u;) {
            Visible v = take_triangle(pixel, mask);
            if (v.id != NO_TRIANGLE) {
                covered |= v.samples;
                if (!is_filtered(v)) {
                    ++stored;
                    stored_samples |= v.samples;
                }
            }
        }
        single = covered != 0u
            && (stored == 0u || FILTERS != 0u && single_sample_pixel(pixel)
                || stored > 1u && (FILTERS & FILTER_EDGES) != 0u && !surfaces_differ()
                || stored == 1u && covered != all_samples() && (FILTERS & FILTER_EDGES) != 0u && !surfaces_differ());
    }

    uint wanted = single ? 0u : max(stored, 1u) - 1u;
    uint place = subgroupExclusiveAdd(wanted);
    uint of_subgroup = subgroupAdd(wanted);
    uint base = 0u;
    if (subgroupElect() && of_subgroup > 0u) {
        base = atomicAdd(blocks_needed, of_subgroup);
    }
    place += subgroupBroadcastFirst(base);
    if (covered == 0u) {
        return;
    }
    bool overflow = wanted > 0u && (place > BLOCK_CAPACITY || wanted > BLOCK_CAPACITY - place);

    uint block = pixel_block(pixel);
    uint dynamic = frame.size_px.x * frame.size_px.y + place;
    uint mask = all_samples();
    uint weight_of_first = uint(bitCount(covered & ~stored_samples));  // samples of triangles that are not stored count for the first block
    Visible current;
    if (single || overflow) {
        current = center_triangle();
        mask = 0u;
        if (overflow) {
            atomicAdd(samples_dropped, uint(bitCount(covered & ~current.samples)));
        }
    } else {
        current = next_stored(mask);
    }
    Coverage own = Coverage(uint(bitCount(current.samples)) + weight_of_first, uint(findLSB(current.samples)));
    if (single || overflow) {
        own.count = SAMPLES;
    }
    while (current.id != NO_TRIANGLE) {
        uint material;
        SurfacePoint point = triangle_point(triangle_id(current.id), ndc_from_pixel(uvec2(pixel)), material);
        MaterialData m = load_material(material);
        Surface s = surface_at(m, point, base_color_at(m, point).rgb);
        float distance_m = distance_from_position(s.position_ws);
        store_block(block, s, distance_m, own);

        Visible next = next_stored(mask);
        Coverage of_next = Coverage(uint(bitCount(next.samples)), uint(findLSB(next.samples)));
        if (next.id != NO_TRIANGLE) {
            blocks[pointer_word(block)] = pack_pointer(dynamic, of_next);
            block = dynamic++;
        }
        current = next;
        own = of_next;
    }
}
