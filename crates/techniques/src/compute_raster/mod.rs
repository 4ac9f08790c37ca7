//! The stage that rasterises the scene in compute, every sample of a pixel: a 64-bit key a sample, depth above the triangle.
//!
//! For devices whose raster part is small beside their arithmetic. Small triangles take a thread each; large ones, and those
//! that cross the near plane, are listed, cut into tiles and rasterised a group a tile. The lists' capacities are counted: a
//! frame that needs more is recorded again.

use afterlight_graph::{BufferHandle, Graph};

use crate::{
    error::TechniqueError,
    frame::Frame,
    scene_gpu::{BUCKETS, Bucket},
};

/// Large triangles that the first frame has room for.
const FIRST_LARGE: u32 = 1 << 16;
/// Tiles of large triangles that the first frame has room for.
const FIRST_JOBS: u32 = 1 << 18;
/// Groups that share the lists of large triangles; enough to fill any device.
const LIST_GROUPS: u32 = 4096;

/// Whether a device can run the stage.
pub fn is_supported(features: &afterlight_graph::gpu::Features) -> bool {
    features.buffer_int64_atomics && features.shader_int64
}

/// Declares the passes that rasterise the draws in view at `samples` samples a pixel. Returns a key a sample, those of a pixel
/// side by side, rows from the top: bits 63 to 32 depth (reversed, 0: no surface), bits 31 to 0 the complement of command
/// `<< 10 |` triangle, where the command is the draw's place in the buffer of draw commands.
///
/// # Errors
/// More samples than one binding holds; the device.
pub fn rasterize(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    samples: u32,
) -> Result<BufferHandle, TechniqueError> {
    let bytes = 8 * u64::from(frame.width_px) * u64::from(frame.height_px) * u64::from(samples);
    let limit = frame.features().max_storage_buffer_range;
    if bytes > limit {
        let what = format!("{technique}: bytes of a key for each of {samples} samples of every pixel");
        return Err(TechniqueError::TooLarge { what, found: bytes, limit });
    }
    let large_capacity = frame.capacity("large_triangles", FIRST_LARGE);
    let job_capacity = frame.capacity("tile_jobs", FIRST_JOBS);
    let name = |stage: &str| format!("{technique}/{stage}");
    let keys = graph.buffer(&name("sample keys"), bytes);
    let large = graph.buffer(&name("large triangles"), 4 * u64::from(large_capacity));
    let jobs = graph.buffer(&name("tile jobs"), 8 * u64::from(job_capacity));
    let large_count = graph.buffer(&name("large count"), 8);
    let job_count = graph.buffer(&name("job count"), 8);
    let keys = graph.clear_buffer(&name("clear keys"), keys, 0);
    let mut large_count = graph.clear_buffer(&name("clear large count"), large_count, 0);
    let job_count = graph.clear_buffer(&name("clear job count"), job_count, 0);

    let (mut keys, mut large) = (keys, large);
    for (stage, shader, masked) in [
        ("triangles", "compute_raster/triangles.comp", false),
        ("masked triangles", "compute_raster/triangles.comp#mask", true),
    ] {
        let buckets: Vec<usize> = (0..BUCKETS)
            .filter(|b| Bucket(*b).masked() == masked)
            .filter(|b| frame.scene.bucket_first[b + 1] > frame.scene.bucket_first[*b])
            .collect();
        // Opaque surfaces run always, so that the keys and counts are written.
        if buckets.is_empty() && masked {
            continue;
        }
        let mut pass = frame.compute(graph, &name(stage), &frame.shader(shader)?);
        pass.constant("SAMPLES", samples).constant("LARGE_CAPACITY", large_capacity);
        pass.read("DrawCommands", &frame.buffers.commands).read("DrawCounts", &frame.buffers.command_counts);
        keys = pass.write("SampleKeys", keys);
        large = pass.write("LargeTriangles", large);
        large_count = pass.write("LargeCount", large_count);
        for bucket in buckets {
            let first = frame.scene.bucket_first[bucket];
            let max = frame.scene.bucket_first[bucket + 1] - first;
            pass.push(&[bucket as u32, first]);
            pass.dispatch([max, 1, 1]);
        }
        pass.finish();
    }

    let mut pass = frame.compute(graph, &name("bin"), &frame.shader("compute_raster/bin.comp")?);
    pass.constant("LARGE_CAPACITY", large_capacity).constant("JOB_CAPACITY", job_capacity);
    pass.read("DrawCommands", &frame.buffers.commands);
    pass.read("LargeTriangles", &large).read("LargeCount", &large_count);
    let jobs = pass.write("TileJobs", jobs);
    let job_count = pass.write("JobCount", job_count);
    pass.dispatch([LIST_GROUPS, 1, 1]);
    pass.finish();

    let has_masked = frame.scene.bucket_first[BUCKETS] > frame.scene.bucket_first[BUCKETS / 2];
    let shader = if has_masked { "compute_raster/large.comp#mask" } else { "compute_raster/large.comp" };
    let mut pass = frame.compute(graph, &name("large triangles"), &frame.shader(shader)?);
    pass.constant("SAMPLES", samples).constant("JOB_CAPACITY", job_capacity);
    pass.read("DrawCommands", &frame.buffers.commands).read("TileJobs", &jobs).read("JobCount", &job_count);
    let keys = pass.write("SampleKeys", keys);
    pass.dispatch([LIST_GROUPS, 1, 1]);
    pass.finish();

    frame.watch(graph, "large_triangles", &large_count, large_capacity, false);
    frame.watch(graph, "tile_jobs", &job_count, job_capacity, false);
    Ok(keys)
}
