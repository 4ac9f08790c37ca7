//! Frames that read what the frame before wrote, on whatever device the machine has, validation with synchronization checks on: any message
//! fails.

use std::path::{Path, PathBuf};

use afterlight_gpu::{Buffer, BufferDesc, Device, DeviceOptions, GpuError, MemoryKind, vk};
use afterlight_graph::{
    BufferRole, Executor, FrameInput, FrameSlot, Graph, ImageInfo, Load, PassRole, ResourceId, Subresource,
    Turn,
};
use afterlight_shader::Shader;
use afterlight_shader::compile::Compiler;
use afterlight_shader::manifest::{Variant, stage_of};
use afterlight_testkit::{Need, skip};

const WIDTH: u32 = 13;
const HEIGHT: u32 = 9;

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

fn remember() -> Shader {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/shaders");
    let file = "remember.comp";
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

/// A frame that remembers, the buffer with its number, what it saw, and the image that it leaves.
struct Remembering {
    executor: Executor,
    number: Buffer,
    seen: ResourceId,
    left: ResourceId,
}

impl Remembering {
    fn new(device: &Device) -> Self {
        Self::after(device, WIDTH, None)
    }

    /// With images of a width, after a frame that another plan has drawn.
    fn after(device: &Device, width: u32, earlier: Option<&Executor>) -> Self {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
        let desc = BufferDesc { name: "number", bytes: 16, usage, memory: MemoryKind::DeviceLocal };
        let number = device.create_buffer(&desc).expect("a buffer");
        let mut g = Graph::new();
        let info = ImageInfo::new(vk::Format::R32_UINT, width, HEIGHT);
        let images = g.history_image("image", BufferRole::Targets, info);
        let counts = g.history_buffer("count", BufferRole::Counters, 4);
        let seen = g.buffer("seen", BufferRole::Counters, 4 * u64::from(WIDTH * HEIGHT + 1));
        let numbered = g.import_buffer("number", BufferRole::Constants, &number);
        let mut pass = g.compute("remember", PassRole::Shading, &remember());
        pass.read("Number", &numbered);
        pass.read("image_before", &images.before).read("CountBefore", &counts.before);
        let image = pass.write("image_now", images.now);
        let _count = pass.write("CountNow", counts.now);
        let seen = pass.write("Seen", seen);
        pass.dispatch([WIDTH.div_ceil(8), HEIGHT.div_ceil(8), 1]);
        pass.finish();
        let (seen, left) = (g.keep(&seen), g.keep(&image));
        let plan = g.plan(device).expect("a valid frame");
        assert!(plan.history_bytes() >= u64::from(2 * 4 * WIDTH * HEIGHT), "{}", plan.history_bytes());
        let history = earlier.and_then(Executor::history);
        let executor = Executor::after(device, plan, history.as_ref()).expect("an executor");
        Self { executor, number, seen, left }
    }

    fn slot(&self) -> FrameSlot {
        let inputs = [FrameInput::Buffer(self.number.clone())];
        self.executor.slot(&inputs, &[self.seen, self.left]).expect("a slot")
    }
}

/// What a frame with a number leaves in the image, and so what the next one sees.
fn image_of(number: u32) -> Vec<u32> {
    (0..WIDTH * HEIGHT).map(|place| number + place).collect()
}

/// Sends a frame on its way.
fn send(slot: &mut FrameSlot, number: u32, turn: Turn) {
    let write = |bytes: &mut [u8]| {
        bytes.fill(0);
        bytes[..4].copy_from_slice(&number.to_le_bytes());
    };
    slot.write(0, write).expect("an input");
    slot.submit(turn).expect("a submission");
}

/// The count and the image that a frame saw, once it is done; it left its own number.
fn seen(slot: &mut FrameSlot, number: u32) -> (u32, Vec<u32>) {
    let words = |bytes: &[u8]| -> Vec<u32> { bytemuck::cast_slice(bytes).to_vec() };
    let left = slot.read(1, words).expect("an output");
    assert_eq!(left, image_of(number), "what frame {number} leaves");
    let words = slot.read(0, words).expect("an output");
    (words[0], words[1..].to_vec())
}

/// Five frames, three on their way at once: the first finds zeros, each other one what the frame before wrote.
#[test]
fn frames_in_flight_see_the_frame_before() {
    let Some(device) = open() else { return };
    let frame = Remembering::new(&device);
    let mut slots = [frame.slot(), frame.slot(), frame.slot()];
    let (mut turn, mut done) = (Turn::default(), Vec::new());
    let number = |k: u32| 1000 * (k + 1);
    for k in 0..5 {
        let slot = &mut slots[k as usize % 3];
        if k >= 3 {
            done.push(seen(slot, number(k - 3)));
        }
        send(slot, number(k), turn);
        turn = turn.other();
    }
    done.extend((2..5).map(|k| seen(&mut slots[k as usize % 3], number(k))));
    assert_eq!(done[0], (0, vec![0; (WIDTH * HEIGHT) as usize]), "the first frame finds zeros");
    for (k, (count, image)) in (1..).zip(&done[1..]) {
        assert_eq!(*count, k, "frames before frame {k}");
        assert_eq!(*image, image_of(number(k - 1)), "what frame {k} finds");
    }
    assert_clean(&device);
}

/// A frame that is drawn again sees what it saw, and the next one what it left the second time.
#[test]
fn a_frame_that_is_drawn_again_sees_the_same() {
    let Some(device) = open() else { return };
    let frame = Remembering::new(&device);
    let mut slots = [frame.slot(), frame.slot()];
    let turns = [Turn::Even, Turn::Odd, Turn::Odd, Turn::Even];
    let numbers = [100, 200, 300, 400];
    let mut all = Vec::new();
    for (k, (number, turn)) in numbers.into_iter().zip(turns).enumerate() {
        send(&mut slots[k % 2], number, turn);
        all.push(seen(&mut slots[k % 2], number));
    }
    assert_eq!(all[1], (1, image_of(100)));
    assert_eq!(all[2], all[1], "drawn again");
    assert_eq!(all[3], (2, image_of(300)), "the one after it");
    assert_clean(&device);
}

/// A plan that takes the place of another one reads what frames of that one wrote; one of another size begins with zeros.
#[test]
fn history_outlives_a_plan() {
    let Some(device) = open() else { return };
    let first = Remembering::new(&device);
    assert!(!first.executor.takes_over());
    let mut slot = first.slot();
    send(&mut slot, 100, Turn::Even);
    send(&mut slot, 200, Turn::Odd);
    let held_bytes = device.held_bytes();
    let second = Remembering::after(&device, WIDTH, Some(&first.executor));
    assert!(second.executor.takes_over());
    let added = device.held_bytes() - held_bytes;
    let plan = second.executor.plan();
    assert!(added < plan.peak_bytes(), "{added} bytes more: what is taken over is not made again");
    // The first plan's last frame is drawn again, then one after it.
    let mut later = second.slot();
    send(&mut later, 300, Turn::Odd);
    assert_eq!(seen(&mut later, 300), (1, image_of(100)));
    drop((first, slot));
    send(&mut later, 400, Turn::Even);
    assert_eq!(seen(&mut later, 400), (2, image_of(300)));
    let other = Remembering::after(&device, WIDTH + 1, Some(&second.executor));
    assert!(!other.executor.takes_over(), "images of another size");
    let mut slot = other.slot();
    send(&mut slot, 500, Turn::Even);
    let count = slot.read(0, |bytes| bytes[..4].to_vec()).expect("an output");
    assert_eq!(count, [0; 4]);
    assert_clean(&device);
}

/// Runs that are waited for take turns too.
#[test]
fn runs_take_turns() {
    let Some(device) = open() else { return };
    let mut frame = Remembering::new(&device);
    let desc = BufferDesc {
        name: "first number",
        bytes: 16,
        usage: vk::BufferUsageFlags::TRANSFER_SRC,
        memory: MemoryKind::Upload,
    };
    let first = device.create_buffer(&desc).expect("a buffer");
    first.write(0, &7u32.to_le_bytes()).expect("written");
    let mut encoder = device.encoder().expect("an encoder");
    encoder.copy_buffer(&first, 0, &frame.number, 0, 16).expect("copied");
    device.submit(encoder).expect("submitted");
    for k in 0..4 {
        let report = frame.executor.run().expect("a frame");
        assert_eq!(report.history_bytes, frame.executor.plan().history_bytes());
        let bytes = frame.executor.read_buffer("seen").expect("kept");
        let words: &[u32] = bytemuck::cast_slice(&bytes);
        assert_eq!(words[0], k, "runs before run {k}");
        let expected = if k == 0 { 0 } else { 7 };
        assert_eq!(words[1], expected, "run {k}");
        let left = frame.executor.read_image("image").expect("kept");
        assert_eq!(bytemuck::cast_slice::<u8, u32>(&left), image_of(7), "run {k}");
    }
    assert_clean(&device);
}

/// Levels, layers and depth are kept as they are: colours by copies, depth by a raster pass.
#[test]
fn levels_layers_and_depth_have_history() {
    let Some(device) = open() else { return };
    let color = ImageInfo::new(vk::Format::R8G8B8A8_UNORM, WIDTH, HEIGHT).mips(3).layers(2);
    let depth = ImageInfo::new(vk::Format::D32_SFLOAT, WIDTH, HEIGHT);
    let mut g = Graph::new();
    let colors = g.history_image("colors", BufferRole::Targets, color);
    let shown = g.image("shown", BufferRole::Targets, color);
    let shown = g.copy_image("show", PassRole::Upkeep, &colors.before, shown);
    let _colors = g.clear_image("color", PassRole::Upkeep, colors.now, [1.0, 0.0, 0.2, 1.0]);
    let depths = g.history_image("depths", BufferRole::Depth, depth);
    let told = g.buffer("told", BufferRole::Depth, u64::from(4 * WIDTH * HEIGHT));
    let told =
        g.copy_image_to_buffer("tell", PassRole::Upkeep, &depths.before, Subresource::mip_layer(0, 0), told);
    let mut pass = g.raster("draw depth", PassRole::DepthPrepass);
    let _depths = pass.depth(depths.now, Load::Clear(0.25));
    pass.finish();
    g.keep(&shown);
    g.keep(&told);
    let plan = g.plan(&device).expect("a valid frame");
    let mut executor = Executor::new(&device, plan).expect("an executor");
    for run in 0..3 {
        executor.run().expect("a frame");
        let (texel, z) = if run == 0 { ([0; 4], 0.0f32) } else { ([255, 0, 51, 255], 0.25) };
        let shown = executor.read_image("shown").expect("kept");
        assert_eq!(shown.len(), 2 * 4 * (WIDTH * HEIGHT) as usize, "both layers");
        assert!(shown.chunks_exact(4).all(|found| found == texel), "run {run}: {:?}", &shown[..4]);
        let told = executor.read_buffer("told").expect("kept");
        let told: &[f32] = bytemuck::cast_slice(&told);
        assert!(told.iter().all(|found| *found == z), "run {run}: {}", told[0]);
    }
    assert_clean(&device);
}
