//! How long a frame's plan takes on the CPU: order, barriers, lifetimes, places in memory. No device is opened.

use std::hint::black_box;

use afterlight_graph::{
    BufferHandle, BufferRole, Graph, ImageHandle, ImageInfo, MemoryNeed, PassRole, Plan, Requirements,
    gpu::{GpuError, vk},
};
use afterlight_shader::{
    Binding, BindingKind, ImageDim, ImageShape, Reflection, Shader, Shared, Stage, Text,
};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};

/// Groups of three passes: a clear, one that fills a buffer, one that reads the last images and writes another. The largest frames of the
/// techniques have about as many passes.
const GROUPS: usize = 20;

/// Memory as a device might want it.
struct Pages;

impl Requirements for Pages {
    fn image(&self, _: &str, info: &ImageInfo, _: vk::ImageUsageFlags) -> Result<MemoryNeed, GpuError> {
        let bytes = u64::from(info.width) * u64::from(info.height) * 8;
        Ok(MemoryNeed { bytes: bytes.next_multiple_of(4096), alignment: 4096, type_bits: 1 })
    }

    fn buffer(&self, _: &str, bytes: u64, _: vk::BufferUsageFlags) -> Result<MemoryNeed, GpuError> {
        Ok(MemoryNeed { bytes: bytes.next_multiple_of(256), alignment: 256, type_bits: 1 })
    }

    fn most_allocation_bytes(&self) -> u64 {
        u64::MAX
    }

    fn most_groups(&self) -> [u32; 3] {
        [65_535; 3]
    }
}

/// A compute shader that is never run: slots by name and kind, and whether it writes them.
fn shader(name: &'static str, slots: &[(&'static str, BindingKind, bool)]) -> Shader {
    let bindings: Vec<Binding> = slots
        .iter()
        .enumerate()
        .map(|(index, &(name, kind, written))| Binding {
            set: 0,
            binding: index as u32,
            name: Text::Static(name),
            kind,
            count: 1,
            readable: !written,
            writable: written,
            image: (kind != BindingKind::StorageBuffer).then_some(ImageShape {
                dim: ImageDim::D2,
                arrayed: false,
                multisampled: false,
            }),
        })
        .collect();
    Shader {
        name: name.into(),
        stage: Stage::Compute,
        spirv: Shared::Static(&[]),
        reflection: Reflection {
            bindings: bindings.into(),
            push_constant_bytes: 0,
            local_size: [8, 8, 1],
            spec_constants: Vec::new().into(),
            inputs: Vec::new().into(),
            outputs: Vec::new().into(),
        },
    }
}

struct Shaders {
    list: Shader,
    shade: Shader,
}

impl Shaders {
    fn new() -> Self {
        use BindingKind::{SampledImage, StorageBuffer, StorageImage};
        Self {
            list: shader("list", &[("before", SampledImage, false), ("lists", StorageBuffer, true)]),
            shade: shader(
                "shade",
                &[
                    ("first", SampledImage, false),
                    ("before", SampledImage, false),
                    ("lists", StorageBuffer, false),
                    ("image", StorageImage, true),
                ],
            ),
        }
    }
}

fn image(graph: &mut Graph, name: &str) -> ImageHandle {
    let info = ImageInfo::new(vk::Format::R16G16B16A16_SFLOAT, 1920, 1080);
    graph.image(name, BufferRole::Targets, info)
}

fn lists(graph: &mut Graph, group: usize, shaders: &Shaders, before: &ImageHandle) -> BufferHandle {
    let lists = graph.buffer(&format!("lists {group}"), BufferRole::Lights, 1 << 20);
    let lists = graph.clear_buffer(&format!("clear {group}"), PassRole::LightAssignment, lists, 0);
    let mut pass = graph.compute(&format!("list {group}"), PassRole::LightAssignment, &shaders.list);
    pass.read("before", before);
    let lists = pass.write("lists", lists);
    pass.dispatch([240, 135, 1]);
    pass.finish();
    lists
}

/// Declares a frame of [`GROUPS`] groups of passes.
fn frame(shaders: &Shaders) -> Graph {
    let mut graph = Graph::new();
    let first = image(&mut graph, "first");
    let first = graph.clear_image("clear first", PassRole::Upkeep, first, [0.0; 4]);
    let mut before = image(&mut graph, "image");
    before = graph.clear_image("clear image", PassRole::Upkeep, before, [0.0; 4]);
    for group in 0..GROUPS {
        let lists = lists(&mut graph, group, shaders, &before);
        let target = image(&mut graph, &format!("image {group}"));
        let mut pass = graph.compute(&format!("shade {group}"), PassRole::Shading, &shaders.shade);
        pass.read("first", &first).read("before", &before).read("lists", &lists);
        before = pass.write("image", target);
        pass.dispatch([240, 135, 1]);
        pass.finish();
    }
    graph.keep(&before);
    graph
}

fn planned(graph: Graph) -> Plan {
    graph.plan(&Pages).unwrap_or_else(|error| panic!("{error}"))
}

fn plan(c: &mut Criterion) {
    let shaders = Shaders::new();
    let passes = planned(frame(&shaders)).passes.len();
    assert_eq!(passes, 3 * GROUPS + 2, "every pass is needed");
    c.bench_function(&format!("declare {passes} passes"), |bencher| {
        bencher.iter(|| black_box(frame(&shaders)));
    });
    c.bench_function(&format!("plan {passes} passes"), |bencher| {
        bencher.iter_batched(|| frame(&shaders), |graph| black_box(planned(graph)), BatchSize::SmallInput);
    });
}

criterion_group!(benches, plan);
criterion_main!(benches);
