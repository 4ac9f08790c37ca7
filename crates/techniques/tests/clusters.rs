//! The lists of clusters on the device against their CPU twin, and what no list may miss.

mod common;

use std::collections::{BTreeMap, BTreeSet};

use afterlight_image::Rgba8Image;
use afterlight_oracle::{
    clusters::{Cell, ClusterView, slice_begins_m},
    tiles::{Decision, light_reaches},
};
use afterlight_renderer::{Prepared, Renderer};
use afterlight_stages::{
    lights::cells::{self, ClusterParams, Division, Slicing, TileParams, VisibleDepths},
    surfaces::gbuffer,
};
use afterlight_techniques::{
    Frame, Info, Params, SHADERS, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    device_order, find,
    graph::{Graph, ImageHandle, gpu::vk},
    scene::{Camera, Light, LightKind, Projection, Scene},
    shader::Shader,
};
use common::{Stage, compiled_variant, image_of, params, psnr, subgroup_sizes, wider};
use glam::{DVec4, Vec3};

/// The lists of `clustered` with everything kept.
struct Lists(Division);

impl Technique for Lists {
    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }

    fn info(&self) -> &Info {
        find("clustered").unwrap().info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = gbuffer::fill(graph, frame, "clustered", vk::Format::D32_SFLOAT)?;
        graph.keep(&filled.depth);
        let surfaces = VisibleDepths::of_depth(&filled.depth, 1);
        let lists = cells::build(graph, frame, "clustered", self.0, &surfaces)?;
        for buffer in [&lists.cells, &lists.ends, &lists.lists] {
            graph.keep(buffer);
        }
        Ok(filled.accumulation)
    }
}

/// A shader of `folder/file` with text replaced in a header of the stage.
fn mutant(name: &str, header: &str, from: &str, to: &str) -> Shader {
    compiled_variant(name, header, &[(from, to)])
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
    view: ClusterView,
    division: Division,
    /// View distances at which slices begin and the last ends, m.
    begins_m: Vec<f64>,
    /// Depth, and view distance in m, of every pixel that shows a surface, by the device's arithmetic.
    pixels: Vec<([u32; 2], f32, f32)>,
    /// Number and space of each cell.
    cells: Vec<(u32, Cell)>,
    /// Lights of each cell.
    lists: Vec<Vec<u32>>,
}

/// Slices of a tile, and whether they end at equal ratios.
fn slices(division: Division) -> (u32, bool) {
    match division {
        Division::Clusters(grid) => (grid.slices, grid.slicing == Slicing::Logarithmic),
        _ => (1, false),
    }
}

fn tile_px(division: Division) -> u32 {
    division.most_pixels().sqrt() as u32
}

fn found(stage: &Stage, settings: &Settings, division: Division, shaders: &[Shader]) -> Found {
    let mut prepared = prepare(stage, &Lists(division), settings, shaders);
    prepared.run().unwrap();
    let Projection::Perspective { near_m, .. } = settings.camera.projection else { panic!("perspective") };
    let depth = prepared.executor().read_image("clustered/depth").unwrap();
    let depth = depth.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).enumerate();
    let at = |i: usize| [i as u32 % settings.width_px, i as u32 / settings.width_px];
    let counters = prepared.counters().unwrap();
    assert!(counters.iter().all(|c| c.dropped == 0 && c.needed <= c.capacity), "{counters:?}");
    let needed = |name: &str| counters.iter().find(|c| c.name == name).expect("a counter").needed as usize;
    let ends = words(&mut prepared, "clustered/list ends");
    let lists = words(&mut prepared, "clustered/cell lists");
    let cells = words(&mut prepared, "clustered/cells");
    let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), settings).unwrap();
    let (slices, logarithmic) = slices(division);
    let cell = |w: &[u32]| {
        let range_m = [w[1], w[2]].map(|bits| f64::from(f32::from_bits(bits)));
        (w[0], Cell { tile: w[0] / slices, range_m, steps: w[3] })
    };
    let found = Found {
        view: ClusterView::new(&settings.camera, [settings.width_px, settings.height_px], tile_px(division)),
        division,
        begins_m: slice_begins_m(renderer.distance_range_m().map(f64::from), slices, logarithmic),
        pixels: depth.filter(|(_, d)| *d > 0.0).map(|(i, d)| (at(i), d, near_m / d)).collect(),
        cells: cells.chunks_exact(4).take(needed("clusters")).map(cell).collect(),
        lists: ends
            .chunks_exact(2)
            .take(needed("clusters"))
            .map(|end| lists[end[0] as usize..end[1] as usize].to_vec())
            .collect(),
    };
    let entries: usize = found.lists.iter().map(Vec::len).sum();
    assert_eq!(entries, needed("cluster lights"), "lists overlap, or leave room between them");
    found
}

impl Found {
    /// Numbers of the cells that hold a pixel, two where rounding may take the next.
    fn cells_of(&self, pixel: [u32; 2], distance_m: f32) -> [u32; 2] {
        let slices = slices(self.division).0;
        let inner = &self.begins_m[1..slices as usize];
        [1.0 - 1e-4, 1.0 + 1e-4].map(|scale| {
            let slice = inner.iter().filter(|begin_m| **begin_m <= scale * f64::from(distance_m)).count();
            self.view.tile(pixel) * slices + slice as u32
        })
    }

    /// Decisions that differ from the twin's for the same lights, rounding left out.
    fn different(&self, lights: &[Light]) -> usize {
        let unlike = |((_, cell), list): (&(u32, Cell), &Vec<u32>)| {
            assert!(list.is_sorted_by(|a, b| a < b), "{list:?}");
            let decisions = self.view.cull(cell, lights);
            let differs = |(light, decision): (usize, &Decision)| {
                let unbounded = decision.slack_m == f64::INFINITY;
                let listed = list.binary_search(&(light as u32)).is_ok();
                // 32-bit arithmetic on coordinates of tens of metres is right to about 1e-5 m.
                if unbounded { listed } else { decision.slack_m.abs() >= 1e-3 && decision.passes != listed }
            };
            decisions.iter().enumerate().filter(|one| differs(*one)).count()
        };
        self.cells.iter().zip(&self.lists).map(unlike).sum()
    }

    /// Pairs of a pixel and a light with an end: on the list of the pixel's cell, reached, reached and not on the list.
    fn pairs(&self, lights: &[Light]) -> [usize; 3] {
        let world_from_clip = self.view.clip_from_world().inverse();
        let places: BTreeMap<u32, usize> =
            self.cells.iter().enumerate().map(|(place, (number, _))| (*number, place)).collect();
        let mut pairs = [0; 3];
        for (pixel, depth, distance_m) in &self.pixels {
            let [low, high] = self.cells_of(*pixel, *distance_m);
            let list = places.get(&low).map_or(&[][..], |place| &self.lists[*place][..]);
            let [x, y] =
                [0, 1].map(|i| (f64::from(pixel[i]) + 0.5) * 2.0 / f64::from(self.view.size_px[i]) - 1.0);
            let p = world_from_clip * DVec4::new(x, y, f64::from(*depth), 1.0);
            let point_ws = p.truncate() / p.w;
            pairs[0] += list.len();
            for (l, light) in lights.iter().enumerate() {
                // within rounding of the range nothing arrives
                let distance_m = point_ws.distance(light.position_ws.as_dvec3());
                let near = light.range_m.is_finite()
                    && light.kind != LightKind::Directional
                    && distance_m < f64::from(light.range_m) * 0.9999;
                let reached = near && light_reaches(light, point_ws);
                pairs[1] += usize::from(reached);
                let missed = low == high && list.binary_search(&(l as u32)).is_err();
                pairs[2] += usize::from(reached && missed);
            }
        }
        pairs
    }

    /// Checks that the cells are those that hold a surface, each once, and lie where the twin has them.
    fn check_cells(&self) {
        let (mut sure, mut possible) = (BTreeSet::new(), BTreeSet::new());
        for (pixel, _, distance_m) in &self.pixels {
            let [low, high] = self.cells_of(*pixel, *distance_m);
            possible.extend([low, high]);
            if low == high {
                sure.insert(low);
            }
        }
        let kept: BTreeSet<u32> = self.cells.iter().map(|(number, _)| *number).collect();
        assert_eq!(kept.len(), self.cells.len(), "a cell stands twice");
        assert!(sure.is_subset(&kept) && kept.is_subset(&possible), "{:?}: cells kept", self.division);
        for (number, cell) in &self.cells {
            let ends_m = match self.division {
                Division::Clusters(grid) => {
                    let slice = (number % grid.slices) as usize;
                    [self.begins_m[slice], self.begins_m[slice + 1]]
                }
                _ => self.tile_range_m(*number),
            };
            // Farther out by the slack of 2e-4, and rounding.
            for (found, expected, side) in
                [(cell.range_m[0], ends_m[0], 1.0), (cell.range_m[1], ends_m[1], -1.0)]
            {
                let outwards = side * (1.0 - found / expected);
                assert!((0.5e-4..3e-4).contains(&outwards), "{number}: {found} m, expected {expected}");
            }
            self.check_steps(*number, cell);
        }
    }

    /// Nearest and farthest view distance of a tile's pixels, m.
    fn tile_range_m(&self, tile: u32) -> [f64; 2] {
        let of_tile = self.pixels.iter().filter(|(pixel, _, _)| self.view.tile(*pixel) == tile);
        of_tile
            .fold([f64::MAX, 0.0], |[low, high], (_, _, d)| [low.min(f64::from(*d)), high.max(f64::from(*d))])
    }

    /// Checks that a tile's steps are those that hold a surface.
    fn check_steps(&self, tile: u32, cell: &Cell) {
        if !matches!(self.division, Division::Tiles25d(_)) {
            assert_eq!(cell.steps, u32::MAX);
            return;
        }
        let [near_m, far_m] = cell.range_m;
        let (mut sure, mut possible) = (0u32, 0u32);
        for (_, _, distance_m) in self.pixels.iter().filter(|(pixel, _, _)| self.view.tile(*pixel) == tile) {
            let bit = |offset: f64| {
                let step = (f64::from(*distance_m) - near_m) / (far_m - near_m) * 32.0 + offset;
                1 << (step.clamp(0.0, 31.0) as u32)
            };
            let [low, high] = [bit(-1e-2), bit(1e-2)];
            possible |= low | high;
            sure |= if low == high { low } else { 0 };
        }
        assert_eq!(
            sure & !cell.steps,
            0,
            "tile {tile}: steps {:032b}, there must be {sure:032b}",
            cell.steps
        );
        assert_eq!(cell.steps & !possible, 0, "tile {tile}: steps {:032b} of {possible:032b}", cell.steps);
    }
}

const fn grid(cluster_px: u32, slices: u32, logarithmic: bool) -> Division {
    let slicing = if logarithmic { Slicing::Logarithmic } else { Slicing::Uniform };
    Division::Clusters(ClusterParams { cluster_px, slices, slicing })
}

const DIVISIONS: [Division; 6] = [
    grid(32, 32, true),
    grid(17, 7, false),
    grid(8, 256, true),
    grid(64, 1, false),
    Division::Tiles(TileParams { tile_px: 16 }),
    Division::Tiles25d(TileParams { tile_px: 16 }),
];

/// Settings whose lights are in the order of the device.
fn ordered(settings: Settings) -> Settings {
    Settings { lights: device_order(&settings.lights), ..settings }
}

#[test]
fn lists_are_those_of_the_cpu_twin_and_miss_no_light() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    for (size, count) in [((160, 90), 100), ((113, 61), 1500)] {
        let settings = ordered(stage.settings(size, count));
        for division in DIVISIONS {
            let found = found(&stage, &settings, division, &[]);
            found.check_cells();
            assert_eq!(found.different(&settings.lights), 0, "{division:?}");
            let larger = wider(&settings.lights, 1.02);
            assert!(found.different(&larger) > 0, "ranges larger by two percent go unseen");
            let [listed, reached, missed] = found.pairs(&settings.lights);
            let excess = listed as f64 / reached as f64;
            println!(
                "{size:?}, {count} lights, {division:?}: {} cells, {listed} pairs listed, {reached} reached: {excess:.2}",
                found.cells.len()
            );
            assert_eq!(missed, 0, "{division:?}: pairs missed");
            assert!(reached > 10_000, "the view shows {reached} pairs");
        }
    }
}

/// Lights of all kinds all over a scene.
fn lights_of_all_kinds(stage: &Stage, seed: u64, count: u32) -> Vec<Light> {
    let points = afterlight_techniques::scene::lights::seeded_lights(&stage.scene.bounds_ws(), count, seed);
    let turned = |(i, light): (usize, Light)| {
        let direction_ws = Vec3::new(light.intensity.x, light.intensity.y, light.intensity.z)
            - Vec3::splat(light.intensity.element_sum() / 3.0);
        let direction_ws = direction_ws.try_normalize().unwrap_or(Vec3::NEG_Y);
        let outer_angle_rad = 0.05 + 0.03 * (i % 60) as f32;
        let kind = match i % 8 {
            0..3 => LightKind::Point,
            7 if i % 16 == 7 => LightKind::Directional,
            _ => LightKind::Spot { inner_angle_rad: 0.5 * outer_angle_rad, outer_angle_rad },
        };
        let range_m = if kind == LightKind::Point { light.range_m } else { 2.0 * light.range_m };
        Light { kind, direction_ws, range_m, ..light }
    };
    device_order(&points.into_iter().enumerate().map(turned).collect::<Vec<_>>())
}

/// 10⁵ cells of random views, lights of all kinds.
#[test]
fn no_light_is_missed_in_a_hundred_thousand_cells() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=16");
    let bounds = stage.scene.bounds_ws();
    let at = |i: u32, k: u32| {
        // points of a sequence with low discrepancy in the box
        let share = |base: f64| ((f64::from(i) + 0.5) * base + 0.37 * f64::from(k)).fract() as f32;
        bounds.min + bounds.size() * Vec3::new(share(0.754_877), share(0.569_840), share(0.618_034))
    };
    let (mut cells, mut reached) = (0, 0);
    let mut view = 0;
    while cells < 100_000 {
        let camera = Camera::look_at("view", at(view, 0), at(view, 1), 1.0 + 0.01 * (view % 50) as f32, 0.05);
        let mut settings = stage.from(camera, (320, 180), 0);
        settings.lights = lights_of_all_kinds(&stage, u64::from(view), 90);
        let division = match view % 8 {
            7 => DIVISIONS[4 + (view / 8 % 2) as usize],
            slices => grid(8, 64 + 24 * slices, slices % 2 == 0),
        };
        let found = found(&stage, &settings, division, &[]);
        let [_, of_view, missed] = found.pairs(&settings.lights);
        assert_eq!(missed, 0, "view {view}, {division:?}");
        assert_eq!(found.different(&settings.lights), 0, "view {view}, {division:?}");
        (cells, reached, view) = (cells + found.cells.len(), reached + of_view, view + 1);
        assert!(view < 400, "{cells} cells in {view} views");
    }
    println!("{cells} cells of {view} views, {reached} pairs reached");
    assert!(reached > 1_000_000);
}

#[test]
fn tests_that_are_too_tight_are_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let mut settings = stage.settings((160, 90), 0);
    settings.lights = lights_of_all_kinds(&stage, 1, 300);
    let bounds = "lights/cells/bounds.glsl";
    let (clusters, tiles25) = (DIVISIONS[0], DIVISIONS[5]);
    let mutants = [
        (clusters, bounds, "float range_m = sphere.w;", "float range_m = 0.95 * sphere.w;"),
        (clusters, bounds, "end == 0u ? cell.nearest_m : cell.farthest_m", "cell.nearest_m"),
        (clusters, bounds, "min(first + LIGHT_TILE_PX, frame.size_px)", "first + LIGHT_TILE_PX / 2u"),
        (clusters, bounds, "outside_m <= b.sphere.w", "outside_m <= -0.7 * b.sphere.w"),
        (clusters, bounds, "lessThanEqual(box.low, b.high_ws)", "lessThanEqual(box.low, b.low_ws)"),
        (clusters, "lights/bvh/tree.glsl", "+ (1u << shift) - 1u) >> shift", ") >> shift"),
        (tiles25, bounds, "(0xffffffffu >> (31u - last))", "(0x7fffffffu >> (31u - last))"),
    ];
    for (division, header, from, to) in mutants {
        let shader = mutant("lights/cells/assign.comp", header, from, to);
        let found = found(&stage, &settings, division, &[shader]);
        let [_, reached, missed] = found.pairs(&settings.lights);
        println!("{to}: {missed} of {reached} pairs missed");
        assert!(missed > 0, "{to} goes unseen");
        assert!(found.different(&settings.lights) > 0, "{to}: the twin agrees");
    }
}

fn image_with(stage: &Stage, id: &str, settings: &Settings, shaders: &[Shader]) -> Rgba8Image {
    image_of(&mut prepare(stage, find(id).unwrap(), settings, shaders))
}

/// A surface that asks the list of another cluster.
#[test]
fn the_next_cluster_is_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let settings = stage.settings((160, 90), 100);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let wrong = mutant(
        "surfaces/gbuffer/shade.comp",
        "lights/cells/cell_lists.glsl",
        "word.x & (bit - 1u)",
        "word.x & bit",
    );
    let db = psnr(&reference, &image_with(&stage, "clustered", &settings, &[wrong]));
    println!("the next cluster: {db:.2} dB");
    assert!(db < 45.0, "a mutant within the bound: {db:.2} dB");
}

const TECHNIQUES: [&str; 4] = ["clustered", "clustered-forward", "tiled-forward", "forward-plus"];

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

/// Lights without an end are on no list. An empty scene has no cluster.
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

/// Lights of each cell by its number, of a frame whose lists are made in subgroups of a size.
fn lists_in_subgroups(
    stage: &Stage,
    settings: &Settings,
    shaders: &[Shader],
    size: Option<u32>,
) -> BTreeMap<u32, Vec<u32>> {
    let pass = ("clustered/assign lights", size);
    let lists = (&Lists(DIVISIONS[0]) as &dyn Technique, &Params::default());
    let mut prepared = stage.prepare_in_subgroups(lists, settings, shaders, pass);
    prepared.run().unwrap_or_else(|e| panic!("{e}"));
    let counters = prepared.counters().unwrap_or_else(|e| panic!("{e}"));
    let cells = counters.iter().find(|c| c.name == "clusters").expect("a counter").needed as usize;
    let [numbers, ends, lists] =
        ["cells", "list ends", "cell lists"].map(|name| words(&mut prepared, &format!("clustered/{name}")));
    let list = |end: &[u32]| lists[end[0] as usize..end[1] as usize].to_vec();
    numbers
        .chunks_exact(4)
        .zip(ends.chunks_exact(2))
        .take(cells)
        .map(|(cell, end)| (cell[0], list(end)))
        .collect()
}

/// Lists are the same whatever the size of subgroups. The mutant is what a thread's number was taken for, on a driver that varies the size up to
/// 32 and runs this shader in smaller ones.
#[test]
fn lists_do_not_depend_on_the_size_of_subgroups() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=20000");
    let settings = ordered(stage.settings((160, 90), 300));
    let expected = lists_in_subgroups(&stage, &settings, &[], None);
    assert!(expected.values().map(Vec::len).sum::<usize>() > 1000, "the view has few lights");
    let sizes = subgroup_sizes(&gpu);
    for size in &sizes {
        let found = lists_in_subgroups(&stage, &settings, &[], Some(*size));
        assert!(found == expected, "subgroups of {size}: other lists");
    }
    let stride = compiled_variant(
        "lights/cells/assign.comp",
        "lights/cells/assign.comp.glsl",
        &[("return gl_LocalInvocationIndex;", "return gl_SubgroupID * 32u + gl_SubgroupInvocationID;")],
    );
    let smallest = sizes.first().copied();
    if smallest.unwrap_or(gpu.features().subgroup_size) < 32 {
        let found = lists_in_subgroups(&stage, &settings, &[stride], smallest);
        assert!(found != expected, "a wrong stride of subgroups goes unseen");
    }
}

/// 65,536 tiles, one more than most devices take groups along an axis.
#[test]
fn more_tiles_than_groups_of_a_row() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    let settings = stage.settings((2048, 2048), 3);
    let reference = stage.image(find("forward").unwrap(), &settings);
    let technique = find("clustered").unwrap();
    let sets = [("cluster-px", "8"), ("slices", "32")];
    let mut prepared = stage.prepare_with(technique, &settings, &params(technique, &sets));
    let db = psnr(&reference, &image_of(&mut prepared));
    assert!(db >= 50.0, "{db:.2} dB to forward");
}

/// A sum of lists that passes 2³² looks small: here every list takes 2³² entries, which leave the sum at 0. The frame is refused with the bytes
/// that it would take, on every device.
#[test]
fn a_sum_of_lists_that_begins_anew_is_told() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let settings = stage.settings((96, 54), 1000);
    let counted = |times: &str| {
        let shader = compiled_variant(
            "lights/cells/assign.comp",
            "lights/cells/assign.comp.glsl",
            &[("atomicAdd(entries_needed, count)", &format!("atomicAdd(entries_needed, {times})"))],
        );
        stage
            .try_prepare_shaders(find("clustered").unwrap(), &settings, &Params::default(), [shader])
            .map(|_| ())
    };
    counted("count").unwrap_or_else(|e| panic!("{e}"));
    match counted("0x80000000u) | atomicAdd(entries_needed, 0x80000000u") {
        Err(error @ TechniqueError::TooLarge { .. }) => {
            assert!(error.to_string().contains("bytes of the lists"), "{error}");
        }
        Err(error) => panic!("{error}"),
        Ok(()) => panic!("a sum that has begun anew is taken for one that fits"),
    }
}

/// Lists that are larger than the device binds are refused with their bytes, those that fit are not. All lights reach everything, so
/// that entries are clusters times lights, counted by hand.
#[test]
fn lists_that_find_no_room_are_told() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let technique = find("clustered").unwrap();
    // Many clusters of few pixels: lists are long, and few lights are visited.
    let params = params(technique, &[("cluster-px", "8"), ("slices", "256")]);
    let with_lights = |count: u32| {
        let settings = stage.settings((96, 54), count);
        Settings { lights: wider(&settings.lights, 1e4), ..settings }
    };
    let counted = |lights: u32, shaders: &[Shader]| {
        let settings = with_lights(lights);
        let mut prepared = stage.prepare_shaders(technique, &settings, &params, shaders.iter().cloned());
        prepared.run().unwrap_or_else(|e| panic!("{e}"));
        let counters = prepared.counters().unwrap_or_else(|e| panic!("{e}"));
        assert!(counters.iter().all(|counter| counter.dropped == 0), "{lights} lights: {counters:?}");
        let needed = |name: &str| counters.iter().find(|counter| counter.name == name).expect(name).needed;
        (needed("clusters"), needed("cluster lights"))
    };
    let (clusters, entries) = counted(7, &[]);
    assert!(clusters > 100 && entries == 7 * clusters, "{entries} entries of {clusters} clusters");
    let name = "lights/cells/assign.comp";
    let fewer = ("atomicAdd(entries_needed, count)", "atomicAdd(entries_needed, count - 1u)");
    let fewer = compiled_variant(name, &format!("{name}.glsl"), &[fewer]);
    assert_ne!(counted(7, &[fewer]), (clusters, entries), "a light that is not counted goes unseen");

    let limit = gpu.features().max_storage_buffer_range;
    let full = u32::try_from(limit / (4 * u64::from(clusters))).expect("lights");
    // With room for an eighth more, and 512 entries.
    let (_, entries) = counted(full / 4 * 3, &[]);
    assert_eq!(entries, full / 4 * 3 * clusters);
    match stage.try_prepare(technique, &with_lights(full + 1), &params) {
        Err(ref error @ TechniqueError::TooLarge { found, limit: told, .. }) => {
            println!("{error}");
            assert!(error.to_string().contains("bytes of the lists"), "{error}");
            let bytes = 4 * u64::from(full + 1) * u64::from(clusters);
            assert!(
                told == limit && (bytes..=bytes + bytes / 8 + 4 * 512).contains(&found),
                "{error}: {bytes} needed"
            );
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("{} lights of {clusters} clusters in {limit} bytes", full + 1),
    }
}
