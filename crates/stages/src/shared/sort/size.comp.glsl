// Sizes the dispatches of a sort whose number of items is on the device: no read-back. One thread.
//
// In: Counts. Out: SortDemand: items asked for, and those without room; SortGroups: a group a batch, in rows: VkDispatchIndirectCommand.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 1) in;
layout(set = 0, binding = 8, scalar) readonly buffer Counts {
    uint counts[];
};
layout(set = 0, binding = 9, scalar) writeonly buffer SortDemand {
    uint items_needed;
    uint items_dropped;
};
layout(set = 0, binding = 10, scalar) writeonly buffer SortGroups {
    uvec3 sort_groups;
};
layout(push_constant, scalar) uniform Push {
    uint most;          // room for items
    uint word;          // of the buffer, which has the number
    uint row_groups;    // groups of a row at most
    uint batch_items;
} size;

void main() {
    // A word that the buffer does not have counts nothing.
    uint needed = size.word < uint(counts.length()) ? counts[size.word] : 0u;
    uint items = min(needed, size.most);
    items_needed = needed;
    items_dropped = needed - items;
    uint groups = items / size.batch_items + min(items % size.batch_items, 1u);
    uint rows = max(groups / size.row_groups + min(groups % size.row_groups, 1u), 1u);
    sort_groups = uvec3((groups + rows - 1u) / rows, rows, 1u);
}
