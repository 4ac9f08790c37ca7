// What every pass of a frame knows: camera, image, counts.
//
// Twin: struct FrameConstants in crates/shader/src/structs.rs, checked at build.
// Spaces: world (metres), clip (Vulkan: y down, depth reversed, 1 near and 0 far). A "view distance" is measured
// along the view direction from the eye, in metres, positive in front of it.
#ifndef AFTERLIGHT_FRAME
#define AFTERLIGHT_FRAME
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_control_flow_attributes : enable

struct FrameConstants {
    mat4 clip_from_world;
    mat4 world_from_clip;
    vec4 depth_to_distance;     // view distance = (d x + y) / (d z + w) for a depth d
    vec4 distance_from_world;   // view distance of p = dot(xyz, p) + w
    vec4 eye_ws;                // (eye, 1), or (direction to the eye, 0) where the camera is orthographic
    uvec2 size_px;
    uvec2 tile_count;
    vec3 ambient_radiance;
    uint light_count;
    vec3 background_radiance;
    uint unbounded_light_count; // lights without an end, first in the list
    vec2 distance_range_m;      // nearest and farthest view distance that a surface of the scene can have, the first above 0
    uint samples;               // of a pixel
    uint frame_index;           // modulo 2^32; 0 of a view alone
    float time_s;               // of the scene; 0 of a view alone
    uint before;                // what of the frame before is of use: BEFORE_VIEW, BEFORE_HISTORY
    mat4 clip_from_world_before;    // of the frame before; this frame's where none was before
};

// Twins in crates/frame/src/time.rs.
const uint BEFORE_VIEW = 1u;    // the frame before shows the same scene, and the camera has not jumped since
const uint BEFORE_HISTORY = 2u; // resources with history hold what that frame wrote

layout(set = 0, binding = 0, scalar) uniform FrameBlock {
    FrameConstants frame;
};

const float PI = 3.14159265358979;

// Row of clip_from_world: what a clip coordinate is the dot product of a world position with.
vec4 clip_row(int row) {
    mat4 m = frame.clip_from_world;
    return vec4(m[0][row], m[1][row], m[2][row], m[3][row]);
}

// Centre of a pixel in normalised device coordinates.
vec2 ndc_from_pixel(uvec2 pixel) {
    return (vec2(pixel) + 0.5) * 2.0 / vec2(frame.size_px) - 1.0;
}

// World position of a point of the depth buffer.
vec3 position_from_depth(vec2 ndc, float depth) {
    vec4 p = frame.world_from_clip * vec4(ndc, depth, 1.0);
    return p.xyz / p.w;
}

// View distance in metres of a point, negative behind the eye.
float distance_from_position(vec3 position_ws) {
    return dot(frame.distance_from_world, vec4(position_ws, 1.0));
}

// Depth of a point, as the raster part computes it of a vertex.
float depth_from_position(vec3 position_ws) {
    vec4 p = vec4(position_ws, 1.0);
    return dot(clip_row(2), p) / dot(clip_row(3), p);
}

// View distance in metres of a depth; infinite at depth 0 under perspective.
float distance_from_depth(float depth) {
    vec4 k = frame.depth_to_distance;
    return (depth * k.x + k.y) / (depth * k.z + k.w);
}

// Depth of a view distance, the inverse of distance_from_depth.
float depth_from_distance(float distance_m) {
    vec4 k = frame.depth_to_distance;
    return (distance_m * k.w - k.y) / (k.x - distance_m * k.z);
}

// Unit vector from a point to the eye.
vec3 view_direction(vec3 position_ws) {
    return normalize(frame.eye_ws.xyz - position_ws * frame.eye_ws.w);
}

#endif
