//! The lists of clusters on the device against their CPU twin, and what no list may miss.

mod common;

use std::collections::BTreeSet;

use afterlight_image::Rgba8Image;
use afterlight_oracle::{
    clusters::{ClusterView, slice_begins_m},
    tiles::light_reaches,
};
use afterlight_techniques::{
    Frame, Info, Params, Prepared, Settings, Technique, TechniqueError,
    clusters::{self, Grid},
    cost::{Cost, Workload},
    find, gbuffer,
    graph::{Graph, ImageHandle, gpu::vk},
    scene::{Camera, Light, LightKind, Projection, Scene},
    shader::Shader,
};
use common::{Stage, compiled_with_header, image_of, params, psnr, sources, wider};
use glam::{DVec4, Vec3};

/// The lists of `clustered` with everything kept.
struct Lists(Grid);

impl Technique for Lists {
    fn info(&self) -> &Info {
        find("clustered").unwrap().info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = gbuffer::fill(graph, frame, "clustered", vk::Format::D32_SFLOAT)?;
        graph.keep(&filled.depth);
        let lists = clusters::build(graph, frame, "clustered", self.0, &filled.depth)?;
        for buffer in [&lists.slices, &lists.kept, &lists.begins, &lists.lists] {
            graph.keep(buffer);
        }
        Ok(filled.accumulation)
    }
}

/// A shader of `folder/file` with text replaced in a header of the stage.
fn mutant(name: &str, header: &str, from: &str, to: &str) -> Shader {
    compiled_with_header(name, (&sources(), &format!("clusters/{header}")), &[(from, to)])
}

fn prepare(stage: &Stage, technique: &dyn Technique, settings: &Settings, shaders: &[Shader]) -> Prepared {
    stage.prepare_shaders(technique, settings, &Params::default(), shaders.iter().cloned())
}

fn words(prepared: &mut Prepared, name: &str) -> Vec<u32> {
    let bytes = prepared.executor().read_buffer(name).unwrap_or_else(|e| panic!("{e}"));
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// What the device left of a frame.
struct Found {
    /// View distance of every pixel that shows a surface, m, by the device's arithmetic.
    pixels: Vec<([u32; 2], f32, f32)>,
    begins_m: Vec<f64>,
    kept: Vec<u32>,
    lists: Vec<Vec<u32>>,
}

fn found(stage: &Stage, settings: &Settings, grid: Grid, shaders: &[Shader]) -> Found {
    let mut prepared = prepare(stage, &Lists(grid), settings, shaders);
    prepared.run().unwrap();
    let Projection::Perspective { near_m, .. } = settings.camera.projection else { panic!("perspective") };
    let depth = prepared.executor().read_image("clustered/depth").unwrap();
    let depth = depth.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).enumerate();
    let at = |i: usize| [i as u32 % settings.width_px, i as u32 / settings.width_px];
    let counters = prepared.counters().unwrap();
    assert!(counters.iter().all(|c| c.dropped == 0 && c.needed <= c.capacity), "{counters:?}");
    let needed = |name: &str| counters.iter().find(|c| c.name == name).expect("a counter").needed as usize;
    let begins = words(&mut prepared, "clustered/list begins");
    let lists = words(&mut prepared, "clustered/cluster lists");
    let kept = words(&mut prepared, "clustered/kept clusters")[..needed("clusters")].to_vec();
    assert_eq!(begins[kept.len()] as usize, needed("cluster lights"));
    let slices = words(&mut prepared, "clustered/cluster slices");
    Found {
        pixels: depth.filter(|(_, d)| *d > 0.0).map(|(i, d)| (at(i), d, near_m / d)).collect(),
        begins_m: slices.iter().map(|bits| f64::from(f32::from_bits(*bits))).collect(),
        lists: (0..kept.len()).map(|i| lists[begins[i] as usize..begins[i + 1] as usize].to_vec()).collect(),
        kept,
    }
}

impl Found {
    fn view(&self, settings: &Settings, grid: Grid) -> ClusterView {
        let size_px = [settings.width_px, settings.height_px];
        ClusterView::new(&settings.camera, size_px, grid.cluster_px, self.begins_m.clone())
    }

    /// Clusters of each pixel, two where rounding may take the next.
    fn clusters_of(view: &ClusterView, pixel: [u32; 2], distance_m: f32) -> [u32; 2] {
        [1.0 - 1e-6, 1.0 + 1e-6].map(|scale| view.cluster(pixel, scale * f64::from(distance_m)))
    }

    /// Decisions that differ from the twin's for the same lights, rounding left out.
    fn different(&self, view: &ClusterView, settings: &Settings) -> usize {
        let unlike = |(cluster, list): (&u32, &Vec<u32>)| {
            assert!(list.is_sorted_by(|a, b| a < b), "{list:?}");
            let decisions = view.cull(*cluster, &settings.lights);
            let differs = |(light, decision): (usize, &afterlight_oracle::tiles::Decision)| {
                // 32-bit arithmetic on coordinates of tens of metres is right to about 1e-5 m.
                decision.slack_m.abs() >= 1e-4
                    && decision.passes != list.binary_search(&(light as u32)).is_ok()
            };
            decisions.iter().enumerate().filter(|one| differs(*one)).count()
        };
        self.kept.iter().zip(&self.lists).map(unlike).sum()
    }

    /// Pairs of a pixel and a light: on the pixel's list, reached, reached and not on the list.
    fn pairs(&self, view: &ClusterView, settings: &Settings) -> [usize; 3] {
        let world_from_clip = view.clip_from_world().inverse();
        let mut pairs = [0; 3];
        for (pixel, depth, distance_m) in &self.pixels {
            let [low, high] = Self::clusters_of(view, *pixel, *distance_m);
            let list = self.kept.binary_search(&low).map_or(&[][..], |place| &self.lists[place][..]);
            let [x, y] = [0, 1].map(|i| (f64::from(pixel[i]) + 0.5) * 2.0 / f64::from(view.size_px[i]) - 1.0);
            let p = world_from_clip * DVec4::new(x, y, f64::from(*depth), 1.0);
            let point_ws = p.truncate() / p.w;
            pairs[0] += list.len();
            for (l, light) in settings.lights.iter().enumerate() {
                // within rounding of the range nothing arrives
                let near =
                    point_ws.distance(light.position_ws.as_dvec3()) < f64::from(light.range_m) * 0.9999;
                let reached = near && light_reaches(light, point_ws);
                pairs[1] += usize::from(reached);
                let missed = low == high && list.binary_search(&(l as u32)).is_err();
                pairs[2] += usize::from(reached && missed);
            }
        }
        pairs
    }
}

const GRIDS: [Grid; 3] = [
    Grid { cluster_px: 32, slices: 32, logarithmic: true },
    Grid { cluster_px: 17, slices: 7, logarithmic: false },
    Grid { cluster_px: 16, slices: 1, logarithmic: false },
];

#[test]
fn lists_are_those_of_the_cpu_twin_and_miss_no_light() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    for (size, count) in [((160, 90), 100), ((113, 61), 1500)] {
        let settings = stage.settings(size, count);
        for grid in GRIDS {
            let found = found(&stage, &settings, grid, &[]);
            let view = found.view(&settings, grid);

            let range_m = [found.begins_m[0], found.begins_m[grid.slices as usize]];
            let distances = || found.pixels.iter().map(|(_, _, distance_m)| *distance_m);
            let ends = [distances().fold(f32::MAX, f32::min), distances().fold(0.0, f32::max)];
            for (found, expected) in range_m.iter().zip(ends) {
                assert!((found / f64::from(expected) - 1.0).abs() < 1e-6, "{found}, expected {expected}");
            }
            let expected = slice_begins_m(range_m, grid.slices, grid.logarithmic);
            for (found, expected) in found.begins_m.iter().zip(&expected) {
                assert!((found / expected - 1.0).abs() < 1e-5, "{found}, expected {expected}");
            }

            let (mut sure, mut possible) = (BTreeSet::new(), BTreeSet::new());
            for (pixel, _, distance_m) in &found.pixels {
                let [low, high] = Found::clusters_of(&view, *pixel, *distance_m);
                possible.extend([low, high]);
                if low == high {
                    sure.insert(low);
                }
            }
            let kept: BTreeSet<u32> = found.kept.iter().copied().collect();
            assert!(found.kept.is_sorted_by(|a, b| a < b));
            assert!(sure.is_subset(&kept) && kept.is_subset(&possible), "{grid:?}: clusters kept");

            assert_eq!(found.different(&view, &settings), 0, "{grid:?}");
            let larger = Settings { lights: wider(&settings.lights, 1.02), ..settings.clone() };
            assert!(found.different(&view, &larger) > 0, "ranges larger by two percent go unseen");
            let [listed, reached, missed] = found.pairs(&view, &settings);
            let excess = listed as f64 / reached as f64;
            println!(
                "{size:?}, {count} lights, {grid:?}: {} clusters, {listed} pairs listed, {reached} reached: {excess:.2}",
                kept.len()
            );
            assert_eq!(missed, 0, "{grid:?}: pairs missed");
            assert!(reached > 10_000, "the view shows {reached} pairs");
        }
    }
}

#[test]
fn tests_that_are_too_tight_are_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let settings = stage.settings((160, 90), 300);
    let mutants = [
        ("cull.glsl", "float range_m = sphere.w;", "float range_m = 0.95 * sphere.w;"),
        ("cull.glsl", "slice_begins_m[slice + end]", "slice_begins_m[slice]"),
        ("cull.glsl", "slice_begins_m[slice + end]", "slice_begins_m[min(slice + 1u, SLICES - 1u) + end]"),
        (
            "cull.glsl",
            "min(first + CLUSTER_PX, frame.size_px)",
            "min(first + CLUSTER_PX / 2u, frame.size_px)",
        ),
    ];
    for (header, from, to) in mutants {
        let shaders =
            ["clusters/count.comp", "clusters/fill.comp"].map(|name| mutant(name, header, from, to));
        let found = found(&stage, &settings, GRIDS[0], &shaders);
        let view = found.view(&settings, GRIDS[0]);
        let [_, reached, missed] = found.pairs(&view, &settings);
        println!("{to}: {missed} of {reached} pairs missed");
        assert!(missed > 0, "{to} goes unseen");
        assert!(found.different(&view, &settings) > 0, "{to}: the twin agrees");
    }
}

fn image_with(stage: &Stage, id: &str, settings: &Settings, shaders: &[Shader]) -> Rgba8Image {
    image_of(&mut prepare(stage, find(id).unwrap(), settings, shaders))
}

/// A surface that asks the list of the next slice.
#[test]
fn the_next_slice_is_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let settings = stage.settings((160, 90), 100);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let wrong =
        mutant("clustered/shade.comp", "grid.glsl", "return low;", "return min(low + 1u, SLICES - 1u);");
    let db = psnr(&reference, &image_with(&stage, "clustered", &settings, &[wrong]));
    println!("the next slice: {db:.2} dB");
    assert!(db < 45.0, "a mutant within the bound: {db:.2} dB");
}

const TECHNIQUES: [&str; 3] = ["clustered", "clustered-forward", "tiled-forward"];

fn agree(stage: &Stage, settings: &Settings, what: &str) {
    let reference = stage.image(find("forward").unwrap(), settings);
    for id in TECHNIQUES {
        let mut prepared = stage.prepare(find(id).unwrap(), settings);
        let db = psnr(&reference, &image_of(&mut prepared));
        println!("{what}: {id} {db:.2} dB, {:?}", prepared.counters().unwrap());
        assert!(db >= 50.0, "{what}: {id}: {db:.2} dB to forward");
    }
}

#[test]
fn ten_thousand_lights_on_the_colonnade() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000&texture=64");
    for count in [1, 10_000] {
        agree(&stage, &stage.settings((96, 54), count), &format!("colonnade, {count} lights"));
    }
}

#[test]
fn ten_thousand_lights_on_sponza() {
    let gpu = afterlight_testkit::gpu();
    let Some(scenes) = afterlight_testkit::shared_scenes() else { return };
    let stage = Stage::new(&gpu, &scenes.join("sponza/sponza.gltf").to_string_lossy());
    let camera =
        Camera::look_at("view", Vec3::new(-9.0, 2.5, 0.0), Vec3::new(5.0, 3.0, 0.0), 60f32.to_radians(), 0.1);
    for count in [1, 10_000] {
        let settings = stage.from(camera.clone(), (96, 54), count);
        agree(&stage, &settings, &format!("sponza, {count} lights"));
    }
}

/// Lights without an end are on no list; spot lights are listed by their spheres. An empty scene has no cluster.
#[test]
fn lights_of_all_kinds_and_no_surface() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let mut settings = stage.settings((96, 54), 8);
    let position_ws = settings.camera.eye_ws() + Vec3::new(0.1, 0.3, 0.2);
    let direction_ws = Vec3::new(0.3, -0.8, -0.5).normalize();
    let light = |kind, range_m| Light { kind, position_ws, direction_ws, intensity: Vec3::ONE, range_m };
    settings.lights.extend([
        light(LightKind::Spot { inner_angle_rad: 0.3, outer_angle_rad: 0.9 }, 20.0),
        light(LightKind::Spot { inner_angle_rad: 0.0, outer_angle_rad: 0.5 }, f32::INFINITY),
        light(LightKind::Directional, f32::INFINITY),
    ]);
    agree(&stage, &settings, "all kinds");
    let stage = Stage::of(&gpu, Scene::default());
    agree(&stage, &stage.settings((20, 20), 3), "empty");
}

/// Every set of parameters gives the same image.
#[test]
fn grids_of_any_shape_agree() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let settings = stage.settings((113, 61), 200);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let technique = find("clustered").unwrap();
    for [cluster_px, slices, slicing] in [
        ["8", "256", "logarithmic"],
        ["256", "1", "uniform"],
        ["33", "5", "uniform"],
        ["64", "24", "logarithmic"],
    ] {
        let sets = [("cluster-px", cluster_px), ("slices", slices), ("slicing", slicing)];
        let mut prepared = stage.prepare_with(technique, &settings, &params(technique, &sets));
        let db = psnr(&reference, &image_of(&mut prepared));
        println!("{cluster_px} px, {slices} slices, {slicing}: {db:.2} dB");
        assert!(db >= 50.0, "{cluster_px} px, {slices} slices, {slicing}: {db:.2} dB");
    }
}

/// What is larger than the device takes is an error that names bytes. 20,000 lights that reach everything.
#[test]
fn lists_that_find_no_room_are_told() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let mut settings = stage.settings((320, 180), 20_000);
    settings.lights = wider(&settings.lights, 1e4);
    let limit = gpu.features().max_storage_buffer_range;
    let technique = find("clustered").unwrap();
    match stage.try_prepare(technique, &settings, &params(technique, &[("cluster-px", "8")])) {
        Err(error @ TechniqueError::TooLarge { .. }) => {
            println!("{error}");
            assert!(error.to_string().contains("bytes of the lists"), "{error}");
        }
        Err(error) => panic!("{error}"),
        Ok(_) => assert!(limit > 1 << 30, "{limit} bytes hold every list"),
    }
}
