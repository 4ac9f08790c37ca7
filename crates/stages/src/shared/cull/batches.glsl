// How the draws of a scene stand in batches: neighbouring draws of one bucket, the work of a group of 256 threads. A bucket has one batch
// at least, so that some group writes its count.
//
// CPU twin: Batches in crates/stages/src/shared/cull/mod.rs.
#ifndef AFTERLIGHT_CULL_BATCHES
#define AFTERLIGHT_CULL_BATCHES

const uint BUCKETS = 8u;            // BUCKETS of crates/frame/src/scene/draws.rs
const uint THREADS = 256u;

layout(push_constant, scalar) uniform Push {
    uint bucket_first[BUCKETS + 1u];    // first draw of each bucket, and the end
    uint rounds;                        // draws of a thread
};

struct Batch {
    uint bucket;
    uint number;            // among all batches
    uint first_of_bucket;   // number of the bucket's first batch
    uint end_of_bucket;     // and of the batch after its last one
    uint first_draw;
    uint end_draw;
};

// The batch of this group.
Batch own_batch() {
    Batch batch = Batch(0u, gl_WorkGroupID.x, 0u, 0u, 0u, 0u);
    uint first_batch = 0u, batch_draws = THREADS * rounds;
    for (uint bucket = 0u; bucket < BUCKETS; ++bucket) {
        uint first = bucket_first[bucket], end = bucket_first[bucket + 1u];
        uint batches = max((end - first + batch_draws - 1u) / batch_draws, 1u);
        if (batch.number >= first_batch && batch.number < first_batch + batches) {
            batch.bucket = bucket;
            batch.first_of_bucket = first_batch;
            batch.end_of_bucket = first_batch + batches;
            batch.first_draw = first + (batch.number - first_batch) * batch_draws;
            batch.end_draw = min(batch.first_draw + batch_draws, end);
        }
        first_batch += batches;
    }
    return batch;
}

#endif
