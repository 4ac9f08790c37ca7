//! How long a scene takes to build on the CPU: meshes, tangents, packing.

use std::hint::black_box;

use afterlight_scene::{LoadOptions, load_source};
use criterion::{Criterion, criterion_group, criterion_main};

/// Few enough triangles that `cargo test`, which runs a bench once, is not slowed.
const SCENE: &str = "builtin:colonnade?triangles=16384";

fn colonnade(c: &mut Criterion) {
    c.bench_function(SCENE, |bencher| {
        bencher.iter(|| black_box(load_source(black_box(SCENE), &LoadOptions::default()).is_ok()));
    });
}

criterion_group!(benches, colonnade);
criterion_main!(benches);
