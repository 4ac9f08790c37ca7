// The memoization cache: triangle to its place in the triangle buffer (Schied and Dachsbacher 2015, section 4.1; Liktor and
// Dachsbacher 2012). Every fragment looks its triangle up; one that finds nothing locks the bucket, takes a slot of the triangle
// buffer, and stores the triangle for the derivative pass: its ID in the first word of its record, or, with WHOLE_TRIANGLE, whose
// IDs are numbers that lead nowhere, its vertices in the record. Needs draw_material.
//
// A bucket's version is its lock. It is odd while a fragment replaces the bucket's entries and grows by two with every
// replacement; so entries that were read between two equal, even versions stood in the bucket together (a sequence lock: Boehm, "Can
// seqlocks get along with programming language memory models?", MSPC 2012). To compare the ID before and after the place is
// read does not suffice: the triangle may have left the bucket and come back in between, and the place is another's
// (38 dB now and then with one bucket). The lock is taken by exchanging the version that was read before the entries, so that a
// fragment which gets it knows that they still stand. All orders of these steps are tried by
// tests/interleavings/cache.rs, which changes with this file.
//
// No lock can hang. A fragment that fails to take a lock does not wait inside the loop's turn but polls again, at most POLLS times;
// one that takes it lets go within the same turn, whatever the other lanes of its subgroup do. After that the triangle is
// stored once more, which costs memory and nothing else.
#ifndef AFTERLIGHT_MEMOIZE
#define AFTERLIGHT_MEMOIZE
#include "surfaces/triangles/record.glsl"
#ifdef WHOLE_TRIANGLE
#define THROUGH in
#include "surfaces/geometry/whole_triangle.glsl"
#endif

// Triangle ID and its place, two entries in each bucket, the newer first. Both buffers are volatile because a compiler that merged
// the two reads of a version would let every look-up through (32 dB on lavapipe when IDs were compared).
layout(set = 0, binding = 10, scalar) coherent volatile buffer CacheEntries {
    uvec2 cache_entries[];
};
layout(set = 0, binding = 11, scalar) coherent volatile buffer CacheVersions {
    uint cache_versions[];
};
layout(set = 0, binding = 12, scalar) buffer TriangleCount {
    uint triangles_needed;
    uint triangles_dropped;
};
layout(set = 0, binding = 14, scalar) writeonly buffer TriangleBuffer {
    uint triangle_buffer[];
};
layout(constant_id = 11) const uint TRIANGLE_CAPACITY = 0u;
layout(constant_id = 12) const uint CACHE_BUCKETS = 8192u;
layout(constant_id = 13) const uint POLLS = 32u;

// IDs are stored plus one: zero, the value of the cleared cache, is none.

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

uint store_triangle(uint id) {
    uint place = atomicAdd(triangles_needed, 1u);
    if (place < TRIANGLE_CAPACITY) {
#ifdef WHOLE_TRIANGLE
        store_vertices(place * RECORD_WORDS);
#else
        triangle_buffer[place * RECORD_WORDS] = id;
#endif
    } else {
        atomicAdd(triangles_dropped, 1u);
    }
    return place;
}

// Puts a triangle first in a bucket that this fragment has locked: the older entry leaves it, the newer becomes the older.
void replace_entries(uint bucket, uvec2 newer, uvec2 newest) {
    memoryBarrierBuffer();  // who sees an entry of these sees that the version is odd
    cache_entries[bucket * 2u + 1u] = newer;
    cache_entries[bucket * 2u] = newest;
    memoryBarrierBuffer();  // who sees the next version sees these entries
}

uint memoized(uint id) {
    uint bucket = bucket_of(id);
    for (uint poll = 0u; poll < POLLS; ++poll) {
        uint version = cache_versions[bucket];
        if ((version & 1u) != 0u) {
            continue;
        }
        memoryBarrierBuffer();  // the entries are read after the version
        uvec2 newer = cache_entries[bucket * 2u], older = cache_entries[bucket * 2u + 1u];
        memoryBarrierBuffer();  // the version is read again after the entries
        if (newer.x == id + 1u || older.x == id + 1u) {
            if (cache_versions[bucket] == version) {
                return newer.x == id + 1u ? newer.y : older.y;
            }
        } else if (atomicCompSwap(cache_versions[bucket], version, version + 1u) == version) {
            uint place = store_triangle(id);
            replace_entries(bucket, newer, uvec2(id + 1u, place));
            atomicExchange(cache_versions[bucket], version + 2u);
            return place;
        }
    }
    return store_triangle(id);
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
