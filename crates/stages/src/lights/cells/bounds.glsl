// The space that a cell takes, and which lights and boxes of lights touch it. The tests are conservative: they may pass a light that
// touches nothing, but never miss one that touches the cell.
//
// CPU twin: crates/oracle/src/clusters.rs.
#ifndef AFTERLIGHT_CLUSTER_BOUNDS
#define AFTERLIGHT_CLUSTER_BOUNDS
#include "lights/cells/grid.glsl"
#include "lights/bvh/boxes.glsl"

// A part of the view: a frustum cut off at two view distances, the box around it along the camera's axes, and the one along
// the world's.
struct CellBounds {
    vec4 left, right, top, bottom;  // half-spaces, inside >= 0
    vec3 across, down;              // unit axes; the third coordinate of the box is the view distance
    vec3 low, high;
    vec3 low_ws, high_ws;
    vec4 sphere;                    // around all corners, world space
    uint steps;                     // see Cell
};

void include_corner(inout CellBounds b, vec2 ndc, float distance_m) {
    vec3 p = position_from_depth(ndc, depth_from_distance(distance_m));
    vec3 at = vec3(dot(b.across, p), dot(b.down, p), distance_m);
    b.low = min(b.low, at);
    b.high = max(b.high, at);
    b.low_ws = min(b.low_ws, p);
    b.high_ws = max(b.high_ws, p);
}

CellBounds cell_bounds(Cell cell) {
    uint tile = DIVISION == CLUSTERS ? cell.number / SLICES : cell.number;
    uvec2 first = uvec2(tile % tiles_across(), tile / tiles_across()) * LIGHT_TILE_PX;
    vec2 low = vec2(first) * 2.0 / vec2(frame.size_px) - 1.0;
    vec2 high = vec2(min(first + LIGHT_TILE_PX, frame.size_px)) * 2.0 / vec2(frame.size_px) - 1.0;
    vec4 x = clip_row(0), y = clip_row(1), w = clip_row(3);
    CellBounds b;
    b.left = unit_plane(x - low.x * w);
    b.right = unit_plane(high.x * w - x);
    b.top = unit_plane(y - low.y * w);
    b.bottom = unit_plane(high.y * w - y);
    vec3 forward = frame.distance_from_world.xyz;
    b.across = normalize(x.xyz - dot(x.xyz, forward) * forward);
    b.down = cross(forward, b.across);
    b.low = b.low_ws = vec3(3.402823e38);
    b.high = b.high_ws = vec3(-3.402823e38);
    for (uint end = 0u; end < 2u; ++end) {
        float distance_m = end == 0u ? cell.nearest_m : cell.farthest_m;
        include_corner(b, low, distance_m);
        include_corner(b, vec2(high.x, low.y), distance_m);
        include_corner(b, vec2(low.x, high.y), distance_m);
        include_corner(b, high, distance_m);
    }
    b.sphere = vec4(0.5 * (b.low_ws + b.high_ws), 0.5 * distance(b.low_ws, b.high_ws));
    b.steps = cell.steps;
    return b;
}

// Whether a box lies completely outside of a half-space.
bool is_outside(vec4 plane, vec3 centre, vec3 half_size) {
    return dot(plane, vec4(centre, 1.0)) + dot(abs(plane.xyz), half_size) < 0.0;
}

bool cell_touches_box(CellBounds b, LightBox box) {
    vec3 centre = 0.5 * (box.low + box.high), half_size = 0.5 * (box.high - box.low);
    float distance_m = distance_from_position(centre);
    float reach_m = dot(abs(frame.distance_from_world.xyz), half_size);
    return all(lessThanEqual(box.low, b.high_ws)) && all(greaterThanEqual(box.high, b.low_ws)) &&
           distance_m + reach_m >= b.low.z && distance_m - reach_m <= b.high.z &&
           !is_outside(b.left, centre, half_size) && !is_outside(b.right, centre, half_size) &&
           !is_outside(b.top, centre, half_size) && !is_outside(b.bottom, centre, half_size);
}

// Whether any step of the cell that holds a surface lies between two view distances.
bool touches_steps(CellBounds b, float nearest_m, float farthest_m) {
    if (DIVISION != TILES_25D) {
        return true;
    }
    uint first = step_of(nearest_m, b.low.z, b.high.z), last = step_of(farthest_m, b.low.z, b.high.z);
    return (b.steps & (0xffffffffu << first) & (0xffffffffu >> (31u - last))) != 0u;
}

// A sphere passes if it touches the box along the camera's axes and lies outside of no side plane of the frustum. At corners each of
// the two tests rejects spheres that the other would pass.
bool cell_touches_sphere(CellBounds b, vec4 sphere) {
    vec4 centre = vec4(sphere.xyz, 1.0);
    float range_m = sphere.w;
    vec3 at = vec3(dot(b.across, centre.xyz), dot(b.down, centre.xyz), dot(frame.distance_from_world, centre));
    vec3 outside = max(max(b.low - at, at - b.high), 0.0);
    float inside = min(min(dot(b.left, centre), dot(b.right, centre)), min(dot(b.top, centre), dot(b.bottom, centre)));
    return inside >= -range_m && dot(outside, outside) <= range_m * range_m &&
           touches_steps(b, at.z - range_m, at.z + range_m);
}

// An endless cone passes if it comes within the radius of the sphere around the cell. A cone wider than a half-space always passes.
bool cell_touches_cone(CellBounds b, vec3 apex, vec3 axis, float cos_angle) {
    if (cos_angle <= 0.0) {
        return true;
    }
    vec3 to_cell = b.sphere.xyz - apex;
    float along_m = dot(to_cell, axis);
    float aside_m = sqrt(max(dot(to_cell, to_cell) - along_m * along_m, 0.0));
    float sin_angle = sqrt(max(1.0 - cos_angle * cos_angle, 0.0));
    // Distance to the cone's side; valid where the nearest point of the cone lies on its side and is not its apex.
    bool beside_apex = along_m * cos_angle + aside_m * sin_angle < 0.0;
    float outside_m = beside_apex ? length(to_cell) : aside_m * cos_angle - along_m * sin_angle;
    return outside_m <= b.sphere.w;
}

#endif
