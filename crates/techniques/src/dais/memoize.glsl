// The memoization cache: triangle to its place in the triangle buffer (Schied and Dachsbacher 2015, section 4.1; Liktor and
// Dachsbacher 2012). Every fragment looks its triangle up; one that finds nothing locks the bucket, takes a slot of the triangle
// buffer, and stores the triangle for the derivative pass: its ID in the first word of its record, or, with WHOLE_TRIANGLE, whose
// IDs are numbers that lead nowhere, its vertices in the record. Needs draw_material.
//
// An entry is a place alone. Which triangle stands there is asked of the place itself, and no place is given twice in a frame: what an
// entry leads to holds, whoever replaces the entry meanwhile. (With a triangle ID and its place in two words of the entry a
// look-up could read the ID of one triangle and the place of another, though it read the ID again afterwards: the triangle may have
// left the bucket and come back in between.) Look-ups therefore need no lock. Who stores a triangle takes one all the same,
// so that the fragments of a new triangle, which come at once, store it once. All orders of these steps are tried by
// tests/interleavings/cache.rs, which changes with this file.
//
// No lock can hang. A fragment that fails to take a lock does not wait inside the loop's turn but polls again, at most POLLS times;
// one that takes it lets go within the same turn, whatever the other lanes of its subgroup do. After that the triangle is
// stored and cached without the lock, so that a fragment that is suspended with it costs others a record each, not one for every
// fragment that comes meanwhile (thousands on a busy CPU).
#ifndef AFTERLIGHT_MEMOIZE
#define AFTERLIGHT_MEMOIZE
#include "surfaces/triangles/record.glsl"
#ifdef WHOLE_TRIANGLE
#define THROUGH in
#include "surfaces/geometry/whole_triangle.glsl"
#endif

// Two entries in each bucket, the newer first: 0; a place plus one; or, of a triangle that found no place, NO_PLACE and its ID's lower
// bits.
layout(set = 0, binding = 10, scalar) coherent buffer CacheEntries {
    uint cache_entries[];
};
layout(set = 0, binding = 11, scalar) coherent buffer CacheLocks {
    uint cache_locks[];
};
// The triangle of each place: written once, before an entry leads to it. What is left of earlier frames is never asked for.
layout(set = 0, binding = 18, scalar) coherent buffer StoredIds {
    uint stored_ids[];
};
layout(set = 0, binding = 12, scalar) buffer TriangleCount {
    uint triangles_needed;
    uint triangles_dropped;
};
layout(set = 0, binding = 14, scalar) writeonly buffer TriangleBuffer {
    uint triangle_buffer[];
};
layout(constant_id = 12) const uint CACHE_BUCKETS = 8192u;
layout(constant_id = 13) const uint POLLS = 32u;

const uint NO_PLACE = 0x80000000u;      // set in an entry
const uint NO_RECORD = 0xfffffffeu;     // the place of a triangle that found none: behind all places
const uint NOT_CACHED = 0xffffffffu;

// A hash that spreads neighbouring triangles, which are drawn at the same time, over the buckets.
uint bucket_of(uint id) {
    return (id * 2654435761u >> 16) % CACHE_BUCKETS;
}

#ifdef WHOLE_TRIANGLE
void store_float(uint word, float value) {
    triangle_buffer[word] = floatBitsToUint(value);
}

// The layout of surfaces/triangles/vertices.glsl.
void store_vertices(uint record) {
    for (uint i = 0u; i < 3u; ++i) {
        for (uint c = 0u; c < 3u; ++c) {
            store_float(record + 3u * i + c, vertex_position_ws[i][c]);
        }
        triangle_buffer[record + 9u + i] = vertex_normals[i];
        for (uint c = 0u; c < 2u; ++c) {
            store_float(record + 12u + 2u * i + c, vertex_uv0_uv1[i][c]);
            if (TANGENTS != TANGENTS_BY_DERIVATIVES) {
                triangle_buffer[record + TANGENT_WORD + 2u * i + c] = vertex_tangents[i][c];
            }
            if (HAS_UV1 != 0u) {
                store_float(record + UV1_WORD + 2u * i + c, vertex_uv0_uv1[i][2u + c]);
            }
        }
        for (uint c = 0u; HAS_VERTEX_COLOR != 0u && c < 4u; ++c) {
            store_float(record + COLOR_WORD + 4u * i + c, vertex_color[i][c]);
        }
    }
    triangle_buffer[record + 18u] = draw_material.y | (gl_FrontFacing ? RECORD_FRONT : 0u);
    triangle_buffer[record + 19u] = vertex_normals.w;
}
#endif

// Gives a triangle a place, or counts it as dropped.
uint store_triangle(uint id) {
    uint place = atomicAdd(triangles_needed, 1u);
    if (place >= record_room(triangle_buffer.length())) {
        atomicAdd(triangles_dropped, 1u);
        return NO_RECORD;
    }
#ifdef WHOLE_TRIANGLE
    store_vertices(place * RECORD_WORDS);
#else
    triangle_buffer[place * RECORD_WORDS] = id;
#endif
    return place;
}

// The place to which an entry leads, if it is the triangle's own.
uint place_of_entry(uint entry, uint id) {
    if ((entry & NO_PLACE) != 0u) {
        return (entry ^ id) << 1 == 0u ? NO_RECORD : NOT_CACHED;
    }
    memoryBarrierBuffer();  // the ID is read after the entry
    return entry != 0u && stored_ids[entry - 1u] == id ? entry - 1u : NOT_CACHED;
}

uint look_up(uint bucket, uint id) {
    uint place = place_of_entry(cache_entries[bucket * 2u], id);
    return place != NOT_CACHED ? place : place_of_entry(cache_entries[bucket * 2u + 1u], id);
}

// Stores a triangle and puts it first in its bucket: the newer entry becomes the older, which leaves it.
uint store_and_cache(uint bucket, uint id) {
    uint place = store_triangle(id);
    if (place != NO_RECORD) {
        stored_ids[place] = id;
    }
    memoryBarrierBuffer();  // who sees the entry sees the ID
    uint entry = place != NO_RECORD ? place + 1u : NO_PLACE | id;
    cache_entries[bucket * 2u + 1u] = atomicExchange(cache_entries[bucket * 2u], entry);
    return place;
}

uint memoized(uint id) {
    uint bucket = bucket_of(id);
    for (uint poll = 0u; poll < POLLS; ++poll) {
        uint place = look_up(bucket, id);
        if (place != NOT_CACHED) {
            return place;
        }
        if (atomicCompSwap(cache_locks[bucket], 0u, 1u) == 0u) {
            memoryBarrierBuffer();
            // Another fragment may have stored the triangle between the look-up and taking the lock.
            place = look_up(bucket, id);
            if (place == NOT_CACHED) {
                place = store_and_cache(bucket, id);
            }
            memoryBarrierBuffer();  // who takes the lock next sees the entry
            atomicExchange(cache_locks[bucket], 0u);
            return place;
        }
    }
    return store_and_cache(bucket, id);
}

// The number that identifies the fragment's triangle.
uint fragment_triangle() {
#ifdef WHOLE_TRIANGLE
    return uint(gl_PrimitiveID);
#else
    return draw_material.x << TRIANGLE_BITS | uint(gl_PrimitiveID);
#endif
}

#endif
