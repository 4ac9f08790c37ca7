// From a record of the triangle buffer and a pixel to a SurfacePoint (Schied and Dachsbacher 2015, equation 2). Needs
// EXPLICIT_GRADIENTS.
#ifndef AFTERLIGHT_INTERPOLATE
#define AFTERLIGHT_INTERPOLATE
#include "surfaces/triangles/record.glsl"
#include "surfaces/geometry/packed_normals.glsl"
#include "center_distance.glsl"

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

// Texture coordinates at another pixel of the record's plane.
vec2 uv_at(uint word, vec2 from_anchor_px, vec3 inverse_w, vec2 step_px) {
    vec2 over_w = vec2(record_affine(word, from_anchor_px + step_px).x, record_affine(word + 3u, from_anchor_px + step_px).x);
    return over_w / (inverse_w.x + dot(inverse_w.yz, step_px));
}

// The same with changes as a quad of fragments has them: differences between its upper left pixel and the pixels beside and below it.
// `to_corner_px` leads from the pixel to that corner.
TextureCoordinates quad_uv(uint word, vec2 from_anchor_px, vec3 inverse_w, vec2 to_corner_px) {
    vec2 corner = uv_at(word, from_anchor_px, inverse_w, to_corner_px);
    return TextureCoordinates(uv_at(word, from_anchor_px, inverse_w, vec2(0.0)),
                              finite_change(uv_at(word, from_anchor_px, inverse_w, to_corner_px + vec2(1.0, 0.0)) - corner),
                              finite_change(uv_at(word, from_anchor_px, inverse_w, to_corner_px + vec2(0.0, 1.0)) - corner));
}

// The same with changes at the pixel's centre: what tangents follow.
TextureCoordinates analytic_uv(uint word, vec2 from_anchor_px, vec3 inverse_w, float w) {
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
    // Texture coordinates that do not change along the surface leave nothing.
    if (dot(tangent, tangent) < 0.5) {
        return vec4(fallback_tangent(n), 1.0);
    }
    return vec4(tangent, dot(cross(n, tangent), along_v) < 0.0 ? 1.0 : -1.0);
}

// Normal and tangent where tangents are kept: those of the vertices, weighted.
void interpolate_frame(uint record, vec2 from_anchor_px, float w, inout SurfacePoint p) {
    vec3 weights;
    weights.y = record_affine(record + 3u, from_anchor_px).x * w;
    weights.z = record_affine(record + 6u, from_anchor_px).x * w;
    weights.x = 1.0 - weights.y - weights.z;
    uvec3 normals = uvec3(triangle_buffer[record + 9u], triangle_buffer[record + 10u], triangle_buffer[record + 11u]);
    p.tangent_ws = vec4(0.0);
    if (TANGENTS == TANGENTS_WEIGHTED) {
        p.normal_ws = unpacked_normals(uvec4(normals, triangle_buffer[record + NORMAL_LENGTHS_WORD])) * weights;
        for (uint i = 0u; i < 3u; ++i) {
            uint word = record + TANGENT_WORD + 2u * i;
            p.tangent_ws += weights[i] * unpacked_tangent(uvec2(triangle_buffer[word], triangle_buffer[word + 1u]));
        }
    } else {
        p.normal_ws = mat3(unpack_normal(normals.x), unpack_normal(normals.y), unpack_normal(normals.z)) * weights;
        for (uint i = 0u; i < 3u; ++i) {
            p.tangent_ws += weights[i] * unpack_tangent(triangle_buffer[record + TANGENT_WORD + i]);
        }
    }
}

// Normal and tangent where the record has changes of the normal alone (Schied and Dachsbacher 2015, section 4.3). `p` has position and
// texture coordinates; the tangent follows the set that the material's normal map is seen through.
void find_frame(uint record, vec2 from_anchor_px, vec2 pixel_center, vec3 first_words, vec3 inverse_w, uint material,
                inout SurfacePoint p) {
    float w = 1.0 / inverse_w.x;
    p.normal_ws = vec3(record_affine(record + 3u, from_anchor_px).x, record_affine(record + 6u, from_anchor_px).x,
                       record_affine(record + 9u, from_anchor_px).x) * w;
    p.tangent_ws = vec4(0.0);
    if (NORMAL_BUCKETS > 0u) {
        // A step on the screen at one distance, then along the ray by the change of the distance. Not the difference to the position a pixel
        // on, which of a triangle seen at a flat angle may lie beyond the horizon of its plane.
        bool orthographic = frame.eye_ws.w == 0.0;
        vec3 ray = orthographic ? frame.distance_from_world.xyz : (frame.eye_ws.xyz - p.position_ws) / first_words.x;
        vec3 dp_dx = interpolated_position(first_words, pixel_center + vec2(1.0, 0.0)) - p.position_ws + ray * first_words.y;
        vec3 dp_dy = interpolated_position(first_words, pixel_center + vec2(0.0, 1.0)) - p.position_ws + ray * first_words.z;
        bool second_set = HAS_UV1 != 0u && (load_material(material).normal_slot & (1u << 24)) != 0u;
        uint word = second_set ? record + UV1_WORD : record + 12u;
        TextureCoordinates at = analytic_uv(word, from_anchor_px, inverse_w, w);
        p.tangent_ws = tangent_from_changes(p.normal_ws, dp_dx, dp_dy, at);
    }
}

// Whether a triangle found room. In a frame that has more triangles than room, some have no record.
bool has_record(uint index) {
    return index < record_room(triangle_buffer.length());
}

// First word of a record; of one that is not there, that of the last.
uint record_at(uint index) {
    return min(index, record_room(triangle_buffer.length()) - 1u) * RECORD_WORDS;
}

// `pixel` is a place in pixels, whole at pixel centres.
vec2 record_offset(uint record, vec2 pixel) {
    uint packed_anchor = triangle_buffer[record + 19u];
    return pixel - vec2(packed_anchor & 0xffffu, packed_anchor >> 16);
}

// View distance at which a triangle is lit in a pixel, m.
float record_distance(uint index, vec2 pixel) {
    uint record = record_at(index);
    vec3 first = record_affine(record, record_offset(record, pixel));
    return frame.eye_ws.w == 0.0 ? first.x : 1.0 / center_inverse_distance(first.x, first.yz);
}

SurfacePoint interpolated_point(uint index, vec2 pixel, out uint material) {
    uint record = record_at(index);
    vec2 from_anchor = record_offset(record, pixel);
    vec2 center = pixel + 0.5;
    vec3 first_words = record_affine(record, from_anchor);
    bool orthographic = frame.eye_ws.w == 0.0;
    vec3 inverse_w = orthographic ? vec3(1.0, 0.0, 0.0) : first_words;
    float w = 1.0 / inverse_w.x;
    if (!orthographic) {
        first_words.x = center_inverse_distance(first_words.x, first_words.yz);
    }
    material = triangle_buffer[record + 18u] & ~RECORD_FRONT;

    SurfacePoint p;
    p.position_ws = interpolated_position(first_words, center);
    p.front_facing = (triangle_buffer[record + 18u] & RECORD_FRONT) != 0u;
    vec2 to_corner = 2.0 * floor(0.5 * pixel) - pixel;
    p.uv0 = quad_uv(record + 12u, from_anchor, inverse_w, to_corner);
    p.uv1 = HAS_UV1 != 0u ? quad_uv(record + UV1_WORD, from_anchor, inverse_w, to_corner) : p.uv0;
    p.color = vec4(1.0);
    if (HAS_VERTEX_COLOR != 0u) {
        for (uint i = 0u; i < 4u; ++i) {
            p.color[i] = record_affine(record + COLOR_WORD + 3u * i, from_anchor).x * w;
        }
    }
    if (TANGENTS == TANGENTS_BY_DERIVATIVES) {
        find_frame(record, from_anchor, center, first_words, inverse_w, material, p);
    } else {
        interpolate_frame(record, from_anchor, w, p);
    }
    return p;
}

#endif
