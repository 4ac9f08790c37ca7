//! Skins and morph targets on the device: vertices against their twin in f64, and frames of a scene that plays against that scene posed and
//! drawn alone.

mod common;

use std::{path::PathBuf, sync::Arc};

use afterlight_image::Rgba8Image;
use afterlight_oracle::deform::{PosedVertex, posed_vertices};
use afterlight_renderer::{FlightOptions, FrameContext, Renderer, ScenePose};
use afterlight_techniques::{
    Params, Settings, find, registry,
    scene::{LoadOptions, Pose, Scene, VertexAttributes, load},
    shader::Shader,
};
use common::{Stage, compiled_variant, image_of, psnr};
use glam::DVec3;

const SIZE: (u32, u32) = (64, 48);
/// Techniques that visit lights in no defined order agree with themselves to this, dB.
const UNORDERED_DB: f64 = 100.0;
/// Parts of an animation's length at which poses are looked at: none of them on a keyframe of these files, but the first.
const PARTS: [f64; 5] = [0.0, 0.137, 0.371, 0.618, 0.913];

/// Samples with skins or morph targets.
fn deformed_samples() -> Vec<(PathBuf, Scene)> {
    let Some(root) = afterlight_testkit::shared_scenes() else { return Vec::new() };
    let mut folders = vec![root.join("samples/motion"), root.join("samples/khronos")];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(&folder).expect("a folder").map(|entry| entry.expect("an entry").path())
        {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb")
                && let Ok(scene) = load(&path, &LoadOptions::default())
                && !scene.deformations.is_empty()
            {
                found.push((path, scene));
            }
        }
    }
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

/// Gives the first target of each shape differences of tangents, which no sample has.
fn with_tangents_of_targets(mut scene: Scene) -> Scene {
    for shape in &mut scene.shapes {
        let mut targets = shape.targets.to_vec();
        if let Some(first) = targets.first_mut() {
            first.tangents_os = vec![[0.4, -0.3, 0.5]; shape.positions_os.len()];
        }
        shape.targets = targets.into();
    }
    scene
}

/// Poses of a scene's first animation; its own alone where nothing is animated.
fn poses(scene: &Scene) -> Vec<Pose> {
    let duration_s = scene.animations.first().map_or(0.0, |animation| animation.duration_s);
    PARTS.iter().map(|part| scene.pose_at(part * duration_s)).collect()
}

/// A scene in a pose whose drawn vertices are nonsense: what is right of them the device has written.
fn posed_without_vertices(scene: &Scene, pose: &Pose) -> Scene {
    let mut posed = scene.clone();
    posed.take_pose(pose);
    for d in &scene.deformations {
        let mesh = &scene.meshes[d.mesh as usize];
        for vertex in mesh.first_vertex as usize..(mesh.first_vertex + mesh.vertex_count) as usize {
            posed.positions_os[vertex] = [1e6; 3];
            let own = &mut posed.attributes[vertex];
            (own.normal_os_oct, own.tangent_os_oct) = (0, 0);
        }
    }
    posed
}

/// Positions and frames of all vertices after a frame.
fn written(stage: &Stage, shaders: &[Shader]) -> (Vec<[f32; 3]>, Vec<VertexAttributes>) {
    let settings = stage.settings(SIZE, 0);
    let technique = find("forward").expect("known");
    let mut prepared =
        stage.prepare_shaders(technique, &settings, &Params::default(), shaders.iter().cloned());
    prepared.run().unwrap_or_else(|e| panic!("{e}"));
    let mut read = |name: &str| prepared.executor().read_buffer(name).unwrap_or_else(|e| panic!("{e}"));
    let (positions, attributes) = (read("scene positions"), read("scene attributes"));
    let count = stage.scene.positions_os.len();
    (bytemuck::cast_slice(&positions)[..count].to_vec(), bytemuck::cast_slice(&attributes)[..count].to_vec())
}

/// Greatest distance of positions over the size of the model, and greatest sine between normals and between tangents, the bitangent's sign
/// among them.
fn worst(
    scene: &Scene,
    pose: &Pose,
    (positions, attributes): &(Vec<[f32; 3]>, Vec<VertexAttributes>),
) -> [f64; 3] {
    let mut worst = [0.0f64; 3];
    for (number, instance) in scene.instances.iter().enumerate() {
        if scene.deformation_of(number).is_none() {
            continue;
        }
        let expected = posed_vertices(scene, pose, number);
        let reach = expected.iter().fold(0.0f64, |reach, v| reach.max(v.position.abs().max_element()));
        let first = scene.meshes[instance.mesh as usize].first_vertex as usize;
        for (k, v) in expected.iter().enumerate() {
            let position = DVec3::from_array(positions[first + k].map(f64::from));
            let [normal_off, tangent_off] = frame_off(v, &attributes[first + k]);
            let off = [position.distance(v.position) / reach.max(1e-9), normal_off, tangent_off];
            worst = [0, 1, 2].map(|i| worst[i].max(if off[i].is_nan() { f64::INFINITY } else { off[i] }));
        }
    }
    worst
}

/// How far normal and tangent are off: the length of the difference of unit vectors, 2 for the other sign of the bitangent.
fn frame_off(expected: &PosedVertex, found: &VertexAttributes) -> [f64; 2] {
    let (tangent, sign) = found.tangent_os();
    let normal_off = match expected.normal == DVec3::ZERO {
        true => 0.0,
        false => found.normal_os().as_dvec3().distance(expected.normal),
    };
    // Nearly along the normal it is none, or one that packing has turned.
    let is_beside = expected.normal.cross(expected.tangent).length() > 0.01;
    let tangent_off = match is_beside {
        false => 0.0,
        true if f64::from(sign) != expected.handedness => 2.0,
        true => tangent.as_dvec3().distance(expected.tangent),
    };
    [normal_off, tangent_off]
}

/// Positions to 1e-5 of the model's size, normals and tangents to what packing turns them by; a mutant for each step.
#[test]
fn vertices_are_those_of_the_twin() {
    let gpu = afterlight_testkit::gpu();
    let shader = "shared/deform/deform.comp";
    let mutant = |from: &str, to: &str| compiled_variant(shader, &format!("{shader}.glsl"), &[(from, to)]);
    let mutants = [
        ("weights", mutant("v.position += weight * difference", "v.position += difference")),
        ("second pair of joints", mutant("of.joints[i / 2u]", "of.joints[0]")),
        (
            "normals by the matrix",
            mutant(
                "v.normal = sign * vec3(dot(cross(row1, row2), v.normal), dot(cross(row2, row0), v.normal), dot(cross(row0, row1), v.normal));",
                "v.normal = vec3(dot(row0, v.normal), dot(row1, v.normal), dot(row2, v.normal));",
            ),
        ),
        ("one triangle further", mutant("thread - thread % 3u", "thread - (thread + 1u) % 3u")),
        ("first joint", mutant("joints[d.first_joint + ", "joints[")),
        (
            "tangents of targets",
            mutant("v.tangent += weight * difference(targets[target + 2u], vertex);", ""),
        ),
    ];
    let mut caught = [false; 6];
    let samples = deformed_samples();
    for (file, scene) in samples.iter().map(|(file, scene)| (file, with_tangents_of_targets(scene.clone()))) {
        let scene = &scene;
        let mut of_file = [0.0f64; 3];
        for (number, pose) in poses(scene).iter().enumerate() {
            let stage = Stage::of(&gpu, posed_without_vertices(scene, pose));
            let off = worst(&stage.scene, pose, &written(&stage, &[]));
            of_file = [0, 1, 2].map(|i| of_file[i].max(off[i]));
            assert!(off[0] <= 1e-5, "{}: positions are off by {:.2e} of the size", file.display(), off[0]);
            assert!(off[1] <= 2e-3 && off[2] <= 2e-3, "{}: frames are off by {off:?}", file.display());
            // One pose a file tells enough.
            if number == 2 {
                for (caught, (_, shader)) in caught.iter_mut().zip(&mutants) {
                    let off = worst(&stage.scene, pose, &written(&stage, std::slice::from_ref(shader)));
                    *caught |= off[0] > 1e-3 || off[1] > 0.02 || off[2] > 0.02;
                }
            }
        }
        println!("{}: off by {of_file:?}", file.file_name().expect("a name").to_string_lossy());
    }
    if !samples.is_empty() {
        for (caught, (what, _)) in caught.iter().zip(&mutants) {
            assert!(caught, "{what}: a mutant that no sample catches");
        }
    }
}

/// Pictures of a flight in which the scene plays.
fn flown(stage: &Stage, id: &str, settings: &Settings, poses: &[Arc<ScenePose>]) -> Vec<Rgba8Image> {
    let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), settings);
    let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    let options = FlightOptions { pictures: true, scene_moves: true, ..FlightOptions::default() };
    let technique = find(id).expect("known");
    let camera = &settings.camera;
    let mut flight =
        renderer.fly(technique, &Params::default(), camera, options).unwrap_or_else(|e| panic!("{id}: {e}"));
    let mut pictures = Vec::new();
    let mut done = |frame: &afterlight_renderer::Done<'_>| {
        let pixels = frame.rgba8.expect("asked for").to_vec();
        pictures.push(Rgba8Image { width: settings.width_px, height: settings.height_px, pixels });
        Ok(())
    };
    for (index, pose) in (0..).zip(poses) {
        let context = FrameContext {
            index,
            time_s: 0.25,
            cut: false,
            camera: camera.clone(),
            pose: Some(pose.clone()),
        };
        flight.frame(context, &mut done).unwrap_or_else(|e| panic!("{id}: {e}"));
    }
    flight.land(&mut done).unwrap_or_else(|e| panic!("{id}: {e}"));
    pictures
}

/// Each frame of every sample that moves is the picture of the scene in that pose, for techniques that read vertices in different ways: by the
/// raster part, from their buffers, from records of triangles.
#[test]
fn frames_that_play_are_pictures_of_their_poses() {
    let gpu = afterlight_testkit::gpu();
    let samples = deformed_samples();
    let mut moved = 0;
    for (k, (file, scene)) in samples.iter().enumerate() {
        let stage = Stage::of(&gpu, scene.clone());
        let settings = stage.settings(SIZE, 5);
        let poses = poses(scene);
        let of_scene: Vec<_> = poses.iter().map(|pose| Arc::new(ScenePose::of(scene, pose, false))).collect();
        let ids = match k {
            // One sample in every technique.
            0 => registry().iter().map(|technique| technique.info().id).collect(),
            _ => vec!["forward", "visibility", "dais", "gbuffer-list"],
        };
        for id in ids {
            let technique = find(id).expect("known");
            let samples = if technique.info().samples.contains(&4) { 4 } else { 1 };
            let settings = Settings { samples, ..settings.clone() };
            let pictures = flown(&stage, id, &settings, &of_scene);
            for (number, (picture, pose)) in pictures.iter().zip(&poses).enumerate() {
                let mut posed = scene.clone();
                posed.take_pose(pose);
                let posed = Stage::of(&gpu, posed);
                let alone = image_of(&mut posed.prepare(technique, &settings));
                let db = psnr(&alone, picture);
                let name = file.display();
                assert!(db >= UNORDERED_DB, "{name}, {id}: frame {number} is {db:.1} dB off its pose");
            }
            // Without shapes of its own a pose has those that were uploaded, whatever was shown before.
            let at_rest = ScenePose { lights: None, ..ScenePose::at_rest(scene) };
            let last = flown(&stage, id, &settings, &[of_scene[3].clone(), Arc::new(at_rest)]).pop();
            let alone = image_of(&mut stage.prepare(technique, &settings));
            let db = psnr(&alone, &last.expect("two frames"));
            assert!(db >= UNORDERED_DB, "{}, {id}: at rest again {db:.1} dB off", file.display());
            moved += usize::from(pictures.windows(2).any(|pair| pair[0].pixels != pair[1].pixels));
        }
    }
    assert!(samples.is_empty() || moved > 2 * samples.len(), "{moved} flights in which anything moves");
}

/// A pose of another scene is refused.
#[test]
fn poses_with_other_joints_are_refused() {
    let gpu = afterlight_testkit::gpu();
    let Some((_, scene)) = deformed_samples().into_iter().next() else { return };
    let stage = Stage::of(&gpu, scene);
    let settings = stage.settings(SIZE, 1);
    let renderer = Renderer::with_scene(&gpu, stage.uploaded.clone(), &settings);
    let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    let mut pose = ScenePose::of(&stage.scene, &stage.scene.pose_at(0.0), false);
    let shapes = pose.shapes.as_mut().expect("is deformed");
    shapes.pose.weights.push(0.5);
    let options = FlightOptions { scene_moves: true, ..FlightOptions::default() };
    let technique = find("forward").expect("known");
    let mut flight = renderer
        .fly(technique, &Params::default(), &settings.camera, options)
        .unwrap_or_else(|e| panic!("{e}"));
    let context = FrameContext {
        index: 0,
        time_s: 0.25,
        cut: false,
        camera: settings.camera.clone(),
        pose: Some(Arc::new(pose)),
    };
    let error = flight.frame(context, &mut |_| Ok(())).expect_err("is refused").to_string();
    assert!(error.contains("weights of morph targets"), "{error}");
}
