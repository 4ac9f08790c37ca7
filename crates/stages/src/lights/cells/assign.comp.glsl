// Lists the lights that touch each cell: a group of 32 threads walks down the tree over the lights for one cell after the other,
// counts what it finds, takes that much room and writes it, in the order of the lights.
//
// In: Cells, CellCount, light_spheres, light_boxes, light_data. Out: CellLists: entries; ListEnds: first and end of each cell's list;
// ListCount: entries of all lists, and whether some found no room. Where lists stand depends on the order in which groups run;
// what is in them does not.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "lights/cells/bounds.glsl"
#include "light_cone.glsl"

layout(local_size_x = 32) in;   // TREE_WIDTH
layout(set = 0, binding = 8, scalar) readonly buffer Cells {
    Cell cells[];
};
layout(set = 0, binding = 9, scalar) readonly buffer CellCount {
    uint cells_needed;
    uint cells_dropped;
};
layout(set = 0, binding = 10, scalar) writeonly buffer CellLists {
    uint cell_lists[];
};
layout(set = 0, binding = 11, scalar) writeonly buffer ListEnds {
    uvec2 list_ends[];
};
layout(set = 0, binding = 12, scalar) buffer ListCount {
    uint entries_needed;
    uint entries_dropped;
};

const uint LEVELS_MAX = 7u;         // enough levels for any number of lights that 32 bits can count
const uint KEPT_MAX = 1024u;        // lights of a list that stay in shared memory until the list has its place

shared uint group_bits;
shared uint kept[KEPT_MAX];
shared uint shared_first;

uint list_capacity() {
    return uint(cell_lists.length());
}

uint lane() {
    return gl_LocalInvocationIndex;
}

// Collects one bit from every thread of the group. All threads must call it.
//
// Each thread brings its bit in its own place, instead of a ballot being shifted to where the subgroup begins: where a driver varies the size of
// subgroups, gl_SubgroupSize says the largest, and gl_SubgroupID times it is not where a subgroup begins.
uint group_ballot(bool value) {
    uint bits = subgroupOr(value ? 1u << lane() : 0u);
    if (gl_NumSubgroups == 1u) {
        return bits;
    }
    barrier();
    if (lane() == 0u) {
        group_bits = 0u;
    }
    barrier();
    if (subgroupElect()) {
        atomicOr(group_bits, bits);
    }
    barrier();
    return group_bits;
}

bool touches_light(CellBounds b, uint place) {
    if (place >= tree_lights() || !cell_touches_sphere(b, tree_sphere(place))) {
        return false;
    }
    vec3 apex, axis;
    float cos_angle;
    return !light_cone(frame.unbounded_light_count + place, apex, axis, cos_angle) ||
           cell_touches_cone(b, apex, axis, cos_angle);
}

// A bit for each child of a node that touches the cell. The children of a node of level 1 are lights.
uint touching_children(CellBounds b, uint level, uint node) {
    uint child = node * TREE_WIDTH + lane();
    if (level == 1u) {
        return group_ballot(touches_light(b, child));
    }
    return group_ballot(child < tree_count(level - 1u) && cell_touches_box(b, light_box(level - 1u, child)));
}

// Collects the lights of a cell. On the first walk the first KEPT_MAX are kept in shared memory; once the list has its place, all are
// written there.
struct Found {
    uint count;
    bool placed;
    uint first;
};

void add_lights(inout Found found, uint leaf, uint bits) {
    if ((bits >> lane() & 1u) != 0u) {
        uint at = found.count + uint(bitCount(bits & ((1u << lane()) - 1u)));
        uint light = frame.unbounded_light_count + leaf * TREE_WIDTH + lane();
        if (!found.placed) {
            if (at < KEPT_MAX) {
                kept[at] = light;
            }
        } else if (found.first + at < list_capacity()) {
            cell_lists[found.first + at] = light;
        }
    }
    found.count += uint(bitCount(bits));
}

// Walks the tree, depth first, so that lights come in their order.
void find_lights(CellBounds b, inout Found found) {
    uint parent[LEVELS_MAX], pending[LEVELS_MAX];
    uint top = tree_top() + 1u;     // a root above the top level
    uint level = top;
    parent[top] = 0u;
    pending[top] = 1u;
    while (level <= top) {
        if (pending[level] == 0u) {
            ++level;
            continue;
        }
        uint node = parent[level] * TREE_WIDTH + uint(findLSB(pending[level]));
        pending[level] &= pending[level] - 1u;
        uint bits = touching_children(b, level, node);
        if (level == 1u) {
            add_lights(found, node, bits);
        } else {
            --level;
            parent[level] = node;
            pending[level] = bits;
        }
    }
}

// Takes room for a list and returns where the list begins.
uint take_room(uint count) {
    uint first = atomicAdd(entries_needed, count);
    uint room = first < list_capacity() ? min(count, list_capacity() - first) : 0u;
    if (room < count) {
        // The sum has wrapped past 2^32 and would look small: mark that.
        atomicOr(entries_dropped, count - room);
    }
    return first;
}

void write_list(uint place) {
    CellBounds b = cell_bounds(cells[place]);
    Found found = Found(0u, false, 0u);
    find_lights(b, found);
    if (lane() == 0u) {
        shared_first = take_room(found.count);
        list_ends[place] = min(uvec2(shared_first, shared_first + found.count), list_capacity());
    }
    barrier();
    uint first = shared_first, count = found.count;
    if (count > KEPT_MAX) {
        found = Found(0u, true, first);
        find_lights(b, found);
    } else {
        for (uint i = lane(); i < count && first + i < list_capacity(); i += TREE_WIDTH) {
            cell_lists[first + i] = kept[i];
        }
    }
    barrier();  // before the next cell's lights take their place
}

void main() {
    uint end = min(cells_needed, uint(cells.length()));
    for (uint place = gl_WorkGroupID.x; place < end; place += gl_NumWorkGroups.x) {
        write_list(place);
    }
}
