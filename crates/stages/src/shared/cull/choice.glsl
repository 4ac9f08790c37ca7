// Whether a view needs a draw, and in which bin of distance it is.
//
// Every product and sum is `precise` and stands in the order of the CPU's, so that host and device come to the same bits: a compiler may neither
// fuse nor reorder them.
//
// CPU twin: DrawQuery in crates/frame/src/scene/draw_list.rs; transformed_bounds: Aabb::transformed in crates/scene/src/model.rs.
#ifndef AFTERLIGHT_CULL_CHOICE
#define AFTERLIGHT_CULL_CHOICE
#include "scene.glsl"

const uint ORDER_CENTER = 1u;
const uint ORDER_NEAR = 2u;
const uint BINS = 256u;             // BINS of crates/frame/src/scene/draw_list.rs: one for each thread of a group
const uint NO_BIN = 0xffffffffu;    // of a draw that is left out
const uint STEP_SHIFT = 20u;        // STEP_SHIFT of draw_list.rs

struct DrawChoiceConstants {
    vec4 planes[8];             // half-spaces that a draw must reach: inside where dot(xyz, p) + w >= 0
    vec4 distance_from_world;   // view distance, m: dot(xyz, p) + w; 1 under an orthographic camera
    vec3 eye_ws;
    float displacement_m;       // how far surfaces may be displaced along each axis
    float least_ratio;          // draws whose diagonal over their least view distance is less are left out
    uint order;                 // ORDER_CENTER, ORDER_NEAR, or as in the scene
    uint farthest_step;         // of the farthest distance of the scene
};

struct Bounds {
    vec3 low;
    vec3 high;
};

float dot_in_order(vec3 a, vec3 b) {
    precise float x = a.x * b.x, y = a.y * b.y, z = a.z * b.z;
    precise float xy = x + y;
    precise float xyz = xy + z;
    return xyz;
}

// The bounds and the number of indices of a draw, object space: two texels.
Bounds load_draw_bounds(utexture2D image, uint draw, out uint index_count) {
    ivec2 at = ivec2((draw & 511u) * 2u, draw >> 9);
    uvec4 low = texelFetch(image, at, 0), high = texelFetch(image, at + ivec2(1, 0), 0);
    index_count = low.w;
    return Bounds(uintBitsToFloat(low.xyz), uintBitsToFloat(high.xyz));
}

bool is_empty(Bounds b) {
    return any(greaterThan(b.low, b.high));
}

// The box of the eight corners of a box, moved from object to world space. Comparisons choose as on the CPU also where there is no number.
Bounds transformed_bounds(Bounds b, DrawData draw) {
    Bounds moved = Bounds(vec3(uintBitsToFloat(0x7f800000u)), vec3(uintBitsToFloat(0xff800000u)));
    if (is_empty(b)) {
        return moved;
    }
    vec4 rows[3] = vec4[3](draw.object_row0, draw.object_row1, draw.object_row2);
    for (uint i = 0u; i < 8u; ++i) {
        vec3 corner = mix(b.low, b.high, notEqual(uvec3(i) & uvec3(1u, 2u, 4u), uvec3(0u)));
        vec3 p;
        for (uint axis = 0u; axis < 3u; ++axis) {
            precise float turned = dot_in_order(rows[axis].xyz, corner) + rows[axis].w;
            p[axis] = turned;
        }
        moved.low = mix(p, moved.low, lessThan(moved.low, p));
        moved.high = mix(p, moved.high, greaterThan(moved.high, p));
    }
    return moved;
}

Bounds displaced(Bounds b, float displacement_m) {
    precise vec3 low = b.low - displacement_m, high = b.high + displacement_m;
    return Bounds(low, high);
}

bool reaches(vec4 plane, Bounds b) {
    vec3 farthest = mix(b.low, b.high, greaterThanEqual(plane.xyz, vec3(0.0)));
    precise float signed_distance = dot_in_order(plane.xyz, farthest) + plane.w;
    // What is no number is kept.
    return !(signed_distance < 0.0);
}

// Whether displaced bounds reach all half-spaces.
bool is_in_view(DrawChoiceConstants c, Bounds reached) {
    bool reaches_all = true;
    for (uint i = 0u; i < 8u; ++i) {
        reaches_all = reaches_all && reaches(c.planes[i], reached);
    }
    return reaches_all;
}

bool is_small(DrawChoiceConstants c, Bounds b) {
    precise vec3 size = b.high - b.low;
    precise vec3 center = (b.low + b.high) * 0.5;
    precise float center_m = dot_in_order(c.distance_from_world.xyz, center) + c.distance_from_world.w;
    precise float half_m = 0.5 * dot_in_order(abs(c.distance_from_world.xyz), size);
    precise float nearest_m = center_m - half_m;
    precise float least_m = c.least_ratio * nearest_m;
    precise float least_sq = least_m * least_m;
    return nearest_m > 0.0 && dot_in_order(size, size) < least_sq;
}

// Squared distance from the eye to what a draw is ordered by.
float order_distance_sq(DrawChoiceConstants c, Bounds b) {
    precise vec3 to_point;
    if (c.order == ORDER_NEAR) {
        vec3 low = mix(b.high, b.low, lessThan(b.low, b.high)), high = mix(b.low, b.high, greaterThan(b.high, b.low));
        vec3 point = mix(low, c.eye_ws, greaterThan(c.eye_ws, low));
        point = mix(high, point, lessThan(point, high));
        to_point = point - c.eye_ws;
    } else {
        precise vec3 center = (b.low + b.high) * 0.5;
        to_point = (is_empty(b) ? vec3(0.0) : center) - c.eye_ws;
    }
    return dot_in_order(to_point, to_point);
}

// The bin of a draw with those bounds, 0 the nearest; NO_BIN where it is left out.
uint bin_of(DrawChoiceConstants c, Bounds b) {
    Bounds reached = displaced(b, c.displacement_m);
    if (is_small(c, reached) || !is_in_view(c, reached)) {
        return NO_BIN;
    }
    if (c.order != ORDER_CENTER && c.order != ORDER_NEAR) {
        return 0u;
    }
    uint step = (floatBitsToUint(order_distance_sq(c, b)) >> STEP_SHIFT) + BINS - 1u;
    return min(step - min(step, c.farthest_step), BINS - 1u);
}

#endif
