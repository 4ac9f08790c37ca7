// A group a kept cluster, in rows: every device takes 65,535 groups along an axis.
#ifndef AFTERLIGHT_CLUSTER_GROUPS
#define AFTERLIGHT_CLUSTER_GROUPS

const uint GROUPS_A_ROW = 32768u;

// Place of this group's cluster.
uint group_place() {
    return gl_WorkGroupID.y * GROUPS_A_ROW + gl_WorkGroupID.x;
}

#endif
