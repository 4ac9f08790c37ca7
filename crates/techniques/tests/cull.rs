//! The choice of draws on the device against its CPU twin: which, in what order, command by command.

mod common;

use afterlight_frame::{
    CameraView, ChangesWith, CullOn,
    scene::{
        BUCKETS,
        draw_list::{COMMAND_BYTES, DrawQuery, count, write_commands, write_counts},
    },
};
use afterlight_renderer::Prepared;
use afterlight_stages::shared::cull::SceneOfDraws;
use afterlight_techniques::{
    Cull, DrawOrder, DrawParams, Frame, Info, Params, SHADERS, SceneGpu, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    find,
    graph::{BufferRole, Graph, ImageHandle, PassRole, gpu::vk},
    scene::{Aabb, Camera, Projection, Scene, lights::seeded_lights, load_source, rng::SplitMix64},
    shader::Shader,
};
use common::{Stage, compiled_variant};
use glam::{Affine3A, Quat, Vec3};

/// Draws of a group: those of `batches.glsl`.
const BATCH_DRAWS: u32 = 1024;
const SIZE_PX: [u32; 2] = [97, 55];

/// Chooses draws by one query after the other, and nothing else.
struct Choices<'a>(&'a [DrawQuery]);

impl Technique for Choices<'_> {
    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }
    fn info(&self) -> &Info {
        find("forward").unwrap().info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        for (number, query) in self.0.iter().copied().enumerate() {
            let named = (&*number.to_string(), ChangesWith::Camera);
            let scene = SceneOfDraws { cull_on: CullOn::Gpu, ..SceneOfDraws::of(frame) };
            let draws = scene.by_query(graph, named, move |_| query)?;
            graph.keep(&draws.commands);
            graph.keep(&draws.counts);
        }
        let image =
            graph.image("image", BufferRole::Targets, frame.image_info(vk::Format::R16G16B16A16_SFLOAT));
        Ok(graph.clear_image("clear", PassRole::Upkeep, image, [0.0; 4]))
    }
}

/// Counts of the buckets, and the commands of each.
type Chosen = (Vec<u32>, Vec<Vec<u8>>);

fn of_buckets(scene: &SceneGpu, counts: &[u8], commands: &[u8]) -> Chosen {
    let counts: Vec<u32> =
        counts.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let range = |(first, count): (&u32, &u32)| {
        commands[(COMMAND_BYTES * u64::from(*first)) as usize..]
            [..(COMMAND_BYTES * u64::from(*count)) as usize]
            .to_vec()
    };
    let of_bucket = scene.bucket_first.iter().zip(&counts).map(range).collect();
    (counts, of_bucket)
}

/// What the device chooses by each query, with shaders in place of the stage's own.
fn found(on: &(Stage, Settings), queries: &[DrawQuery], shaders: &[Shader]) -> Vec<Chosen> {
    let (stage, settings) = on;
    let mut prepared: Prepared =
        stage.prepare_shaders(&Choices(queries), settings, &Params::default(), shaders.iter().cloned());
    prepared.run().unwrap_or_else(|e| panic!("{e}"));
    let mut read = |name: &str| prepared.executor().read_buffer(name).unwrap_or_else(|e| panic!("{e}"));
    let of_query = |number: usize| {
        let (counts, commands) = (read(&format!("{number} counts")), read(&format!("{number} commands")));
        of_buckets(&stage.uploaded, &counts, &commands)
    };
    (0..queries.len()).map(of_query).collect()
}

/// What the twin chooses.
fn expected(scene: &SceneGpu, query: &DrawQuery) -> Chosen {
    let draws = query.choose(&scene.bucket_first, &scene.rest.infos);
    let mut commands = vec![0; COMMAND_BYTES as usize * scene.draw_count()];
    let mut counts = vec![0; 4 * BUCKETS];
    write_commands(scene, &draws, &mut commands);
    write_counts(&draws, &mut counts);
    of_buckets(scene, &counts, &commands)
}

/// The colonnade many times over at random places, turned, mirrored and stretched; a few of them at no place at all, and infinitely far.
fn crowd(instances: usize) -> Scene {
    let mut scene = load_source("builtin:colonnade?triangles=16384&texture=16", &Default::default())
        .unwrap_or_else(|e| panic!("{e}"));
    let mut random = SplitMix64::new(3);
    let mut next = || random.next_f32();
    let own = scene.instances.clone();
    scene.instances = (0..instances)
        .map(|i| {
            let mut instance = own[i % own.len()].clone();
            let place = Vec3::new(next() - 0.5, next() - 0.5, next() - 0.5) * 80.0;
            let axis = Vec3::new(next() + 0.1, next(), next()).normalize();
            let mirror = if next() < 0.3 { -1.0 } else { 1.0 };
            let scale = Vec3::new(mirror, 1.0, 1.0) * (0.05 + 0.5 * next());
            instance.world_from_object = Affine3A::from_scale_rotation_translation(
                scale,
                Quat::from_axis_angle(axis, 6.0 * next()),
                place,
            ) * instance.world_from_object;
            match i % 97 {
                11 => instance.world_from_object.translation.x = f32::NAN,
                23 => instance.world_from_object.translation.y = f32::INFINITY,
                31 => instance.world_from_object.matrix3.z_axis.x = f32::NAN,
                _ => {}
            }
            instance
        })
        .collect();
    scene
}

fn stage(device: &afterlight_testkit::GpuTest, instances: usize) -> (Stage, Settings) {
    let stage = Stage::of(device, crowd(instances));
    let camera = Camera::look_at("eye", Vec3::ZERO, Vec3::NEG_Z, 1.0, 0.1);
    let bounds = Aabb { min: Vec3::splat(-40.0), max: Vec3::splat(40.0) };
    let lights = seeded_lights(&bounds, 1, 1);
    let settings = Settings { lights, camera, ..stage.settings((8, 8), 0) };
    (stage, settings)
}

/// Random cameras, perspective and orthographic, with every kind of option.
fn queries(count: usize, seed: u64) -> Vec<DrawQuery> {
    let mut random = SplitMix64::new(seed);
    let mut next = || random.next_f32();
    let query = |i: usize| {
        let mut point = |size: f32| Vec3::new(next() - 0.5, next() - 0.5, next() - 0.5) * size;
        let (eye, target) = (point(100.0), point(60.0));
        let mut camera = Camera::look_at("random", eye, target, 0.3 + 1.5 * next(), 0.05);
        if i % 5 == 4 {
            camera.projection =
                Projection::Orthographic { half_height_m: 2.0 + 20.0 * next(), near_m: 0.0, far_m: 200.0 };
        }
        let options = DrawParams {
            cull: if i % 7 == 6 { Cull::None } else { Cull::Frustum },
            order: [DrawOrder::Center, DrawOrder::Near, DrawOrder::Scene][[0, 0, 1, 0, 2][i % 5]],
            cull_px: if i % 4 == 3 { 3.0 } else { 0.0 },
            ..DrawParams::default()
        };
        let rows = (i % 3 == 2).then(|| (i as u32 % 4 * 11)..(i as u32 % 4 * 11 + 11));
        let bounds_ws = Aabb { min: Vec3::splat(-45.0), max: Vec3::splat(45.0) };
        let displacement_m = if i % 6 == 1 { 0.7 } else { 0.0 };
        let camera = CameraView::new(&camera, SIZE_PX);
        DrawQuery::new(&options, &camera.query(rows, bounds_ws, displacement_m))
    };
    (0..count).map(query).collect()
}

#[test]
fn draws_are_those_of_the_cpu_twin() {
    let gpu = afterlight_testkit::gpu();
    for instances in [1, 150, 5000] {
        let on = stage(&gpu, instances);
        let scene = &on.0.uploaded;
        let longest = scene.bucket_first.windows(2).map(|ends| ends[1] - ends[0]).max();
        assert!(
            instances < 5000 || longest > Some(2 * BATCH_DRAWS),
            "no bucket has several batches: {longest:?}"
        );
        let mut all = queries(24, 5);
        all.push(DrawQuery::NOTHING);
        let chosen = found(&on, &all, &[]);
        let (mut culled, mut drawn) = (0, 0);
        for (number, (query, found)) in all.iter().zip(&chosen).enumerate() {
            // What is chosen for the whole image, and then for the rows.
            let mut whole = *query;
            whole.0.planes[6..].fill([0.0, 0.0, 0.0, 1.0]);
            let infos = &scene.rest.infos;
            let of_rows = query.keep(&whole.choose(&scene.bucket_first, infos), infos);
            assert_eq!(of_rows, query.choose(&scene.bucket_first, infos), "query {number}: rows");
            let expected = expected(scene, query);
            assert_eq!(found.0, expected.0, "query {number} of {instances} instances: counts");
            assert!(found.1 == expected.1, "query {number} of {instances} instances: {query:?}");
            let draws: u32 = found.0.iter().sum();
            drawn += draws;
            culled += scene.draw_count() as u32 - draws;
        }
        assert!(instances < 5000 || drawn > 5000 && culled > 5000, "{drawn} drawn, {culled} left out");
        let unwanted: u32 = chosen.last().map_or(0, |(counts, _)| counts.iter().sum());
        let lost = scene.rest.infos.iter().filter(|info| !info.bounds_ws.center().is_finite()).count();
        assert!(
            unwanted as usize <= lost,
            "{unwanted} drawn where nothing is wanted, {lost} of unknown place"
        );
        assert!(found(&on, &all, &[]) == chosen, "another run gives other bits");
    }
}

/// Batches grow where there are more draws than 256 batches of the usual size hold.
#[test]
fn many_draws_are_those_of_the_cpu_twin() {
    let gpu = afterlight_testkit::gpu();
    let on = stage(&gpu, 290_000);
    let scene = &on.0.uploaded;
    assert!(scene.draw_count() > 256 * BATCH_DRAWS as usize, "{} draws", scene.draw_count());
    let all = queries(3, 9);
    for (query, found) in all.iter().zip(found(&on, &all, &[])) {
        assert!(found == expected(scene, query), "{query:?}");
    }
}

/// Draws whose bounds are no numbers are kept by every view.
#[test]
fn bounds_that_are_no_numbers_are_kept() {
    let gpu = afterlight_testkit::gpu();
    let on = stage(&gpu, 5000);
    let infos = &on.0.uploaded.rest.infos;
    let lost = (0..).zip(infos).filter(|(_, info)| info.bounds_ws.center().is_nan());
    let lost: Vec<u32> = lost.map(|(draw, _)| draw).collect();
    assert!(lost.len() > 10, "{}", lost.len());
    let query = queries(1, 8)[0];
    let (_, commands) = found(&on, &[query], &[]).remove(0);
    let number = |command: &[u8]| u32::from_le_bytes([command[16], command[17], command[18], command[19]]);
    let chosen: Vec<u32> =
        commands.iter().flat_map(|bucket| bucket.chunks_exact(COMMAND_BYTES as usize).map(number)).collect();
    assert!(chosen.len() < infos.len() / 4 * 3, "{} of {}", chosen.len(), infos.len());
    let missing: Vec<&u32> = lost.iter().filter(|draw| !chosen.contains(draw)).collect();
    let kept = lost.iter().filter(|draw| query.bin(&infos[**draw as usize].bounds_ws).is_some()).count();
    assert_eq!(missing.len(), lost.len() - kept);
    assert!(count(&query.choose(&on.0.uploaded.bucket_first, infos)) as usize == chosen.len());
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn wrong_choices_are_caught() {
    let gpu = afterlight_testkit::gpu();
    let on = stage(&gpu, 5000);
    let all = queries(12, 5);
    let (choose, order) = ("shared/cull/choose.comp", "shared/cull/order.comp");
    let (choice, order_source) = ("shared/cull/choice.glsl", "shared/cull/order.comp.glsl");
    for (shader, file, from, to) in [
        (
            choose,
            choice,
            "dot_in_order(plane.xyz, farthest) + plane.w",
            "dot_in_order(plane.xyz, farthest) - plane.w",
        ),
        (choose, choice, "greaterThanEqual(plane.xyz, vec3(0.0))", "lessThan(plane.xyz, vec3(0.0))"),
        (choose, choice, "!(signed_distance < 0.0)", "signed_distance >= 0.0"),
        (choose, choice, "i < 8u; ++i) {\n        reaches_all", "i < 5u; ++i) {\n        reaches_all"),
        (choose, choice, "high = b.high + displacement_m", "high = b.high"),
        (choose, choice, "const uint STEP_SHIFT = 20u", "const uint STEP_SHIFT = 21u"),
        (order, order_source, "- 1u;\n    return rank", "- 1u; lower = ~(lower * 2u + 1u);\n    return rank"),
        (order, order_source, "other < batch.number ? count : 0u", "other <= batch.number ? 0u : count"),
    ] {
        println!("{shader}: {to}");
        let wrong = compiled_variant(shader, file, &[(from, to)]);
        let chosen = found(&on, &all, &[wrong]);
        let is_caught =
            all.iter().zip(&chosen).any(|(query, found)| *found != expected(&on.0.uploaded, query));
        assert!(is_caught, "{shader}: {to:?} goes unseen");
    }
}
