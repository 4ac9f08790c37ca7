// Groups of the derivative pass.
#ifndef AFTERLIGHT_DERIVATIVE_GROUPS
#define AFTERLIGHT_DERIVATIVE_GROUPS

const uint GROUP_TRIANGLES = 128u;
const uint ROW_GROUPS = 65535u;     // every device takes so many groups along an axis

// Groups with a thread for each triangle, in rows: VkDispatchIndirectCommand.
uvec3 derivative_groups(uint triangles) {
    uint groups = triangles / GROUP_TRIANGLES + min(triangles % GROUP_TRIANGLES, 1u);
    return uvec3(min(groups, ROW_GROUPS), (groups + ROW_GROUPS - 1u) / ROW_GROUPS, 1u);
}

#endif
