//! What a frame costs the CPU: to prepare it (record the technique, plan the graph, allocate, make pipelines) and to record its commands.
//! Small images: the device's work is not what is measured. Without a Vulkan device it says so and measures nothing.

use std::{hint::black_box, time::Duration};

use afterlight_renderer::Renderer;
use afterlight_techniques::{
    Params, Settings, find,
    graph::gpu,
    scene::{LoadOptions, lights::seeded_lights, load_source},
};
use criterion::{Criterion, criterion_group, criterion_main};

/// Techniques with few and with many passes.
const TECHNIQUES: &[&str] = &["forward", "clustered", "dais"];
/// Few enough triangles that `cargo test`, which runs a bench once, is not slowed.
const SCENE: &str = "builtin:colonnade?triangles=5000";

fn record(c: &mut Criterion) {
    let options =
        gpu::DeviceOptions { select: std::env::var("AFTERLIGHT_DEVICE").ok(), ..Default::default() };
    let device = match gpu::Device::open(&options) {
        Ok(device) => device,
        Err(error) => return println!("skipped: there is no Vulkan device ({error})"),
    };
    let scene = load_source(SCENE, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let mut settings = Settings::for_scene(&scene, 64, 64);
    settings.lights = seeded_lights(&scene.bounds_ws(), 100, 1);
    let renderer = Renderer::new(&device, &scene, &settings).unwrap_or_else(|error| panic!("{error}"));
    let params = Params::default();
    for id in TECHNIQUES {
        let Some(technique) = find(id) else { panic!("found no technique {id}") };
        let prepare = || renderer.prepare(technique, &params).unwrap_or_else(|error| panic!("{id}: {error}"));
        c.bench_function(&format!("prepare {id}"), |bencher| bencher.iter(|| black_box(prepare())));
        let mut prepared = prepare();
        c.bench_function(&format!("record the commands of {id}"), |bencher| {
            bencher.iter_custom(|frames| {
                let record_ns = |_| match prepared.run() {
                    Ok(report) => report.cpu_record_ns,
                    Err(error) => panic!("{id}: {error}"),
                };
                Duration::from_nanos((0..frames).map(record_ns).sum())
            });
        });
    }
}

criterion_group!(benches, record);
criterion_main!(benches);
