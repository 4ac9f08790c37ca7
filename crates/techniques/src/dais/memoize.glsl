// The memoization cache: triangle to its place in the triangle buffer (Schied and Dachsbacher 2015, section 4.1; Liktor and
// Dachsbacher 2012). Every fragment looks its triangle up; one that finds nothing takes the bucket's lock, a slot of the
// triangle buffer, and stores the triangle for the derivative pass: its ID in the first word of its record, or, with
// WHOLE_TRIANGLE, whose IDs are numbers that lead nowhere, its vertices in the record. Needs draw_material.
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

// Triangle ID and its place, two entries in each bucket. The place is written first and the ID last; while an entry is replaced its ID is
// NO_ID. It is volatile because a look-up reads the ID twice: a compiler that merged the two reads would return another triangle's
// place (32 dB on lavapipe).
layout(set = 0, binding = 10, scalar) coherent volatile buffer CacheEntries {
    uvec2 cache_entries[];
};
layout(set = 0, binding = 11, scalar) coherent buffer CacheLocks {
    uint cache_locks[];
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

const uint NOT_CACHED = 0xffffffffu;
const uint NO_ID = 0u;      // value of the cleared cache; IDs are stored plus one

// A hash that spreads neighbouring triangles, which are drawn at the same time, over the buckets.
uint bucket_of(uint id) {
    return (id * 2654435761u >> 16) % CACHE_BUCKETS;
}

uint look_up(uint bucket, uint id) {
    for (uint i = bucket * 2u; i < bucket * 2u + 2u; ++i) {
        if (cache_entries[i].x == id + 1u) {
            memoryBarrierBuffer();
            uint place = cache_entries[i].y;
            memoryBarrierBuffer();
            // The entry has not changed in between, so the place belongs to this ID.
            if (cache_entries[i].x == id + 1u) {
                return place;
            }
        }
    }
    return NOT_CACHED;
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

uint memoized(uint id) {
    uint bucket = bucket_of(id);
    for (uint poll = 0u; poll < POLLS; ++poll) {
        uint place = look_up(bucket, id);
        if (place != NOT_CACHED) {
            return place;
        }
        if (atomicCompSwap(cache_locks[bucket], 0u, 1u) == 0u) {
            // Another fragment may have stored the triangle between the look-up and taking the lock.
            place = look_up(bucket, id);
            if (place == NOT_CACHED) {
                place = store_triangle(id);
                // Replaces the older entry: the first entry moves into the second.
                uvec2 older = cache_entries[bucket * 2u];
                cache_entries[bucket * 2u + 1u].x = NO_ID;
                memoryBarrierBuffer();
                cache_entries[bucket * 2u + 1u].y = older.y;
                memoryBarrierBuffer();
                cache_entries[bucket * 2u + 1u].x = older.x;
                cache_entries[bucket * 2u].x = NO_ID;
                memoryBarrierBuffer();
                cache_entries[bucket * 2u].y = place;
                memoryBarrierBuffer();
                cache_entries[bucket * 2u].x = id + 1u;
            }
            memoryBarrierBuffer();
            atomicExchange(cache_locks[bucket], 0u);
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
