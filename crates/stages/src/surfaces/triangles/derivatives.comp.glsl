// Writes the record of each visible triangle (Schied and Dachsbacher 2015, section 4.2 and appendix A). A thread a record, which searches
// for the triangle whose place that is. With LISTED the triangle's ID stands in its record, or with WHOLE_TRIANGLE its vertices.
//
// Departure: the paper clips triangles by shrinking them, since its barycentric coordinates (equations 3 and 4) need projected
// vertices. With homogeneous ones (Olano and Greer 1997) the edge functions b_i of the clip positions are affine on the screen as
// well, whatever lies behind the eye, and with det = sum b_i w_i it is 1/w = sum b_i / det and a/w = sum b_i a_i / det: equation 5
// without a clip.
//
// In: TriangleCount, the index, the scene. Out: TriangleBuffer; with RECORD_IDS the triangle ID of each record. Dispatch: by
// DispatchGroups of scan.comp.glsl, with LISTED of size.comp.glsl.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "group_rows.glsl"
#include "triangle.glsl"
#include "surfaces/triangles/record.glsl"
#include "surfaces/triangles/groups.glsl"
#include "surfaces/geometry/packed_normals.glsl"
#ifdef WHOLE_TRIANGLE
#include "surfaces/triangles/vertices.glsl"
#endif
#ifndef LISTED
#include "surfaces/triangles/place.glsl"
#endif

layout(local_size_x = 128) in;
layout(set = 0, binding = 8, scalar) buffer TriangleBuffer {
    uint triangle_buffer[];
};
layout(set = 0, binding = 10, scalar) readonly buffer TriangleCount {
    uint triangles_needed;
    uint triangles_dropped;
};
#ifdef RECORD_IDS
layout(set = 0, binding = 15, scalar) writeonly buffer RecordIds {
    uint record_ids[];
};
#endif
#ifdef SAMPLES_IN_KEYS
// VkDrawIndexedIndirectCommand: index count, 1, first index, vertex offset, draw.
layout(set = 0, binding = 9, scalar) readonly buffer DrawCommands {
    uint draw_commands[];
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

const float ROUNDING = 1.2e-7;  // spacing of floats at 1

// Magnitudes of the terms of cross2.
float sum2(vec2 a, vec2 b) {
    return abs(a.x * b.y) + abs(a.y * b.x);
}

// A triangle that is edge-on in floats shows where vertices are snapped to the raster's grid: the mean of its vertices.
Basis flat_basis(vec3 w) {
    vec3 in_front = vec3(greaterThan(w, vec3(0.0)));
    float count = max(dot(in_front, vec3(1.0)), 1.0);
    return Basis(in_front / (max(w, vec3(1e-30)) * count), vec3(0.0), vec3(0.0));
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

// A triangle's vertices, a column each.
struct TriangleVertices {
    mat3 position_ws;
    mat3 normal_ws;     // their lengths are weights
    mat3x4 tangent_ws;  // TANGENTS_OF_VERTICES; w: the bitangent's sign
    mat3x2 uv0;
    mat3x2 uv1;         // where the scene has them
    mat3x4 color;       // where the scene has them
    uint material;
    bool turned;        // WHOLE_TRIANGLE: the back faces the eye; else: the draw is mirrored
};

#ifdef WHOLE_TRIANGLE
uvec4 record_words(uint word) {
    return uvec4(triangle_buffer[word], triangle_buffer[word + 1u], triangle_buffer[word + 2u], triangle_buffer[word + 3u]);
}

mat3x2 stored_uv(uint word) {
    return mat3x2(uintBitsToFloat(record_words(word)), uintBitsToFloat(record_words(word + 2u).zw));
}

// The vertices that a fragment has stored in a record.
TriangleVertices stored_vertices(uint record) {
    TriangleVertices t;
    for (uint i = 0u; i < 3u; ++i) {
        t.position_ws[i] = uintBitsToFloat(record_words(record + 3u * i).xyz);
    }
    t.normal_ws = unpacked_normals(uvec4(record_words(record + 9u).xyz, triangle_buffer[record + 19u]));
    t.tangent_ws = mat3x4(0.0);     // they stay where they are
    t.uv0 = stored_uv(record + 12u);
    t.uv1 = HAS_UV1 != 0u ? stored_uv(record + UV1_WORD) : t.uv0;
    t.color = mat3x4(1.0);
    if (HAS_VERTEX_COLOR != 0u) {
        for (uint i = 0u; i < 3u; ++i) {
            t.color[i] = uintBitsToFloat(record_words(record + COLOR_WORD + 4u * i));
        }
    }
    t.material = triangle_buffer[record + 18u] & ~RECORD_FRONT;
    t.turned = (triangle_buffer[record + 18u] & RECORD_FRONT) == 0u;
    return t;
}
#else
// The vertices of the scene's triangle `triangle` of a draw.
TriangleVertices fetched_vertices(uint draw, uint triangle) {
    DrawData d = load_draw(draw_data, draw);
    uvec3 v = triangle_vertices(draw << TRIANGLE_BITS | triangle, d);
    uvec3 a = v * 7u;
    TriangleVertices t;
    t.material = d.material;
    t.turned = (d.flags & DRAW_MIRRORED) != 0u;
    t.color = mat3x4(1.0);
    for (uint i = 0u; i < 3u; ++i) {
        t.position_ws[i] = load_position(d, v[i]);
        t.normal_ws[i] = load_normal(d, a[i]);
        t.tangent_ws[i] = TANGENTS == TANGENTS_OF_VERTICES ? load_tangent(d, a[i], t.normal_ws[i]) : vec4(0.0);
        t.uv0[i] = load_uv(a[i], 2u);
        t.uv1[i] = HAS_UV1 != 0u ? load_uv(a[i], 4u) : t.uv0[i];
        if (HAS_VERTEX_COLOR != 0u) {
            t.color[i] = unpackUnorm4x8(attributes[a[i] + 6u]);
        }
    }
    return t;
}
#endif

// The edge functions of a triangle at an anchor, over their determinant.
Basis basis_at(vec2 anchor, vec3 c0, vec3 c1, vec3 c2, out float inverse_det) {
    vec2 ndc = (anchor + 0.5) * 2.0 / vec2(frame.size_px) - 1.0;
    vec2 pixel_ndc = 2.0 / vec2(frame.size_px);
    vec2 q0 = c0.xy - ndc * c0.z, q1 = c1.xy - ndc * c1.z, q2 = c2.xy - ndc * c2.z;
    vec3 w = vec3(c0.z, c1.z, c2.z);
    vec3 b = vec3(cross2(q1, q2), cross2(q2, q0), cross2(q0, q1));
    vec3 bx = vec3(w.z * q1.y - w.y * q2.y, w.x * q2.y - w.z * q0.y, w.y * q0.y - w.x * q1.y);
    vec3 by = vec3(w.y * q2.x - w.z * q1.x, w.z * q0.x - w.x * q2.x, w.x * q1.x - w.y * q0.x);
    float det = dot(b, w);
    inverse_det = 1.0 / det;
    // What rounding of clip positions and products may leave of a triangle that has no area.
    vec2 m0 = abs(c0.xy) + abs(w.x), m1 = abs(c1.xy) + abs(w.y), m2 = abs(c2.xy) + abs(w.z);
    vec3 lost = vec3(sum2(q1, m2) + sum2(m1, q2), sum2(q2, m0) + sum2(m2, q0), sum2(q0, m1) + sum2(m0, q1));
    if (!(abs(det) > ROUNDING * dot(lost, abs(w)))) {
        return flat_basis(w);
    }
    return Basis(b * inverse_det, bx * (inverse_det * pixel_ndc.x), by * (inverse_det * pixel_ndc.y));
}

void store_uv(uint word, Basis basis, mat3x2 uv) {
    for (uint i = 0u; i < 2u; ++i) {
        store(word + 3u * i, affine(basis, vec3(uv[0][i], uv[1][i], uv[2][i])));
    }
}

// Normals by their changes, or weights of vertices with the normals and tangents of those.
void store_frame(uint record, Basis basis, TriangleVertices t) {
    if (TANGENTS == TANGENTS_BY_DERIVATIVES) {
        for (uint i = 0u; i < 3u; ++i) {
            store(record + 3u + 3u * i, affine(basis, vec3(t.normal_ws[0][i], t.normal_ws[1][i], t.normal_ws[2][i])));
        }
        return;
    }
    store(record + 3u, Affine(basis.at.y, basis.dx.y, basis.dy.y));
    store(record + 6u, Affine(basis.at.z, basis.dx.z, basis.dy.z));
#ifdef WHOLE_TRIANGLE
    // Directions and tangents are where fragments have stored them; lengths make room for the anchor.
    triangle_buffer[record + NORMAL_LENGTHS_WORD] = triangle_buffer[record + 19u];
#else
    for (uint i = 0u; i < 3u; ++i) {
        triangle_buffer[record + 9u + i] = packed_direction(t.normal_ws[i]);
        triangle_buffer[record + TANGENT_WORD + i] = pack_tangent(t.tangent_ws[i]);
    }
#endif
}

void store_record(uint record, TriangleVertices t) {
    mat3 p = t.position_ws;
    vec3 c0 = clip_xyw(p[0]), c1 = clip_xyw(p[1]), c2 = clip_xyw(p[2]);
    vec2 anchor = anchor_px(c0, c1, c2);
    float inverse_det;
    Basis basis = basis_at(anchor, c0, c1, c2, inverse_det);
#ifdef WHOLE_TRIANGLE
    // As the rasteriser saw it: of a sliver, rounding may turn what is computed again.
    bool front = !t.turned;
#else
    // On the screen counter-clockwise where the edge functions' sum is negative where 1/w is positive: det < 0.
    bool front = (inverse_det < 0.0) != t.turned;
#endif
    vec3 of_w = vec3(1.0);
    if (frame.eye_ws.w == 0.0) {
        of_w = vec3(distance_from_position(p[0]), distance_from_position(p[1]), distance_from_position(p[2]));
    }
    store(record, affine(basis, of_w));
    store_frame(record, basis, t);
    store_uv(record + 12u, basis, t.uv0);
    triangle_buffer[record + 18u] = t.material | (front ? RECORD_FRONT : 0u);
    triangle_buffer[record + 19u] = uint(anchor.x) | uint(anchor.y) << 16;
    if (HAS_UV1 != 0u) {
        store_uv(record + UV1_WORD, basis, t.uv1);
    }
    if (HAS_VERTEX_COLOR != 0u) {
        for (uint i = 0u; i < 4u; ++i) {
            store(record + COLOR_WORD + 3u * i, affine(basis, vec3(t.color[0][i], t.color[1][i], t.color[2][i])));
        }
    }
}

void main() {
    uint index = group_number() * GROUP_TRIANGLES + gl_LocalInvocationID.x;
    if (index >= min(triangles_needed, record_room(triangle_buffer.length()))) {
        return;
    }
    uint record = index * RECORD_WORDS;
#ifdef WHOLE_TRIANGLE
    store_record(record, stored_vertices(record));
#else
#ifdef LISTED
    uint id = triangle_buffer[record];
#else
    uint id = visible_triangle(index);
#endif
    uint draw = id >> TRIANGLE_BITS, triangle = id & ((1u << TRIANGLE_BITS) - 1u);
#ifdef SAMPLES_IN_KEYS
    draw = draw_commands[draw * 5u + 4u];
#endif
#ifdef RECORD_IDS
    record_ids[index] = draw << TRIANGLE_BITS | triangle;
#endif
    store_record(record, fetched_vertices(draw, triangle));
#endif
}
