// What the passes of a sort share: how many items there are, how they stand in batches, which digit of a key decides.
//
// A batch is 4,096 neighbouring items, the work of one group. A team is 32 threads of a group by their place in it, whatever the device's
// subgroups are: a bit of a word for each thread.
//
// CPU twin: crates/stages/src/shared/sort/twin.rs.
#ifndef AFTERLIGHT_SORT_ITEMS
#define AFTERLIGHT_SORT_ITEMS
#include "group_rows.glsl"

const uint DIGITS = 256u;           // values of a digit of 8 bits; DIGITS of mod.rs
const uint THREADS = 256u;          // of a group, one for each value of a digit
const uint ROUNDS = 16u;            // items of a thread
const uint BATCH_ITEMS = THREADS * ROUNDS;      // BATCH_ITEMS of mod.rs

layout(push_constant, scalar) uniform Push {
    uint shift;     // lowest bit of the digit
    uint most;      // number of items; where the device has the number, the room for them
} sort;

#ifdef COUNTED
layout(set = 0, binding = 8, scalar) readonly buffer SortDemand {
    uint items_needed;
};

uint item_count() {
    return min(items_needed, sort.most);
}
#else
uint item_count() {
    return sort.most;
}
#endif

uint batches_of(uint items) {
    return items / BATCH_ITEMS + min(items % BATCH_ITEMS, 1u);
}

uint batch_count() {
    return batches_of(item_count());
}

uint digit_of(uint key) {
    return key >> sort.shift & (DIGITS - 1u);
}

#endif
