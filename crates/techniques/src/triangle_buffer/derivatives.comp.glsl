// Writes the record of each visible triangle (Schied and Dachsbacher 2015, section 4.2 and appendix A). A thread a triangle
// of the scene; those that do not show end at once. With LISTED a thread a stored triangle, whose ID stands in its record.
//
// Departure: the paper clips triangles by shrinking them, since its barycentric coordinates (equations 3 and 4) need projected
// vertices. With homogeneous ones (Olano and Greer 1997) the edge functions b_i of the clip positions are affine on the screen as
// well, whatever lies behind the eye, and with det = sum b_i w_i it is 1/w = sum b_i / det and a/w = sum b_i a_i / det: equation 5
// without a clip.
//
// In: the index, the scene. Out: TriangleBuffer. Dispatch: draws x 8; LISTED: as many as size.comp.glsl says.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "triangle.glsl"
#include "triangle_buffer/record.glsl"
#ifndef LISTED
#include "triangle_buffer/index.glsl"
#endif

layout(local_size_x = 128) in;
layout(set = 0, binding = 8, scalar) buffer TriangleBuffer {
    uint triangle_buffer[];
};
#ifdef LISTED
layout(set = 0, binding = 10, scalar) readonly buffer TriangleCount {
    uint triangles_needed;
    uint triangles_dropped;
};
#endif
#ifdef SAMPLES_IN_KEYS
// VkDrawIndexedIndirectCommand: index count, 1, first index, vertex offset, draw.
layout(set = 0, binding = 9, scalar) readonly buffer DrawCommands {
    uint draw_commands[];
};
#endif
layout(constant_id = 11) const uint TRIANGLE_CAPACITY = 0u;
#ifndef LISTED
layout(push_constant, scalar) uniform Push {
    uint first_draw;
};
#endif

// Affine functions on the screen: value at the anchor, changes a pixel.
struct Affine {
    float at, dx, dy;
};

struct Basis {
    vec3 at, dx, dy;    // b_i / det
};

Affine affine(Basis b, vec3 a) {
    return Affine(dot(b.at, a), dot(b.dx, a), dot(b.dy, a));
}

void store(uint word, Affine f) {
    triangle_buffer[word] = floatBitsToUint(f.at);
    triangle_buffer[word + 1u] = floatBitsToUint(f.dx);
    triangle_buffer[word + 2u] = floatBitsToUint(f.dy);
}

// A pixel on the triangle or near it, within the image: any keeps precision better than one far away.
vec2 anchor_px(vec3 c0, vec3 c1, vec3 c2) {
    vec2 sum = vec2(0.0);
    float count = 0.0;
    vec3 c[3] = vec3[](c0, c1, c2);
    for (int i = 0; i < 3; ++i) {
        if (c[i].z > 0.0) {
            vec2 px = (c[i].xy / c[i].z * 0.5 + 0.5) * vec2(frame.size_px);
            sum += clamp(px, vec2(0.0), vec2(frame.size_px));
            count += 1.0;
        }
    }
    return count > 0.0 ? floor(sum / count) : vec2(frame.size_px / 2u);
}

void main() {
#ifdef LISTED
    uint index = gl_GlobalInvocationID.x;
    if (index >= min(triangles_needed, TRIANGLE_CAPACITY)) {
        return;
    }
    uint id = triangle_buffer[index * RECORD_WORDS];
    uint draw_slot = id >> TRIANGLE_BITS, triangle = id & ((1u << TRIANGLE_BITS) - 1u);
#else
    uint draw_slot = first_draw + gl_WorkGroupID.x;
    uint triangle = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    uint id = draw_slot << TRIANGLE_BITS | triangle;
    if (!is_visible(id)) {
        return;
    }
    uint index = triangle_index(id);
    if (index >= TRIANGLE_CAPACITY) {
        return;
    }
#endif
#ifdef SAMPLES_IN_KEYS
    uint draw = draw_commands[draw_slot * 5u + 4u];
#else
    uint draw = draw_slot;
#endif
    DrawData d = load_draw(draw_data, draw);
    uvec3 v = triangle_vertices(draw << TRIANGLE_BITS | triangle, d);
    vec3 p0 = load_position(d, v.x), p1 = load_position(d, v.y), p2 = load_position(d, v.z);
    vec3 c0 = clip_xyw(p0), c1 = clip_xyw(p1), c2 = clip_xyw(p2);
    vec2 anchor = anchor_px(c0, c1, c2);
    vec2 ndc = (anchor + 0.5) * 2.0 / vec2(frame.size_px) - 1.0;
    vec2 pixel_ndc = 2.0 / vec2(frame.size_px);

    vec2 q0 = c0.xy - ndc * c0.z, q1 = c1.xy - ndc * c1.z, q2 = c2.xy - ndc * c2.z;
    vec3 w = vec3(c0.z, c1.z, c2.z);
    vec3 b = vec3(cross2(q1, q2), cross2(q2, q0), cross2(q0, q1));
    vec3 bx = vec3(w.z * q1.y - w.y * q2.y, w.x * q2.y - w.z * q0.y, w.y * q0.y - w.x * q1.y);
    vec3 by = vec3(w.y * q2.x - w.z * q1.x, w.z * q0.x - w.x * q2.x, w.x * q1.x - w.y * q0.x);
    float inverse_det = 1.0 / dot(b, w);
    Basis basis = Basis(b * inverse_det, bx * (inverse_det * pixel_ndc.x), by * (inverse_det * pixel_ndc.y));

    bool mirrored = (d.flags & DRAW_MIRRORED) != 0u;
    // On the screen counter-clockwise where the edge functions' sum is negative where 1/w is positive: det < 0.
    bool front = (inverse_det < 0.0) != mirrored;
    uvec3 a = v * 7u;
    uint record = index * RECORD_WORDS;
    vec3 of_w = vec3(1.0);
    if (frame.eye_ws.w == 0.0) {
        of_w = vec3(dot(frame.distance_from_world, vec4(p0, 1.0)), dot(frame.distance_from_world, vec4(p1, 1.0)),
                    dot(frame.distance_from_world, vec4(p2, 1.0)));
    }
    store(record, affine(basis, of_w));
    mat3 n = mat3(normal_to_world(d.object_row0, d.object_row1, d.object_row2, mirrored, unpack_normal(attributes[a.x])),
                  normal_to_world(d.object_row0, d.object_row1, d.object_row2, mirrored, unpack_normal(attributes[a.y])),
                  normal_to_world(d.object_row0, d.object_row1, d.object_row2, mirrored, unpack_normal(attributes[a.z])));
    for (uint i = 0u; i < 3u; ++i) {
        store(record + 3u + 3u * i, affine(basis, vec3(n[0][i], n[1][i], n[2][i])));
    }
    mat3x2 uv = mat3x2(load_uv(a.x, 2u), load_uv(a.y, 2u), load_uv(a.z, 2u));
    for (uint i = 0u; i < 2u; ++i) {
        store(record + 12u + 3u * i, affine(basis, vec3(uv[0][i], uv[1][i], uv[2][i])));
    }
    triangle_buffer[record + 18u] = d.material | (front ? RECORD_FRONT : 0u);
    triangle_buffer[record + 19u] = uint(anchor.x) | uint(anchor.y) << 16;
    if (HAS_UV1 != 0u) {
        mat3x2 uv1 = mat3x2(load_uv(a.x, 4u), load_uv(a.y, 4u), load_uv(a.z, 4u));
        for (uint i = 0u; i < 2u; ++i) {
            store(record + UV1_WORD + 3u * i, affine(basis, vec3(uv1[0][i], uv1[1][i], uv1[2][i])));
        }
    }
    if (HAS_VERTEX_COLOR != 0u) {
        mat3x4 color = mat3x4(unpackUnorm4x8(attributes[a.x + 6u]), unpackUnorm4x8(attributes[a.y + 6u]),
                              unpackUnorm4x8(attributes[a.z + 6u]));
        for (uint i = 0u; i < 4u; ++i) {
            store(record + COLOR_WORD + 3u * i, affine(basis, vec3(color[0][i], color[1][i], color[2][i])));
        }
    }
}
