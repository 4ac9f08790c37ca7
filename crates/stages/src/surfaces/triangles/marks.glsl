// Marks of the triangles that show: a bit a triangle of the scene. No lock and no cache, since a bit needs no slot.
#ifndef AFTERLIGHT_MARKS
#define AFTERLIGHT_MARKS

layout(set = 0, binding = 10, scalar) buffer MarkedBits {
    uint marked_bits[];
};

void mark_triangle(uint id) {
    uint bit = 1u << (id & 31u);
    // A stale word costs an atomic, never a triangle.
    if ((marked_bits[id >> 5] & bit) == 0u) {
        atomicOr(marked_bits[id >> 5], bit);
    }
}

#endif
