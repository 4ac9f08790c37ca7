// Groups in rows: more of them than a device takes along one axis. Twin: Frame::groups_in_rows.
#ifndef AFTERLIGHT_GROUP_ROWS
#define AFTERLIGHT_GROUP_ROWS

// Number of the group, row after row. The last row may have a few groups more than there is work for.
uint group_number() {
    return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

#endif
