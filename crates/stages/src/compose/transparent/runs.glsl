// Runs: triangles that follow each other in the order and are of one draw are one indirect command.
#ifndef AFTERLIGHT_TRANSPARENT_RUNS
#define AFTERLIGHT_TRANSPARENT_RUNS
#include "compose/transparent/order.glsl"

layout(set = 0, binding = 9, scalar) readonly buffer Keys {
    uint keys[];
};
layout(set = 0, binding = 10, scalar) readonly buffer Values {
    uint values[];
};

bool is_in_view_at(uint place) {
    return place < triangle_count && keys[place] != NO_KEY;
}

uint draw_at(uint place) {
    return triangles[values[place]].draw;
}

// Whether a run begins, or ends, with the triangle at a place of the order.
bool begins_run(uint place) {
    return is_in_view_at(place) && (place == 0u || draw_at(place - 1u) != draw_at(place));
}
bool ends_run(uint place) {
    return is_in_view_at(place) && (!is_in_view_at(place + 1u) || draw_at(place + 1u) != draw_at(place));
}

#endif
