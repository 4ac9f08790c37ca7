// How finely a triangle is tessellated: edges of about TESSELLATE_PX pixels on screen (Schied and Dachsbacher 2015, section 5).
//
// In: three vertices of surface.vert.glsl#tessellation, world space. Out: the same, and the segments of each edge.
// An edge's segments are a function of its two ends alone, symmetric in them and `precise`: both triangles at an edge find
// the same number, and no crack opens. Patches that cannot be seen get no segments and are discarded here.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"

layout(vertices = 3) out;

layout(constant_id = 0) const float TESSELLATE_PX = 8.0;
layout(constant_id = 1) const float DISPLACEMENT_M = 0.0;
layout(constant_id = 2) const uint FACING = 0u;     // which side shows: 0 both, 1 counter-clockwise, 2 clockwise

layout(location = 0) flat in uvec2 vertex_draw_material[];
layout(location = 1) in vec4 vertex_uv0_uv1[];
layout(location = 2) in vec4 vertex_color[];
layout(location = 3) in vec3 vertex_position_ws[];
layout(location = 4) in vec3 vertex_normal_ws[];
layout(location = 5) in vec4 vertex_tangent_ws[];
#ifdef VELOCITY
layout(location = 6) in vec3 vertex_before_ws[];
#endif

layout(location = 0) patch out uvec2 patch_draw_material;
layout(location = 1) out vec4 patch_uv0_uv1[3];
layout(location = 2) out vec4 patch_color[3];
layout(location = 3) out vec3 patch_position_ws[3];
layout(location = 4) out vec3 patch_normal_ws[3];
layout(location = 5) out vec4 patch_tangent_ws[3];
#ifdef VELOCITY
layout(location = 6) out vec3 patch_before_ws[3];
#endif

const float MAX_SEGMENTS = 64.0;    // supported by every device that has tessellation

float row_dot(vec4 row, vec3 p) {
    precise float sum = row.x * p.x + row.y * p.y + row.z * p.z + row.w;
    return sum;
}

// Where a point stands on screen, pixels from its centre; points behind the near plane as if they stood on it.
vec2 screen_px(vec3 p) {
    vec4 k = frame.depth_to_distance;
    float near = k.y * k.z;     // w there; 0 under an orthographic view, where w is 1 everywhere
    precise vec2 px = vec2(row_dot(clip_row(0), p), row_dot(clip_row(1), p)) / max(row_dot(clip_row(3), p), near)
                    * (0.5 * vec2(frame.size_px));
    return px;
}

// Segments of the edge between two points of the screen, the same both ways round.
float segments(vec2 a_px, vec2 b_px) {
    precise vec2 along = a_px - b_px;
    precise float squared = along.x * along.x + along.y * along.y;
    precise float count = ceil(sqrt(squared) / TESSELLATE_PX);
    return clamp(count, 1.0, MAX_SEGMENTS);
}

// Whether a half-space of the view, inside where dot(xyz, p) + w >= 0, leaves out a triangle and all it may be displaced to.
bool outside(vec4 plane, vec3 a, vec3 b, vec3 c) {
    // Displacement moves a point by at most its amplitude along each axis.
    float margin = DISPLACEMENT_M * dot(abs(plane.xyz), vec3(1.0));
    return max(max(row_dot(plane, a), row_dot(plane, b)), row_dot(plane, c)) < -margin;
}

bool in_view(vec3 a, vec3 b, vec3 c) {
    vec4 x = clip_row(0);
    vec4 y = clip_row(1);
    vec4 z = clip_row(2);
    vec4 w = clip_row(3);
    return !(outside(w + x, a, b, c) || outside(w - x, a, b, c) || outside(w + y, a, b, c)
          || outside(w - y, a, b, c) || outside(w - z, a, b, c) || outside(z, a, b, c));
}

// Whether a flat triangle shows the side that is drawn. What is seen edge-on is left to the rasteriser's own test.
bool may_face(vec3 a, vec3 b, vec3 c) {
    if (FACING == 0u || DISPLACEMENT_M > 0.0) {
        return true;    // a displaced patch may turn to the eye in parts
    }
    vec3 normal = cross(b - a, c - a);
    vec3 to_eye = frame.eye_ws.xyz - a * frame.eye_ws.w;
    float facing = FACING == 1u ? dot(normal, to_eye) : -dot(normal, to_eye);
    return facing > -1e-3 * sqrt(dot(normal, normal) * dot(to_eye, to_eye));
}

void main() {
    patch_uv0_uv1[gl_InvocationID] = vertex_uv0_uv1[gl_InvocationID];
    patch_color[gl_InvocationID] = vertex_color[gl_InvocationID];
    patch_position_ws[gl_InvocationID] = vertex_position_ws[gl_InvocationID];
    patch_normal_ws[gl_InvocationID] = vertex_normal_ws[gl_InvocationID];
    patch_tangent_ws[gl_InvocationID] = vertex_tangent_ws[gl_InvocationID];
#ifdef VELOCITY
    patch_before_ws[gl_InvocationID] = vertex_before_ws[gl_InvocationID];
#endif
    if (gl_InvocationID != 0) {
        return;
    }
    patch_draw_material = vertex_draw_material[0];
    vec3 a = vertex_position_ws[0];
    vec3 b = vertex_position_ws[1];
    vec3 c = vertex_position_ws[2];
    // Outer level n belongs to the edge across from vertex n.
    vec3 edges = vec3(0.0);
    if (in_view(a, b, c) && may_face(a, b, c)) {
        vec2 a_px = screen_px(a);
        vec2 b_px = screen_px(b);
        vec2 c_px = screen_px(c);
        edges = vec3(segments(b_px, c_px), segments(c_px, a_px), segments(a_px, b_px));
    }
    gl_TessLevelOuter[0] = edges.x;
    gl_TessLevelOuter[1] = edges.y;
    gl_TessLevelOuter[2] = edges.z;
    gl_TessLevelInner[0] = ceil((edges.x + edges.y + edges.z) / 3.0);
}
