//! Items a second that the device sorts (`shared/sort`): random keys by 32 and by 16 bits, and keys that are all equal. The time is that of the
//! sort's passes by the device's timestamps; filling its input again is left out. Without a Vulkan device, or timestamps, it says so and
//! measures nothing.

use std::time::Duration;

use afterlight_renderer::Renderer;
use afterlight_stages::shared::sort::{self, ItemCount, Items, KeyBits};
use afterlight_techniques::{
    Frame, Info, Params, SHADERS, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    find,
    graph::{BufferHandle, BufferRole, Graph, ImageHandle, PassRole, gpu},
    scene::{LoadOptions, load_source, rng::SplitMix64},
    shader::Shader,
};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const SCENE: &str = "builtin:intersect";
/// Fewer on a CPU, where more only take longer.
const ITEMS: u32 = 1 << 24;
const ITEMS_ON_CPU: u32 = 1 << 18;

/// A sort, and nothing else.
struct Sorting {
    keys: Vec<u32>,
    key_bits: KeyBits,
}

fn filled(
    graph: &mut Graph,
    frame: &Frame<'_>,
    name: &str,
    words: &[u32],
) -> Result<BufferHandle, TechniqueError> {
    let table = frame.table(graph, &format!("input {name}"), BufferRole::Counters, words)?;
    let buffer = graph.buffer(name, BufferRole::Counters, table.bytes());
    Ok(graph.copy_buffer(&format!("fill {name}"), PassRole::Upkeep, &table, buffer))
}

impl Technique for Sorting {
    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }
    fn info(&self) -> &Info {
        match find("forward") {
            Some(technique) => technique.info(),
            None => panic!("found no technique forward"),
        }
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let count = self.keys.len() as u32;
        let items = Items {
            keys: filled(graph, frame, "keys", &self.keys)?,
            values: filled(graph, frame, "values", &(0..count).collect::<Vec<_>>())?,
        };
        let roles = (PassRole::Upkeep, BufferRole::Counters);
        let count = ItemCount::Known(count);
        let sorted = sort::by_key(graph, frame, "bench", roles, items, count, self.key_bits)?;
        graph.keep(&sorted.items.keys);
        graph.keep(&sorted.items.values);
        let info = frame.image_info(gpu::vk::Format::R16G16B16A16_SFLOAT);
        let image = graph.image("image", BufferRole::Targets, info);
        Ok(graph.clear_image("clear", PassRole::Upkeep, image, [0.0; 4]))
    }
}

fn sort_items(c: &mut Criterion) {
    let options =
        gpu::DeviceOptions { select: std::env::var("AFTERLIGHT_DEVICE").ok(), ..Default::default() };
    let device = match gpu::Device::open(&options) {
        Ok(device) => device,
        Err(error) => return println!("skipped: there is no Vulkan device ({error})"),
    };
    let scene = load_source(SCENE, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let settings = Settings::for_scene(&scene, 8, 8);
    let renderer = Renderer::new(&device, &scene, &settings).unwrap_or_else(|error| panic!("{error}"));
    let count = if device.info().kind == "cpu" { ITEMS_ON_CPU } else { ITEMS };
    let mut random = SplitMix64::new(1);
    let random: Vec<u32> = (0..count).map(|_| random.next_u64() as u32).collect();
    let equal = vec![0x1234_5678; count as usize];
    let mut group = c.benchmark_group(format!("sort {count} items"));
    group.throughput(Throughput::Elements(count.into()));
    for (what, keys, key_bits) in [
        ("random keys by 32 bits", &random, KeyBits::All32),
        ("random keys by 16 bits", &random, KeyBits::Low16),
        ("equal keys by 32 bits", &equal, KeyBits::All32),
    ] {
        let sorting = Sorting { keys: keys.clone(), key_bits };
        let mut prepared =
            renderer.prepare(&sorting, &Params::default()).unwrap_or_else(|error| panic!("{what}: {error}"));
        let mut sort_ns = || {
            let report = prepared.run().unwrap_or_else(|error| panic!("{what}: {error}"));
            let passes = report.passes.iter().filter(|pass| pass.name.starts_with("bench/"));
            passes.map(|pass| pass.time_ns).sum::<Option<f64>>()
        };
        if sort_ns().is_none() {
            return println!("skipped: {} has no timestamps", device.info().name);
        }
        group.bench_function(what, |bencher| {
            bencher.iter_custom(|frames| {
                let ns: f64 = (0..frames).filter_map(|_| sort_ns()).sum();
                Duration::from_nanos(ns as u64)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, sort_items);
criterion_main!(benches);
