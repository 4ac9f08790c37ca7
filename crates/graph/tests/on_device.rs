//! Frames on whatever device the machine has, validation with synchronization checks on: any message fails.

use std::path::{Path, PathBuf};

use afterlight_gpu::{
    Buffer, BufferDesc, Device, DeviceOptions, GpuError, ImageDesc, MemoryKind, SamplerDesc, vk,
};
use afterlight_graph::{
    Blend, BufferRole, DepthTest, Draw, DrawCall, Executor, Graph, GraphError, ImageHandle, ImageInfo, Load,
    MemoryNeed, PassRole, Plan, RasterState, Requirements, StencilFace, StencilTest, Subresource,
};
use afterlight_shader::Shader;
use afterlight_shader::compile::Compiler;
use afterlight_shader::manifest::{Variant, stage_of};
use afterlight_testkit::{Need, has_tessellation, sample_counts, skip};

const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;
const WIDTH: u32 = 37;
const HEIGHT: u32 = 19;

/// Opens the device with validation; without one the test says so and passes.
fn open() -> Option<Device> {
    match Device::open(&DeviceOptions { validate: true, ..DeviceOptions::default() }) {
        Ok(device) => Some(device),
        Err(error @ (GpuError::NoLoader { .. } | GpuError::NoDevice { .. })) => {
            skip(Need::Device, &error.to_string());
            None
        }
        Err(error) => panic!("{error}"),
    }
}

fn assert_clean(device: &Device) {
    let messages = device.validation_messages();
    assert!(messages.is_empty(), "{messages:#?}");
}

fn shader(file: &str) -> Shader {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/shaders");
    let variant = Variant {
        name: format!("test/{file}"),
        stage: stage_of(file).expect("a shader's extension"),
        path: folder.join(file),
        folder,
        source: None,
        defines: Vec::new(),
    };
    Compiler::new().compile(&variant).expect("the shader compiles").shader
}

fn covering(depth_ndc: f32, state: RasterState) -> Draw<'static> {
    Draw::new(state, DrawCall::vertices(3)).push(&depth_ndc)
}

fn groups(width: u32, height: u32) -> [u32; 3] {
    [width.div_ceil(8), height.div_ceil(8), 1]
}

/// What `pattern`, `paint` and `copy` make of a pixel.
fn expected_pixel(x: u32, y: u32, shift: u32) -> [u8; 4] {
    [((x + y * WIDTH + shift) & 0xff) as u8, x as u8, y as u8, 255]
}

/// Clear, compute, compute, raster and copies, twice over, with memory that is shared along the way.
fn chain(g: &mut Graph, name: &str, (role, holds): (PassRole, BufferRole), shift: u32) -> ImageHandle {
    let pixels = u64::from(WIDTH * HEIGHT);
    let values = g.buffer(&format!("{name}/values"), holds, pixels * 4);
    let values = g.clear_buffer(&format!("{name}/clear"), role, values, 7);
    let mut pass = g.compute(&format!("{name}/pattern"), role, &shader("pattern.comp"));
    let values = pass.constant("SHIFT", shift).push(&[WIDTH, HEIGHT]).write("Values", values);
    pass.dispatch(groups(WIDTH, HEIGHT));
    let copied = g.buffer(&format!("{name}/copied"), holds, pixels * 4);
    let copied = g.copy_buffer(&format!("{name}/copy"), role, &values, copied);
    let painted = g.image(&format!("{name}/painted"), holds, ImageInfo::new(COLOR, WIDTH, HEIGHT));
    let mut pass = g.compute(&format!("{name}/paint"), role, &shader("paint.comp"));
    pass.read("Values", &copied);
    let painted = pass.write("painted", painted);
    pass.dispatch(groups(WIDTH, HEIGHT));
    let target = g.image(&format!("{name}/target"), holds, ImageInfo::new(COLOR, WIDTH, HEIGHT));
    let mut pass = g.raster(&format!("{name}/show"), role);
    pass.read_sampled("source", &painted, SamplerDesc::NEAREST);
    let target = pass.color(target, Load::DontCare);
    let state = RasterState::new(&shader("triangle.vert"), Some(&shader("copy.frag")));
    pass.draw(covering(0.0, state));
    let last = g.image(&format!("{name}/last"), holds, ImageInfo::new(COLOR, WIDTH, HEIGHT));
    g.copy_image(&format!("{name}/copy image"), role, &target, last)
}

/// Checks every pixel of an image that [`chain`] made.
fn assert_pixels(bytes: &[u8], shift: u32, what: &str) {
    for (index, texel) in bytes.chunks_exact(4).enumerate() {
        let (x, y) = (index as u32 % WIDTH, index as u32 / WIDTH);
        assert_eq!(texel, expected_pixel(x, y, shift), "{what} at {x},{y}");
    }
}

/// A device that allocates little at once.
struct SmallAllocations<'a> {
    device: &'a Device,
    most_bytes: u64,
}

impl Requirements for SmallAllocations<'_> {
    fn image(
        &self,
        name: &str,
        info: &ImageInfo,
        usage: vk::ImageUsageFlags,
    ) -> Result<MemoryNeed, GpuError> {
        self.device.image(name, info, usage)
    }
    fn buffer(&self, name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> Result<MemoryNeed, GpuError> {
        Requirements::buffer(self.device, name, bytes, usage)
    }
    fn most_allocation_bytes(&self) -> u64 {
        self.most_bytes
    }
    fn most_groups(&self) -> [u32; 3] {
        self.device.most_groups()
    }
}

/// A frame that is larger than one allocation lies in several, and gives the same pixels.
#[test]
fn a_chain_in_several_allocations_gives_the_right_pixels() {
    let Some(device) = open() else { return };
    let planned = |most_bytes: u64| {
        let mut g = Graph::new();
        for (name, shift) in [("first", 3), ("second", 200), ("third", 77)] {
            let last = chain(&mut g, name, (PassRole::Shading, BufferRole::Targets), shift);
            g.keep(&last);
        }
        g.plan(&SmallAllocations { device: &device, most_bytes }).expect("a valid frame")
    };
    let whole = planned(u64::MAX);
    let largest = whole.resources.iter().map(|resource| resource.need.bytes).max().expect("resources");
    let split = planned(largest);
    assert!(split.heaps.len() > whole.heaps.len(), "{:?} and {:?}", split.heaps, whole.heaps);
    assert!(split.heaps.iter().all(|heap| heap.bytes <= largest), "{:?}", split.heaps);
    let mut executor = Executor::new(&device, split).expect("an executor");
    for _ in 0..2 {
        executor.run().expect("a run");
        for (name, shift) in [("first/last", 3), ("second/last", 200), ("third/last", 77)] {
            assert_pixels(&executor.read_image(name).expect("a kept image"), shift, name);
        }
    }
    drop(executor);
    assert_clean(&device);
}

/// A frame of so many buffers that live at once, half of an allocation each.
fn large_frame(device: &Device, buffers: u64) -> Plan {
    let mut g = Graph::new();
    for index in 0..buffers {
        let buffer = g.buffer(&format!("b{index}"), BufferRole::Counters, half_allocation(device));
        let buffer = g.clear_buffer(&format!("clear {index}"), PassRole::Upkeep, buffer, 0);
        g.keep(&buffer);
    }
    let plan = g.plan(device).expect("a valid frame");
    let most = device.features().max_allocation_bytes;
    assert!(plan.heaps.len() > 1 && plan.heaps.iter().all(|heap| heap.bytes <= most), "{:?}", plan.heaps);
    plan
}

fn half_allocation(device: &Device) -> u64 {
    device.features().max_allocation_bytes.min(device.features().max_buffer_bytes.saturating_sub(1 << 20)) / 2
}

/// One and a half allocations: on lavapipe (Mesa 22.3) more than the heap that it tells of as well. Nothing runs, so that no page is touched.
#[test]
fn a_frame_larger_than_one_allocation_is_allocated() {
    let Some(device) = open() else { return };
    if device.allocatable_bytes() < 4 * half_allocation(&device) {
        return skip(Need::ReachableLimit, "the host has too little memory left for two allocations");
    }
    Executor::new(&device, large_frame(&device, 3)).expect("two allocations");
    assert_clean(&device);
}

/// Each heap is an allocation that the device allows, all of them are more than it has: told before any is made.
#[test]
fn a_frame_larger_than_the_memory_is_told() {
    let Some(device) = open() else { return };
    // What a host has left may grow meanwhile.
    let there = 2 * device.allocatable_bytes();
    match Executor::new(&device, large_frame(&device, there / half_allocation(&device) + 1)) {
        Err(GraphError::Gpu(GpuError::OutOfMemory { resource, bytes })) => {
            assert!(resource.contains("the frame") && bytes > there, "{resource}: {bytes}");
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("a frame of more than {there} bytes"),
    }
    assert_clean(&device);
}

#[test]
fn a_chain_with_shared_memory_gives_the_right_pixels() {
    let Some(device) = open() else { return };
    let mut g = Graph::new();
    let first = chain(&mut g, "first", (PassRole::Shading, BufferRole::Targets), 3);
    g.keep(&first);
    let second = chain(&mut g, "shared/second", (PassRole::Shared, BufferRole::Shared), 200);
    g.keep(&second);
    g.mark_output(&second);
    let plan = g.plan(&device).expect("a valid frame");
    assert_eq!(plan.passes.len(), 12);
    assert!(plan.dropped.is_empty() && plan.unused_slots.is_empty());
    let mut executor = Executor::new(&device, plan).expect("an executor");
    for run in 0..3 {
        let report = executor.run_counted().expect("a run");
        for (name, shift) in [("first/last", 3), ("shared/second/last", 200)] {
            let bytes = executor.read_image(name).expect("a kept image");
            assert_pixels(&bytes, shift, &format!("run {run}: {name}"));
        }
        assert_eq!(report.passes.len(), 12);
        let sum: f64 = report.passes.iter().filter_map(|pass| pass.time_ns).sum();
        let frame = report.frame_ns.expect("lavapipe and real devices have timestamps");
        assert!(
            report.passes.iter().all(|pass| pass.time_ns.is_some()) && (sum - frame).abs() < 1e3,
            "{report:#?}"
        );
        assert!(report.technique_ns().expect("timestamps") < frame);
        let show = report.pass("first/show").and_then(|pass| pass.statistics).expect("statistics");
        assert_eq!((show.vertex_invocations, show.input_primitives), (3, 1));
        assert!(show.fragment_invocations >= u64::from(WIDTH * HEIGHT), "{show:?}");
        let pattern = report.pass("first/pattern").and_then(|pass| pass.statistics).expect("statistics");
        assert_eq!(pattern.compute_invocations, 5 * 3 * 64);
        let total: u64 = report.memory.iter().map(|resource| resource.bytes).sum();
        assert_eq!(report.memory.len(), 10);
        assert!(report.peak_bytes < total, "{} of {total} bytes", report.peak_bytes);
        let own: u64 = report
            .memory
            .iter()
            .filter(|resource| !resource.shared && !resource.output)
            .map(|r| r.bytes)
            .sum();
        assert_eq!(report.technique_bytes, own);
    }
    assert!(matches!(executor.read_image("first/target"), Err(GraphError::NotReadable { .. })));
    assert!(matches!(executor.read_image("nothing"), Err(GraphError::NotReadable { .. })));
    assert!(matches!(executor.read_buffer("first/last"), Err(GraphError::NotReadable { .. })));
    assert_clean(&device);
}

#[test]
fn depth_is_sampled_while_the_stencil_counts() {
    let Some(device) = open() else { return };
    let format = device.depth_stencil_format();
    let mut g = Graph::new();
    let depth = g.image("depth", BufferRole::Depth, ImageInfo::new(format, WIDTH, HEIGHT));
    let color = g.image("color", BufferRole::Targets, ImageInfo::new(COLOR, WIDTH, HEIGHT));
    let (triangle, half) = (shader("triangle.vert"), shader("half.vert"));
    let strip = |state: RasterState, depth_ndc: f32| {
        Draw::new(state.topology(vk::PrimitiveTopology::TRIANGLE_STRIP), DrawCall::vertices(4))
            .push(&depth_ndc)
    };

    let mut pass = g.raster("prepass", PassRole::DepthPrepass);
    let depth = pass.depth(depth, Load::Clear(0.0));
    pass.stencil_clear(1);
    pass.draw(covering(0.25, RasterState::new(&triangle, None).depth(DepthTest::NEAREST)));
    pass.draw(strip(RasterState::new(&half, None).depth(DepthTest::NEAREST), 0.75));

    // Where a surface lies behind 0.5, the stencil is raised; then that stencil masks what is added.
    let raise = StencilTest {
        front: StencilFace { pass: vk::StencilOp::INCREMENT_AND_CLAMP, ..StencilFace::KEEP },
        back: StencilFace { pass: vk::StencilOp::INCREMENT_AND_CLAMP, ..StencilFace::KEEP },
        compare_mask: 0xff,
        write_mask: 0xff,
    };
    let equal = StencilFace { compare: vk::CompareOp::EQUAL, ..StencilFace::KEEP };
    let masked = StencilTest { front: equal, back: equal, compare_mask: 0xff, write_mask: 0 };
    let mut pass = g.raster("light", PassRole::Shading);
    pass.read("depth_map", &depth);
    let color = pass.color(color, Load::Clear([0.0; 4]));
    let depth = pass.stencil(depth, Load::Keep);
    let behind = DepthTest { compare: vk::CompareOp::GREATER, write: false };
    pass.draw(covering(
        0.5,
        RasterState::new(&triangle, None).depth(behind).stencil(raise).blend([Blend::NONE]),
    ));
    let show = RasterState::new(&triangle, Some(&shader("depth.frag"))).stencil(masked).blend([Blend::ADD]);
    pass.draw(covering(0.0, show.clone()).stencil_reference(2));
    pass.clear_stencil(9, None);
    pass.draw(covering(0.0, show.clone()).stencil_reference(9));

    // Depth tested and sampled at once, neither written.
    let mut pass = g.raster("equal", PassRole::Shading);
    pass.read("depth_map", &depth).depth_read_only(&depth);
    let color = pass.color(color, Load::Keep);
    let state =
        RasterState::new(&triangle, Some(&shader("depth.frag"))).depth(DepthTest::EQUAL).blend([Blend::ADD]);
    pass.draw(covering(0.25, state));
    g.keep(&color);
    g.keep(&depth);
    let plan = g.plan(&device).expect("a valid frame");
    let mut executor = Executor::new(&device, plan).expect("an executor");
    for _ in 0..2 {
        executor.run().expect("a run");
        let bytes = executor.read_image("color").expect("kept");
        for (index, texel) in bytes.chunks_exact(4).enumerate() {
            let left = (index as u32 % WIDTH) * 2 + 1 < WIDTH;
            // Left: depth 0.75, shown once. Right: depth 0.25, shown by the mask, by the cleared stencil, and as equal.
            let (red, green) = if left { (191, 1) } else { (192, 3) };
            assert!(
                texel[0].abs_diff(red) <= 2 && texel[1] == green,
                "{index}: {texel:?}, expected {red} {green}"
            );
        }
        let depths = executor.read_image("depth").expect("kept");
        if format == vk::Format::D32_SFLOAT_S8_UINT {
            assert_eq!(bytemuck::pod_read_unaligned::<f32>(&depths[..4]), 0.75);
        }
    }
    assert_clean(&device);
}

#[test]
fn a_mip_pyramid_reads_one_level_and_writes_the_next() {
    let Some(device) = open() else { return };
    let mut g = Graph::new();
    let format = vk::Format::R32_SFLOAT;
    let pyramid = g.image("pyramid", BufferRole::Targets, ImageInfo::new(format, 32, 16).mips(5));
    let mut pass = g.compute("ramp", PassRole::LightAssignment, &shader("ramp.comp"));
    let mut pyramid = pass.write_range("ramp", pyramid, Subresource::mip(0));
    pass.dispatch(groups(32, 16));
    let down = shader("down.comp");
    for mip in 1..5 {
        let mut pass = g.compute(&format!("down {mip}"), PassRole::LightAssignment, &down);
        pass.read_range("finer", &pyramid, Subresource::mip(mip - 1));
        pyramid = pass.write_range("coarser", pyramid, Subresource::mip(mip));
        pass.dispatch(groups(32 >> mip, 16 >> mip));
    }
    let out = g.buffer("out", BufferRole::Lights, 8);
    let out = g.copy_image_to_buffer("last level", PassRole::Upkeep, &pyramid, Subresource::mip(4), out);
    g.keep(&out);
    let plan = g.plan(&device).expect("a valid frame");
    let mut executor = Executor::new(&device, plan).expect("an executor");
    executor.run().expect("a run");
    let bytes = executor.read_buffer("out").expect("kept");
    let values: Vec<f32> = bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
    assert_eq!(values, [1515.0, 3115.0]);
    assert_clean(&device);
}

#[test]
fn arguments_made_on_the_device_draw_and_dispatch() {
    let Some(device) = open() else { return };
    let mut g = Graph::new();
    let (arguments, indices) =
        (g.buffer("arguments", BufferRole::Lights, 36), g.buffer("indices", BufferRole::Lights, 12));
    let mut pass = g.compute("arguments", PassRole::LightAssignment, &shader("arguments.comp"));
    let arguments = pass.write("Arguments", arguments);
    let indices = pass.write("Indices", indices);
    pass.dispatch([1; 3]);
    let color = g.image("color", BufferRole::Targets, ImageInfo::new(COLOR, WIDTH, HEIGHT));
    let state = RasterState::new(&shader("triangle.vert"), Some(&shader("white.frag")));
    let mut pass = g.raster("indirect", PassRole::Shading);
    let color = pass.color(color, Load::Clear([0.0; 4]));
    let call = DrawCall::IndexedIndirect { buffer: &arguments, offset: 0, count: 1, stride: 20 };
    pass.draw(Draw::new(state, call).push(&0.0f32).index_buffer(&indices, vk::IndexType::UINT32));
    let counter = g.buffer("counter", BufferRole::Counters, 4);
    let counter = g.clear_buffer("clear", PassRole::Upkeep, counter, 0);
    let mut pass = g.compute("count", PassRole::LightAssignment, &shader("count.comp"));
    let counter = pass.write("Counter", counter);
    pass.dispatch_indirect(&arguments, 20).dispatch([1; 3]);
    g.keep(&counter);
    g.keep(&color);
    let plan = g.plan(&device).expect("a valid frame");
    let mut executor = Executor::new(&device, plan).expect("an executor");
    executor.run().expect("a run");
    let count: u32 = bytemuck::pod_read_unaligned(&executor.read_buffer("counter").expect("kept"));
    // The arguments ask for 2×3×1 groups of 4, and one more group is dispatched directly.
    assert_eq!(count, 4 * 7);
    assert!(executor.read_image("color").expect("kept").iter().all(|byte| *byte == 255));
    assert_clean(&device);
}

/// Tessellation makes 24 triangles of one (1.5 n² for n segments), a geometry shader numbers them and counts in a buffer; constants and push
/// constants reach the stages that have them.
#[test]
fn a_tessellated_triangle_is_counted() {
    let Some(device) = open() else { return };
    if !has_tessellation(&device) {
        return;
    }
    let mut g = Graph::new();
    let count = g.buffer("count", BufferRole::Counters, 4);
    let count = g.clear_buffer("clear", PassRole::Upkeep, count, 0);
    let color = g.image("color", BufferRole::Targets, ImageInfo::new(COLOR, WIDTH, HEIGHT));
    let mut pass = g.raster("patches", PassRole::Shading);
    let count = pass.write("Count", count);
    let color = pass.color(color, Load::Clear([1.0; 4]));
    let state = RasterState::new(&shader("patch.vert"), Some(&shader("primitive.frag")))
        .tessellation(&shader("patch.tesc"), &shader("patch.tese"))
        .geometry(&shader("count.geom"))
        .constant("SEGMENTS", 4u32)
        .constant("STEP", 3u32);
    pass.draw(covering(0.5, state));
    g.keep(&count);
    g.keep(&color);
    let plan = g.plan(&device).expect("a valid frame");
    let mut executor = Executor::new(&device, plan).expect("an executor");
    for _ in 0..2 {
        let report = executor.run_counted().expect("a run");
        let bytes = executor.read_buffer("count").expect("kept");
        assert_eq!(bytes, (24u32 * 3).to_ne_bytes());
        let statistics = report.pass("patches").and_then(|pass| pass.statistics).expect("statistics");
        assert_eq!(statistics.clipping_invocations, 24);
        // A quarter of the covering triangle's area is the image: some of its parts, every one with a multiple of 3.
        let pixels = executor.read_image("color").expect("kept");
        let mut ids: Vec<u8> = pixels.chunks_exact(4).map(|texel| texel[0]).collect();
        ids.sort_unstable();
        ids.dedup();
        assert!(ids.len() > 4 && ids.iter().all(|id| id % 3 == 0 && *id < 72), "{ids:?}");
    }
    assert_clean(&device);
}

#[test]
fn four_samples_are_resolved() {
    let Some(device) = open() else { return };
    if sample_counts(&device, &[4]).is_empty() {
        return;
    }
    let mut g = Graph::new();
    let many = g.image("many", BufferRole::Targets, ImageInfo::new(COLOR, WIDTH, HEIGHT).samples(4));
    let one = g.image("one", BufferRole::Targets, ImageInfo::new(COLOR, WIDTH, HEIGHT));
    let mut pass = g.raster("edge", PassRole::Shading);
    let _ = pass.color(many, Load::Clear([0.0; 4]));
    let one = pass.resolve(one);
    let state = RasterState::new(&shader("half.vert"), Some(&shader("white.frag")))
        .topology(vk::PrimitiveTopology::TRIANGLE_STRIP);
    pass.draw(Draw::new(state, DrawCall::vertices(4)).push(&0.5f32));
    g.keep(&one);
    let plan = g.plan(&device).expect("a valid frame");
    let mut executor = Executor::new(&device, plan).expect("an executor");
    executor.run().expect("a run");
    let bytes = executor.read_image("one").expect("kept");
    // The edge at 18.5 of 37 pixels cuts the pixel in its middle: half of the samples.
    let reds: Vec<u8> = (16..21).map(|x| bytes[x * 4]).collect();
    assert!(matches!(reds[..], [255, 255, 127 | 128, 0, 0]), "{reds:?}");
    assert_clean(&device);
}

#[test]
fn resources_from_outside_keep_their_contents_and_layout() {
    let Some(device) = open() else { return };
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let desc = BufferDesc { name: "outside", bytes: 4, usage, memory: MemoryKind::Upload };
    let counter: Buffer = device.create_buffer(&desc).expect("a buffer");
    counter.write(0, &5u32.to_ne_bytes()).expect("mapped");
    let image = device
        .create_image(&ImageDesc {
            name: "outside image",
            format: COLOR,
            width: 4,
            height: 4,
            layers: 1,
            mips: 1,
            samples: 1,
            usage: vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC,
        })
        .expect("an image");
    let count = shader("count.comp");
    let declare = || {
        let mut g = Graph::new();
        let buffer = g.import_buffer("counter", BufferRole::Counters, &counter);
        let mut pass = g.compute("count", PassRole::LightAssignment, &count);
        let _ = pass.write("Counter", buffer);
        pass.dispatch([1; 3]);
        let image = g.import_image("image", BufferRole::Targets, &image, vk::ImageLayout::UNDEFINED);
        let _ = g.clear_image("clear", PassRole::Upkeep, image, [1.0, 0.0, 0.0, 1.0]);
        g
    };
    let plan = declare().plan(&device).expect("a valid frame");
    assert_eq!((plan.peak_bytes(), plan.technique_bytes()), (0, 0));
    let mut executor = Executor::new(&device, plan).expect("an executor");
    for _ in 0..3 {
        executor.run().expect("a run");
    }
    let count: u32 = bytemuck::pod_read_unaligned(&executor.read_buffer("counter").expect("imported"));
    assert_eq!(count, 5 + 3 * 4);
    assert_eq!(executor.read_image("image").expect("imported")[..4], [255, 0, 0, 255]);

    // A pass needs a usage that the image was not made with.
    let mut g = Graph::new();
    let handle = g.import_image("image", BufferRole::Targets, &image, vk::ImageLayout::UNDEFINED);
    let _ = g.raster("draw", PassRole::Shading).color(handle, Load::Clear([0.0; 4]));
    let plan = g.plan(&device).expect("a valid frame");
    let error = Executor::new(&device, plan).err().expect("an error").to_string();
    assert!(error.contains("\"image\"") && error.contains("COLOR_ATTACHMENT"), "{error}");
    assert_clean(&device);
}

/// The tests above rest on validation: it must see a barrier that is not there.
#[test]
fn validation_sees_a_dropped_barrier() {
    let Some(device) = open() else { return };
    let mut g = Graph::new();
    let last = chain(&mut g, "chain", (PassRole::Shading, BufferRole::Targets), 0);
    g.keep(&last);
    let sound = g.plan(&device).expect("a valid frame");
    for (index, pass) in ["chain/pattern", "chain/copy", "chain/show"].iter().enumerate() {
        let mut mutant = sound.clone();
        let planned = mutant.passes.iter_mut().find(|planned| planned.name == *pass).expect("planned");
        assert!(!planned.barriers.is_empty(), "{pass}");
        planned.barriers.clear();
        Executor::new(&device, mutant).expect("an executor").run().expect("a run");
        let messages = device.validation_messages();
        assert!(!messages.is_empty(), "mutant {index}: no barrier before {pass}");
    }
}

/// Prints what recording costs; the bound is the issue's, tenfold where the code is not optimised.
#[test]
fn twenty_passes_are_recorded_quickly() {
    // Without validation: it is the recording that counts.
    let device = match Device::open(&DeviceOptions::default()) {
        Ok(device) => device,
        Err(error) => return skip(Need::Device, &error.to_string()),
    };
    let mut g = Graph::new();
    for index in 0..4 {
        let last = chain(&mut g, &format!("chain{index}"), (PassRole::Shading, BufferRole::Targets), index);
        g.keep(&last);
    }
    let plan = g.plan(&device).expect("a valid frame");
    let pass_count = plan.passes.len();
    assert!(pass_count >= 20);
    let mut executor = Executor::new(&device, plan).expect("an executor");
    let mut times: Vec<u64> = (0..21).map(|_| executor.run().expect("a run").cpu_record_ns).collect();
    times.sort_unstable();
    println!("{pass_count} passes recorded in {} µs (median of 21 runs)", times[10] / 1000);
    assert!(times[10] < 5_000_000, "{times:?}");
}
