// From a triangle ID and a pixel to a SurfacePoint, with the differences of texture coordinates that its quad has.
//
// Barycentric coordinates come from homogeneous coordinates relative to the pixel (Olano and Greer 1997), which hold for
// triangles that cross the plane of the eye. With q_i = (x_i - x w_i, y_i - y w_i) of the clip positions, the pixel at
// (x, y), the coordinate of vertex 0 is cross(q_1, q_2) over the sum of all three.
#ifndef AFTERLIGHT_TRIANGLE
#define AFTERLIGHT_TRIANGLE
#define EXPLICIT_GRADIENTS
#include "frame.glsl"
#include "material.glsl"
#include "center_distance.glsl"

layout(set = 0, binding = 1) uniform utexture2D draw_data;
layout(set = 0, binding = 6, scalar) readonly buffer Positions {
    float positions_os[];       // three a vertex
};
layout(set = 0, binding = 7, scalar) readonly buffer Attributes {
    uint attributes[];          // seven a vertex: normal, tangent, uv0, uv1, colour
};
layout(set = 0, binding = 13, scalar) readonly buffer Indices {
    uint indices[];
};

float cross2(vec2 a, vec2 b) {
    return a.x * b.y - a.y * b.x;
}

// Perspective-correct barycentric coordinates at a pixel.
struct Barycentrics {
    vec3 at;
    float inverse_distance; // 1/m; of an orthographic camera 1
    bool counter_clockwise; // on the screen
};

Barycentrics barycentrics_at(vec2 ndc, vec3 p0, vec3 p1, vec3 p2) {   // p: clip x, y, w
    vec2 q0 = p0.xy - ndc * p0.z, q1 = p1.xy - ndc * p1.z, q2 = p2.xy - ndc * p2.z;
    vec3 b = vec3(cross2(q1, q2), cross2(q2, q0), cross2(q0, q1));
    Barycentrics r;
    // The sum times the distance at the pixel: the same at every pixel, also where the triangle's plane has ended before it, at the horizon.
    float sum = b.x + b.y + b.z, sum_distance = dot(b, vec3(p0.z, p1.z, p2.z));
    r.counter_clockwise = sum_distance < 0.0;
    r.inverse_distance = sum / sum_distance;
    r.at = b / sum;
    return r;
}

vec3 load_position(DrawData d, uint vertex) {
    uint i = vertex * 3u;
    return position_to_world(d.object_row0, d.object_row1, d.object_row2,
                             vec3(positions_os[i], positions_os[i + 1u], positions_os[i + 2u]));
}

vec3 clip_xyw(vec3 position_ws) {
    return (frame.clip_from_world * vec4(position_ws, 1.0)).xyw;
}

vec2 load_uv(uint first, uint offset) {
    return uintBitsToFloat(uvec2(attributes[first + offset], attributes[first + offset + 1u]));
}

// Unit normal of the vertex whose attributes begin at word `first`, world space.
vec3 load_normal(DrawData d, uint first) {
    bool mirrored = (d.flags & DRAW_MIRRORED) != 0u;
    return normal_to_world(d.object_row0, d.object_row1, d.object_row2, mirrored, unpack_normal(attributes[first]));
}

// Unit tangent of that vertex, world space, and the bitangent's sign.
vec4 load_tangent(DrawData d, uint first, vec3 normal_ws) {
    bool mirrored = (d.flags & DRAW_MIRRORED) != 0u;
    return tangent_to_world(d.object_row0, d.object_row1, d.object_row2, mirrored, unpack_tangent(attributes[first + 1u]), normal_ws);
}

// Vertices of a triangle, and its draw.
uvec3 triangle_vertices(uint id, DrawData d) {
    uint first = d.first_index + (id & ((1u << TRIANGLE_BITS) - 1u)) * 3u;
    return d.first_vertex + uvec3(indices[first], indices[first + 1u], indices[first + 2u]);
}

// Whether a triangle covers a point of the screen, and its depth there.
bool triangle_at(uint id, vec2 ndc, out float depth) {
    DrawData d = load_draw(draw_data, id >> TRIANGLE_BITS);
    uvec3 v = triangle_vertices(id, d);
    vec4 p0 = frame.clip_from_world * vec4(load_position(d, v.x), 1.0);
    vec4 p1 = frame.clip_from_world * vec4(load_position(d, v.y), 1.0);
    vec4 p2 = frame.clip_from_world * vec4(load_position(d, v.z), 1.0);
    vec2 q0 = p0.xy - ndc * p0.w, q1 = p1.xy - ndc * p1.w, q2 = p2.xy - ndc * p2.w;
    vec3 b = vec3(cross2(q1, q2), cross2(q2, q0), cross2(q0, q1));
    b /= b.x + b.y + b.z;
    float w = b.x * p0.w + b.y * p1.w + b.z * p2.w;
    depth = (b.x * p0.z + b.y * p1.z + b.z * p2.z) / w;
    return all(greaterThanEqual(b, vec3(0.0))) && w > 0.0;
}

// By what barycentric coordinates, and the inverse distance, at the upper left pixel of a quad differ from those beside and below it.
struct QuadBarycentrics {
    vec3 dx;
    vec3 dy;
    vec2 inverse_distance;
};

QuadBarycentrics quad_barycentrics(uvec2 pixel, vec3 p0, vec3 p1, vec3 p2) {
    uvec2 corner = pixel & ~1u;
    Barycentrics at = barycentrics_at(ndc_from_pixel(corner), p0, p1, p2);
    Barycentrics right = barycentrics_at(ndc_from_pixel(corner + uvec2(1u, 0u)), p0, p1, p2);
    Barycentrics below = barycentrics_at(ndc_from_pixel(corner + uvec2(0u, 1u)), p0, p1, p2);
    return QuadBarycentrics(right.at - at.at, below.at - at.at,
                            vec2(right.inverse_distance, below.inverse_distance) - at.inverse_distance);
}

// Texture coordinates that stand at word `offset` of the attributes of three vertices.
TextureCoordinates interpolate_uv(Barycentrics b, QuadBarycentrics quad, uvec3 first, uint offset) {
    mat3x2 uv = mat3x2(load_uv(first.x, offset), load_uv(first.y, offset), load_uv(first.z, offset));
    return TextureCoordinates(uv * b.at, finite_change(uv * quad.dx), finite_change(uv * quad.dy));
}

SurfacePoint triangle_point(uint id, vec2 ndc, out uint material) {
    DrawData d = load_draw(draw_data, id >> TRIANGLE_BITS);
    material = d.material;
    uvec3 v = triangle_vertices(id, d);
    vec3 p0 = load_position(d, v.x), p1 = load_position(d, v.y), p2 = load_position(d, v.z);
    vec3 c0 = clip_xyw(p0), c1 = clip_xyw(p1), c2 = clip_xyw(p2);
    Barycentrics b = barycentrics_at(ndc, c0, c1, c2);
    QuadBarycentrics quad = quad_barycentrics(uvec2((ndc * 0.5 + 0.5) * vec2(frame.size_px)), c0, c1, c2);

    bool mirrored = (d.flags & DRAW_MIRRORED) != 0u;
    uvec3 a = v * 7u;
    SurfacePoint p;
    p.position_ws = b.at.x * p0 + b.at.y * p1 + b.at.z * p2;
    float lit = center_inverse_distance(b.inverse_distance, quad.inverse_distance);
    if (lit != b.inverse_distance) {
        p.position_ws = position_from_depth(ndc, depth_from_distance(1.0 / lit));
    }
    p.front_facing = b.counter_clockwise != mirrored;
    vec3 n0 = load_normal(d, a.x), n1 = load_normal(d, a.y), n2 = load_normal(d, a.z);
    p.normal_ws = b.at.x * n0 + b.at.y * n1 + b.at.z * n2;
    p.tangent_ws = vec4(0.0);
    if (NORMAL_BUCKETS > 0u) {
        p.tangent_ws = b.at.x * load_tangent(d, a.x, n0) + b.at.y * load_tangent(d, a.y, n1) + b.at.z * load_tangent(d, a.z, n2);
    }
    p.uv0 = interpolate_uv(b, quad, a, 2u);
    p.uv1 = HAS_UV1 != 0u ? interpolate_uv(b, quad, a, 4u) : p.uv0;
    p.color = vec4(1.0);
    if (HAS_VERTEX_COLOR != 0u) {
        p.color = b.at.x * unpackUnorm4x8(attributes[a.x + 6u]) + b.at.y * unpackUnorm4x8(attributes[a.y + 6u])
                + b.at.z * unpackUnorm4x8(attributes[a.z + 6u]);
    }
    return p;
}

#endif
