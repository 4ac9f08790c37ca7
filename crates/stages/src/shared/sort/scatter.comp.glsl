// Moves every item behind those with a lower digit, and behind those with the same digit that stood before it: a group a batch, in rows. The
// group first sorts its batch in shared memory, so that neighbouring threads write neighbouring items (satish-2009).
//
// In: Keys, Values, Histogram (as scan.comp leaves it), DigitTotals. Out: KeysOut, ValuesOut.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#include "shared/sort/items.glsl"
#include "group_sum.glsl"

layout(set = 0, binding = 9, scalar) readonly buffer Keys {
    uint keys[];
};
layout(set = 0, binding = 10, scalar) readonly buffer Values {
    uint values[];
};
layout(set = 0, binding = 11, scalar) readonly buffer Histogram {
    uint histogram[];
};
layout(set = 0, binding = 12, scalar) readonly buffer DigitTotals {
    uint digit_totals[];
};
layout(set = 0, binding = 13, scalar) writeonly buffer KeysOut {
    uint keys_out[];
};
layout(set = 0, binding = 14, scalar) writeonly buffer ValuesOut {
    uint values_out[];
};

const uint TEAM_THREADS = 32u;      // bits of a word
const uint TEAMS = THREADS / TEAM_THREADS;
const uint NO_ITEM = 0xffffffffu;   // key in places past the last item: its digit is the highest, so that it stays behind all items

// First the marks of two rounds, a word for each digit of each team; then the batch in its new order.
shared uint pool[BATCH_ITEMS];
// For each team and digit the items of the team's rounds so far; then the place in the batch of the team's first item of the digit.
shared uint places[TEAMS * DIGITS];
// For each digit how far its items move from their place in the sorted batch, modulo 2^32.
shared uint moves[DIGITS];

uint team() {
    return gl_LocalInvocationIndex / TEAM_THREADS;
}

uint lane() {
    return gl_LocalInvocationIndex % TEAM_THREADS;
}

// The item that this thread reads in a round. A team reads neighbours, and its rounds follow each other, so that the order of items is that of
// teams, rounds and lanes.
uint item_of(uint batch, uint round) {
    return batch * BATCH_ITEMS + (team() * ROUNDS + round) * TEAM_THREADS + lane();
}

// Number of items of the same team and digit in the rounds before, and in this round in lower lanes. Threads of one digit meet by a bit each
// in a word of shared memory. All threads must call it, round after round.
uint rank_in_team(uint digit, uint round) {
    uint slot = team() * DIGITS + digit;
    uint mark = round % 2u * (TEAMS * DIGITS) + slot;
    atomicOr(pool[mark], 1u << lane());
    barrier();
    uint peers = pool[mark];
    uint rank = places[slot] + uint(bitCount(peers & ((1u << lane()) - 1u)));
    barrier();
    if (int(lane()) == findMSB(peers)) {
        places[slot] += uint(bitCount(peers));
        pool[mark] = 0u;    // for the round after the next, which comes behind another barrier
    }
    return rank;
}

// From the items of each team and digit to the place in the batch of the first of them, and to how far a digit's items move. A thread a digit.
void place_digits(uint batch) {
    uint digit = gl_LocalInvocationIndex;
    uint of_digit = 0u;
    for (uint t = 0u; t < TEAMS; ++t) {
        uint of_team = places[t * DIGITS + digit];
        places[t * DIGITS + digit] = of_digit;
        of_digit += of_team;
    }
    uint total;
    uint first_of_batch = sum_before(of_digit, total);
    barrier();  // before the second sum takes the memory of the first
    uint first_of_all = sum_before(digit_totals[digit], total);
    moves[digit] = first_of_all + histogram[digit * batch_count() + batch] - first_of_batch;
    for (uint t = 0u; t < TEAMS; ++t) {
        places[t * DIGITS + digit] += first_of_batch;
    }
}

void main() {
    uint batch = group_number(), thread = gl_LocalInvocationIndex;
    if (batch >= batch_count()) {
        return;
    }
    uint end = item_count(), of_batch = min(end - batch * BATCH_ITEMS, BATCH_ITEMS);
    uint own[ROUNDS];
    [[unroll]] for (uint round = 0u; round < ROUNDS; ++round) {
        uint item = item_of(batch, round);
        own[round] = item < end ? keys[item] : NO_ITEM;
    }
    for (uint i = thread; i < BATCH_ITEMS; i += THREADS) {
        pool[i] = 0u;
    }
    for (uint i = thread; i < TEAMS * DIGITS; i += THREADS) {
        places[i] = 0u;
    }
    barrier();
    uint place[ROUNDS];
    [[unroll]] for (uint round = 0u; round < ROUNDS; ++round) {
        place[round] = rank_in_team(digit_of(own[round]), round);
    }
    barrier();
    place_digits(batch);
    barrier();
    [[unroll]] for (uint round = 0u; round < ROUNDS; ++round) {
        place[round] += places[team() * DIGITS + digit_of(own[round])];
        pool[place[round]] = own[round];
    }
    // The values are on their way from memory while the keys are written.
    [[unroll]] for (uint round = 0u; round < ROUNDS; ++round) {
        uint item = item_of(batch, round);
        own[round] = item < end ? values[item] : 0u;
    }
    barrier();
    uint target[ROUNDS];
    [[unroll]] for (uint round = 0u; round < ROUNDS; ++round) {
        uint i = round * THREADS + thread;
        uint key = pool[i];
        target[round] = moves[digit_of(key)] + i;
        if (i < of_batch) {
            keys_out[target[round]] = key;
        }
    }
    barrier();
    [[unroll]] for (uint round = 0u; round < ROUNDS; ++round) {
        pool[place[round]] = own[round];
    }
    barrier();
    [[unroll]] for (uint round = 0u; round < ROUNDS; ++round) {
        uint i = round * THREADS + thread;
        if (i < of_batch) {
            values_out[target[round]] = pool[i];
        }
    }
}
