// From a record of the triangle buffer and a pixel to a SurfacePoint (Schied and Dachsbacher 2015, equation 2). Needs
// EXPLICIT_GRADIENTS.
#ifndef AFTERLIGHT_INTERPOLATE
#define AFTERLIGHT_INTERPOLATE
#include "surfaces/triangles/record.glsl"

layout(set = 0, binding = 20, scalar) readonly buffer TriangleBuffer {
    uint triangle_buffer[];
};

float record_float(uint word) {
    return uintBitsToFloat(triangle_buffer[word]);
}

// Value over w at a pixel, and its changes.
vec3 record_affine(uint word, vec2 from_anchor_px) {
    vec3 f = vec3(record_float(word), record_float(word + 1u), record_float(word + 2u));
    return vec3(f.x + dot(f.yz, from_anchor_px), f.yz);
}

// (a, da/dx, da/dy) of an attribute from a/w and 1/w with their changes: the quotient rule.
vec3 divided(vec3 over_w, vec3 inverse_w, float w) {
    float a = over_w.x * w;
    return vec3(a, (over_w.yz - a * inverse_w.yz) * w);
}

TextureCoordinates interpolated_uv(uint word, vec2 from_anchor_px, vec3 inverse_w, float w) {
    vec3 u = divided(record_affine(word, from_anchor_px), inverse_w, w);
    vec3 v = divided(record_affine(word + 3u, from_anchor_px), inverse_w, w);
    return TextureCoordinates(vec2(u.x, v.x), vec2(u.y, v.y), vec2(u.z, v.z));
}

// World position at a pixel from the first three words.
vec3 interpolated_position(vec3 first_words, vec2 pixel_center) {
    float distance_m = frame.eye_ws.w == 0.0 ? first_words.x : 1.0 / first_words.x;
    return position_from_depth(pixel_center * 2.0 / vec2(frame.size_px) - 1.0, depth_from_distance(distance_m));
}

// Tangent by the changes of position and texture coordinates (Schueler 2007), and the bitangent's sign: glTF's green channel
// points against v.
vec4 tangent_from_changes(vec3 normal_ws, vec3 dp_dx, vec3 dp_dy, TextureCoordinates at) {
    float det = at.ddx.x * at.ddy.y - at.ddx.y * at.ddy.x;
    vec3 along_u = (dp_dx * at.ddy.y - dp_dy * at.ddx.y) * sign(det);
    vec3 along_v = (dp_dy * at.ddx.x - dp_dx * at.ddy.x) * sign(det);
    vec3 n = unit_or_zero(normal_ws);
    vec3 tangent = unit_or_zero(along_u - n * dot(n, along_u));
    return vec4(tangent, dot(cross(n, tangent), along_v) < 0.0 ? 1.0 : -1.0);
}

uint record_capacity() {
    return uint(triangle_buffer.length()) / RECORD_WORDS;
}

// Whether a triangle found room. In a frame that has more triangles than room, some have no record.
bool has_record(uint index) {
    return index < record_capacity();
}

// First word of a record; of one that is not there, that of the last.
uint record_at(uint index) {
    return min(index, record_capacity() - 1u) * RECORD_WORDS;
}

// `pixel` is a place in pixels, whole at pixel centres.
vec2 record_offset(uint record, vec2 pixel) {
    uint packed_anchor = triangle_buffer[record + 19u];
    return pixel - vec2(packed_anchor & 0xffffu, packed_anchor >> 16);
}

// View distance of a triangle's plane, m.
float record_distance(uint index, vec2 pixel) {
    uint record = record_at(index);
    float first = record_affine(record, record_offset(record, pixel)).x;
    return frame.eye_ws.w == 0.0 ? first : 1.0 / first;
}

SurfacePoint interpolated_point(uint index, vec2 pixel, out uint material) {
    uint record = record_at(index);
    vec2 from_anchor = record_offset(record, pixel);
    vec2 center = pixel + 0.5;
    vec3 first_words = record_affine(record, from_anchor);
    bool orthographic = frame.eye_ws.w == 0.0;
    vec3 inverse_w = orthographic ? vec3(1.0, 0.0, 0.0) : first_words;
    float w = 1.0 / inverse_w.x;
    material = triangle_buffer[record + 18u] & ~RECORD_FRONT;

    SurfacePoint p;
    p.position_ws = interpolated_position(first_words, center);
    p.front_facing = (triangle_buffer[record + 18u] & RECORD_FRONT) != 0u;
    p.normal_ws = vec3(record_affine(record + 3u, from_anchor).x, record_affine(record + 6u, from_anchor).x,
                       record_affine(record + 9u, from_anchor).x) * w;
    p.uv0 = interpolated_uv(record + 12u, from_anchor, inverse_w, w);
    p.uv1 = HAS_UV1 != 0u ? interpolated_uv(record + UV1_WORD, from_anchor, inverse_w, w) : p.uv0;
    p.color = vec4(1.0);
    if (HAS_VERTEX_COLOR != 0u) {
        for (uint i = 0u; i < 4u; ++i) {
            p.color[i] = record_affine(record + COLOR_WORD + 3u * i, from_anchor).x * w;
        }
    }
    p.tangent_ws = vec4(0.0);
    if (NORMAL_BUCKETS > 0u) {
        vec3 right = record_affine(record, from_anchor + vec2(1.0, 0.0));
        vec3 below = record_affine(record, from_anchor + vec2(0.0, 1.0));
        vec3 dp_dx = interpolated_position(right, center + vec2(1.0, 0.0)) - p.position_ws;
        vec3 dp_dy = interpolated_position(below, center + vec2(0.0, 1.0)) - p.position_ws;
        p.tangent_ws = tangent_from_changes(p.normal_ws, dp_dx, dp_dy, p.uv0);
    }
    return p;
}

#endif
