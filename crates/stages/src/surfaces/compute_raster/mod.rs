//! The stage that rasterises the scene in compute, every sample of a pixel: a 64-bit key a sample, depth above the triangle.
//!
//! For devices whose raster part is small beside their arithmetic. Small triangles take a thread each; large ones, and those
//! that cross the near plane or reach far out of the image, are listed, clipped, cut into tiles and rasterised a group a tile.
//! The lists' capacities are counted: a frame that needs more is recorded again.

use afterlight_graph::{BufferHandle, BufferRole, Graph, PassRole};

use afterlight_frame::{
    Frame, TechniqueError,
    scene::{BUCKETS, DRAW_TRIANGLES},
};

mod params;

pub use params::{ComputeRasterParams, Visibility};

/// Large triangles that the first frame has room for.
const FIRST_LARGE: u32 = 1 << 16;
/// Tiles of large triangles that the first frame has room for.
const FIRST_JOBS: u32 = 1 << 18;
/// Parts of clipped triangles that the first frame has room for: few triangles of a scene stand that close to the eye.
const FIRST_CLIPPED: u32 = 1 << 12;
/// Bytes of such a part: `ClippedTriangle` in `tile_jobs.glsl`.
const CLIPPED_BYTES: u64 = 40;
/// Groups that share the lists of large triangles; enough to fill any device.
const LIST_GROUPS: u32 = 4096;

/// Triangles, and threads, of a group: `local_size_x` in `triangles.comp.glsl`.
const GROUP_TRIANGLES: u32 = 128;

/// Whether a frame of the technique is rasterised in compute.
///
/// `auto` expects that to be faster on everything but a CPU: measured on an NVIDIA H200, where 8 samples of Sponza at
/// 1920×1080 take 2.2 ms instead of 8.6, and on lavapipe, whose raster pass is its own vectorised code, 1,860 ms instead of
/// 164 at 4 samples of 640×360.
///
/// # Errors
/// `compute` on a device that lacks what it takes.
pub fn is_chosen(
    frame: &Frame<'_>,
    technique: &'static str,
    visibility: Visibility,
) -> Result<bool, TechniqueError> {
    let is_supported = frame.features().buffer_int64_atomics && frame.features().shader_int64;
    match visibility {
        Visibility::Compute if !is_supported => Err(TechniqueError::Unavailable {
            technique,
            missing:
                "64-bit integers and buffer atomics for visibility=compute (visibility=raster does without)"
                    .to_owned(),
        }),
        Visibility::Compute => Ok(true),
        Visibility::Auto => Ok(is_supported && !frame.is_cpu()),
        Visibility::Raster => Ok(false),
    }
}

/// Declares the passes that rasterise the draws in view at `samples` samples a pixel. Returns a key a sample, those of a pixel
/// side by side; triangles below `small_px` pixels take a thread each. Rows from the top: bits 63 to 32 depth (reversed, 0: no surface), bits 31 to 0 the complement of command
/// `<< 10 |` triangle, where the command is the draw's place in the buffer of draw commands.
///
/// # Errors
/// More samples than one binding holds; the device.
pub fn rasterize(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    small_px: u32,
    samples: u32,
) -> Result<BufferHandle, TechniqueError> {
    let bytes = 8 * u64::from(frame.width_px) * u64::from(frame.height_px) * u64::from(samples);
    frame.check_binding(technique, &format!("a key for each of {samples} samples of every pixel"), bytes)?;
    let large_capacity = frame.capacity("large_triangles", FIRST_LARGE);
    let job_capacity = frame.capacity("tile_jobs", FIRST_JOBS);
    let clipped_capacity = frame.capacity("clipped_triangles", FIRST_CLIPPED);
    let name = |stage: &str| format!("{technique}/{stage}");
    let keys = graph.buffer(&name("sample keys"), BufferRole::SampleKeys, bytes);
    let large =
        graph.buffer(&name("large triangles"), BufferRole::RasterQueues, 4 * u64::from(large_capacity));
    let jobs = graph.buffer(&name("tile jobs"), BufferRole::RasterQueues, 8 * u64::from(job_capacity));
    let clipped = graph.buffer(
        &name("clipped triangles"),
        BufferRole::RasterQueues,
        CLIPPED_BYTES * u64::from(clipped_capacity),
    );
    let counts = graph.buffer(&name("queue counts"), BufferRole::RasterQueues, 24);
    let keys = graph.clear_buffer(&name("clear keys"), PassRole::Geometry, keys, 0);
    let counts = graph.clear_buffer(&name("clear queue counts"), PassRole::Geometry, counts, 0);

    let has_masked = frame.scene.has_masked();
    let variant = |shader: &str| if has_masked { format!("{shader}#mask") } else { shader.to_owned() };
    // One pass for opaque and masked surfaces: a few slow threads of alpha tests then have company.
    let shader = frame.shader(&variant("surfaces/compute_raster/triangles.comp"))?;
    let mut pass = frame.compute(graph, &name("triangles"), PassRole::Geometry, &shader);
    pass.constant("SAMPLES", samples).constant("SMALL_PX", small_px);
    pass.read("DrawCommands", &frame.buffers.commands).read("DrawCounts", &frame.buffers.command_counts);
    let keys = pass.write("SampleKeys", keys);
    let large = pass.write("LargeTriangles", large);
    let counts = pass.write("QueueCounts", counts);
    let most_groups = frame.features().max_workgroup_count[0];
    for bucket in 0..BUCKETS {
        let first = frame.scene.bucket_first[bucket];
        let draws = frame.scene.bucket_first[bucket + 1] - first;
        for first_draw in (0..draws).step_by(most_groups as usize) {
            pass.push(&[bucket as u32, first, first_draw]);
            let groups = (draws - first_draw).min(most_groups);
            pass.dispatch([groups, DRAW_TRIANGLES / GROUP_TRIANGLES, 1]);
        }
    }
    pass.finish();

    let mut pass = frame.compute(
        graph,
        &name("bin"),
        PassRole::Geometry,
        &frame.shader("surfaces/compute_raster/bin.comp")?,
    );
    pass.read("DrawCommands", &frame.buffers.commands);
    pass.read("LargeTriangles", &large);
    let jobs = pass.write("TileJobs", jobs);
    let counts = pass.write("QueueCounts", counts);
    let clipped = pass.write("ClippedTriangles", clipped);
    pass.dispatch([LIST_GROUPS, 1, 1]);
    pass.finish();

    let shader = frame.shader(&variant("surfaces/compute_raster/large.comp"))?;
    let mut pass = frame.compute(graph, &name("large triangles"), PassRole::Geometry, &shader);
    pass.constant("SAMPLES", samples);
    pass.read("DrawCommands", &frame.buffers.commands).read("TileJobs", &jobs).read("QueueCounts", &counts);
    pass.read("ClippedTriangles", &clipped);
    let keys = pass.write("SampleKeys", keys);
    pass.dispatch([LIST_GROUPS, 1, 1]);
    pass.finish();

    let queues = [
        ("large_triangles", large_capacity),
        ("tile_jobs", job_capacity),
        ("clipped_triangles", clipped_capacity),
    ];
    frame.watch_all(graph, &counts, &queues);
    Ok(keys)
}
