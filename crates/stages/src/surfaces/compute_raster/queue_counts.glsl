// What the queues of compute_raster were asked for, and what found no room. QUEUE_ACCESS: readonly, or nothing.
#ifndef AFTERLIGHT_QUEUE_COUNTS
#define AFTERLIGHT_QUEUE_COUNTS

layout(set = 0, binding = 16, scalar) QUEUE_ACCESS buffer QueueCounts {
    uint large_needed;      // LargeTriangles
    uint large_dropped;
    uint jobs_needed;       // TileJobs
    uint jobs_dropped;
    uint clipped_needed;    // ClippedTriangles
    uint clipped_dropped;
};

#endif
