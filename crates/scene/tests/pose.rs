//! Poses: known answers, files that are broken, bounds.

mod load_common;

use afterlight_scene::{Aabb, Moment, Pose, Scene, SceneError};
use glam::{Affine3A, DAffine3, DVec3, Quat, Vec3};
use load_common::Document;
use proptest::prelude::*;
use serde_json::json;

/// A bar along Y from 0 to 2, of quads at these heights, held by two joints: one at the origin, one at (0, 1, 0), which turns by 90 degrees about
/// Z within a second. Each row has the weights of both joints.
fn bar(heights: &[f32], weights: &[[f32; 4]]) -> Document {
    let mut d = Document::new();
    let points: Vec<[f32; 3]> = heights.iter().flat_map(|&y| [[-0.1, y, 0.0], [0.1, y, 0.0]]).collect();
    let rows = weights.iter().flat_map(|&w| [w, w]).collect::<Vec<_>>();
    let corners: Vec<u32> = (0..heights.len() as u32 - 1)
        .flat_map(|row| [0, 1, 2, 2, 1, 3].map(|corner| 2 * row + corner))
        .collect();
    let positions = d.floats(&points);
    let normals = d.floats(&vec![[1.0f32, 0.0, 0.0]; points.len()]);
    let joints = d.view(&[0u8, 1, 0, 0].repeat(points.len()), None);
    let joints = d.accessor(
        json!({"bufferView": joints, "componentType": 5121, "count": points.len(), "type": "VEC4"}),
    );
    let weights = d.floats(&rows);
    let indices = d.indices(&corners, 2);
    d.json["meshes"] = json!([{"primitives": [{"indices": indices, "attributes":
        {"POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights}}]}]);
    let bind = [0.0f32, 1.0].map(|y| Affine3A::from_translation(Vec3::NEG_Y * y));
    let bind: Vec<f32> = bind.iter().flat_map(|m| glam::Mat4::from(*m).to_cols_array()).collect();
    let view = d.view(bytemuck::cast_slice(&bind), None);
    let bind = d.accessor(json!({"bufferView": view, "componentType": 5126, "count": 2, "type": "MAT4"}));
    d.json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [50.0, 0.0, 0.0]},
        {"children": [2]},
        {"translation": [0.0, 1.0, 0.0]}]);
    d.json["scenes"] = json!([{"nodes": [0, 1]}]);
    d.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": bind}]);
    let times = d.floats(&[[0.0f32], [1.0], [2.0]]);
    let quarter = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2).to_array();
    let turns = d.floats(&[[0.0f32, 0.0, 0.0, 1.0], quarter, quarter]);
    d.json["animations"] = json!([{"name": "bend", "samplers": [{"input": times, "output": turns}],
        "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}]}]);
    d
}

const HELD: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]];

/// World positions and normals of an instance as the scene holds them.
fn vertices(scene: &Scene, instance: usize) -> Vec<(Vec3, Vec3)> {
    let instance = &scene.instances[instance];
    let mesh = &scene.meshes[instance.mesh as usize];
    let world = instance.world_from_object;
    (mesh.first_vertex as usize..(mesh.first_vertex + mesh.vertex_count) as usize)
        .map(|k| {
            let normal = world.transform_vector3(scene.attributes[k].normal_os());
            (world.transform_point3(scene.positions_os[k].into()), normal)
        })
        .collect()
}

fn posed(scene: &Scene, time_s: f64) -> Scene {
    let mut scene = scene.clone();
    scene.take_pose(&scene.pose_at(time_s));
    scene
}

#[test]
fn a_bar_of_two_joints_bends() {
    let scene = bar(&[0.0, 1.0, 2.0], &HELD).load().unwrap();
    assert_eq!((scene.skins.len(), scene.shapes.len(), scene.deformations.len()), (1, 1, 1));
    let rest = vertices(&scene, 0);
    assert!(
        (rest[5].0 - Vec3::new(0.1, 2.0, 0.0)).length() < 1e-6,
        "the node does not move it: {:?}",
        rest[5]
    );
    let bent = vertices(&posed(&scene, 1.0), 0);
    // The lower joint holds its row; the upper end has turned about (0, 1, 0) by a quarter to the left.
    for (k, expected) in [
        (0, Vec3::new(-0.1, 0.0, 0.0)),
        (1, Vec3::new(0.1, 0.0, 0.0)),
        (4, Vec3::new(-1.0, 0.9, 0.0)),
        (5, Vec3::new(-1.0, 1.1, 0.0)),
        // Between them the mean of both: of (0.1, 1, 0) and (0, 1.1, 0).
        (3, Vec3::new(0.05, 1.05, 0.0)),
    ] {
        assert!((bent[k].0 - expected).length() < 1e-6, "{k}: {}, expected {expected}", bent[k].0);
    }
    assert!((bent[4].1 - Vec3::Y).length() < 1e-4, "the normal has turned: {}", bent[4].1);
    // Half way, and the same a round later.
    for time_s in [0.5, 2.5] {
        let (sin, cos) = std::f32::consts::FRAC_PI_4.sin_cos();
        let half = vertices(&posed(&scene, time_s), 0)[5].0;
        let expected = Vec3::new(0.1 * cos - sin, 1.0 + 0.1 * sin + cos, 0.0);
        assert!((half - expected).length() < 1e-6, "{half}, expected {expected}");
    }
    // A mutant: without the inverse bind matrices the end would be elsewhere.
    let mut forgetful = scene.clone();
    forgetful.skins[0].joint_from_bind = vec![Affine3A::IDENTITY; 2];
    assert!((vertices(&posed(&forgetful, 1.0), 0)[5].0 - bent[5].0).length() > 0.5);
    // A mutant: with the joints in another order.
    let mut swapped = scene.clone();
    swapped.skins[0].joints.swap(0, 1);
    assert!((vertices(&posed(&swapped, 1.0), 0)[5].0 - bent[5].0).length() > 0.5);
}

#[test]
fn loading_at_a_time_is_posing() {
    let d = bar(&[0.0, 1.0, 2.0], &HELD);
    let (loaded, scene) = (d.load_at(Some(0.7)).unwrap(), d.load().unwrap());
    assert_eq!(vertices(&loaded, 0), vertices(&posed(&scene, 0.7), 0));
    let mut back = posed(&scene, 0.7);
    let mut pose = Pose::default();
    back.pose_into(Moment::Rest, &mut pose);
    back.take_pose(&pose);
    assert_eq!(vertices(&back, 0), vertices(&scene, 0));
    assert_eq!(scene.moving_instances(0), [true]);
    assert_eq!(scene.moving_instances(1), [false], "there is no second animation");
}

#[test]
fn a_pose_is_refilled_in_its_place() {
    let scene = bar(&[0.0, 1.0, 2.0], &HELD).load().unwrap();
    let mut pose = scene.pose_at(0.2);
    let places = |pose: &Pose| {
        let names: Vec<*const u8> = pose.cameras.iter().map(|c| c.name.as_ptr()).collect();
        (pose.world_from_object.as_ptr(), pose.object_from_bind.as_ptr(), pose.cameras.as_ptr(), names)
    };
    let before = places(&pose);
    scene.pose_into(Moment::at(0.9), &mut pose);
    assert_eq!(places(&pose), before);
    assert_eq!(pose, scene.pose_at(0.9));
    assert_ne!(pose, scene.pose_at(0.2));
    // A pose of another scene is filled anew.
    let other = afterlight_scene::builtin::build("builtin:moving").unwrap();
    other.pose_into(Moment::at(0.9), &mut pose);
    assert_eq!(pose, other.pose_at(0.9));
}

/// A quad with two targets: one lifts it along Z, one moves its last vertex and turns its normal.
fn quad(interpolation: &str, values: &[f32]) -> Document {
    let mut d = Document::new();
    let positions = d.floats(&[[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    let normals = d.floats(&[[0.0f32, 0.0, 1.0]; 4]);
    let lift = d.floats(&[[0.0f32, 0.0, 1.0]; 4]);
    let pull = d.floats(&[[0.0f32; 3], [0.0; 3], [0.0; 3], [2.0, 0.0, -1.0]]);
    let turn = d.floats(&[[0.0f32; 3], [0.0; 3], [0.0; 3], [1.0, 0.0, -1.0]]);
    let indices = d.indices(&[0, 1, 2, 2, 1, 3], 2);
    d.json["meshes"] = json!([{"weights": [0.25, 0.0], "primitives": [{"indices": indices,
        "attributes": {"POSITION": positions, "NORMAL": normals},
        "targets": [{"POSITION": lift}, {"POSITION": pull, "NORMAL": turn}]}]}]);
    let keys = values.len() / if interpolation == "CUBICSPLINE" { 6 } else { 2 };
    let times: Vec<[f32; 1]> = (0..keys).map(|k| [2.0 * k as f32]).collect();
    let times = d.floats(&times);
    let values: Vec<[f32; 1]> = values.iter().map(|&v| [v]).collect();
    let values = d.floats(&values);
    d.json["animations"] = json!([{"samplers": [{"input": times, "output": values, "interpolation": interpolation}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}]);
    d
}

#[test]
fn a_quad_is_morphed() {
    let scene = quad("LINEAR", &[0.0, 0.0, 1.0, 0.5]).load().unwrap();
    assert!(vertices(&scene, 0).iter().all(|(p, _)| p.z == 0.25), "the mesh's own weights hold at rest");
    assert_eq!(scene.pose_at(1.0).weights, [0.5, 0.25]);
    let found = vertices(&posed(&scene, 1.0), 0);
    assert!((found[0].0 - Vec3::new(0.0, 0.0, 0.5)).length() < 1e-6);
    assert!((found[3].0 - Vec3::new(1.5, 1.0, 0.25)).length() < 1e-6, "{}", found[3].0);
    assert!((found[3].1 - Vec3::new(0.25, 0.0, 0.75).normalize()).length() < 1e-4, "{}", found[3].1);
    // A node's weights come before its mesh's, and two nodes have shapes of their own.
    let mut d = quad("LINEAR", &[0.0, 0.0, 1.0, 0.5]);
    d.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "weights": [0.75, 0.0]}, {"mesh": 0}, {"mesh": 0}]);
    d.json["scenes"] = json!([{"nodes": [0, 1, 2, 3]}]);
    let scene = d.load().unwrap();
    let heights = |scene: &Scene| [0, 1, 2, 3].map(|k| vertices(scene, k)[0].0.z);
    assert_eq!(heights(&scene), [0.25, 0.75, 0.25, 0.25]);
    assert_eq!(heights(&posed(&scene, 1.0)), [0.5, 0.75, 0.25, 0.25]);
    assert_eq!(scene.meshes.len(), 3, "the last two share their vertices");
    assert!(
        std::sync::Arc::ptr_eq(&scene.shapes[0].targets, &scene.shapes[2].targets),
        "and all the targets"
    );
    assert_eq!(scene.moving_instances(0), [true, false, false, false]);
}

#[test]
fn weights_follow_their_curves() {
    let scene = quad("STEP", &[0.0, 0.1, 1.0, 0.5]).load().unwrap();
    assert_eq!(scene.pose_at(1.99).weights, [0.0, 0.1]);
    assert_eq!(scene.pose_at(3.0).weights, [0.0, 0.1], "the animation has begun again");
    // In-tangents, values, out-tangents of both targets, for each of two keys that are 2 s apart.
    let keys = [0.0, 0.0, 0.25, 1.0, 0.5, 0.0, 0.125, -1.0, 0.75, 0.5, 0.0, 0.0];
    let scene = quad("CUBICSPLINE", &keys).load().unwrap();
    for k in 0..20 {
        let time_s = 0.1 * f64::from(k);
        let u = 0.5 * time_s;
        // The closed form of the Hermite cubic by its four coefficients.
        let cubic = |a: f64, da: f64, b: f64, db: f64| {
            let (da, db) = (2.0 * da, 2.0 * db);
            a + u * (da + u * (3.0 * (b - a) - 2.0 * da - db + u * (2.0 * (a - b) + da + db)))
        };
        let expected = [cubic(0.25, 0.5, 0.75, 0.125), cubic(1.0, 0.0, 0.5, -1.0)];
        let found = scene.pose_at(time_s).weights;
        for (found, expected) in found.iter().zip(expected) {
            assert!((f64::from(*found) - expected).abs() < 1e-6, "{time_s} s: {found}, expected {expected}");
        }
    }
}

#[test]
fn a_mesh_without_normals_stays_flat() {
    let mut d = quad("LINEAR", &[0.0, 0.0, 0.0, 1.0]);
    let primitive = &mut d.json["meshes"][0]["primitives"][0];
    primitive["attributes"].as_object_mut().unwrap().remove("NORMAL");
    primitive["targets"][1].as_object_mut().unwrap().remove("NORMAL");
    let scene = posed(&d.load().unwrap(), 1.0);
    assert!(scene.shapes[0].is_flat);
    let found = vertices(&scene, 0);
    assert_eq!(found.len(), 6);
    for corners in found.chunks_exact(3) {
        let normal = (corners[1].0 - corners[0].0).cross(corners[2].0 - corners[0].0).normalize();
        corners.iter().for_each(|(_, n)| assert!((*n - normal).length() < 1e-4, "{n}, expected {normal}"));
    }
    assert!((found[5].1 - Vec3::Z).length() > 0.1, "the second triangle leans");
}

#[test]
fn cameras_and_lights_move_with_their_nodes() {
    let mut d = Document::new();
    let positions = d.floats(&[[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    d.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": positions}}]}]);
    let times = d.floats(&[[0.0f32], [2.0]]);
    let quarter = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2).to_array();
    let turns = d.floats(&[[0.0f32, 0.0, 0.0, 1.0], quarter]);
    let still = d.floats(&[[1.0f32; 3], [0.0; 3]]);
    d.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    d.json["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": "point"}, {"type": "directional"}]}});
    d.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.75, "znear": 0.125}}]);
    d.json["nodes"] = json!([
        {"mesh": 0},
        {"children": [2], "extensions": {"KHR_lights_punctual": {"light": 1}}},
        {"translation": [0.0, 0.0, -4.0], "camera": 0, "name": "eye", "extensions": {"KHR_lights_punctual": {"light": 0}}}]);
    d.json["scenes"] = json!([{"nodes": [0, 1]}]);
    d.json["animations"] = json!([
        {"name": "turn", "samplers": [{"input": times, "output": turns}], "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}]},
        {"name": "vanish", "samplers": [{"input": times, "output": still}], "channels": [{"sampler": 0, "target": {"node": 1, "path": "scale"}}]}]);
    let scene = d.load().unwrap();
    assert_eq!(scene.animations.iter().map(|a| a.name.as_str()).collect::<Vec<_>>(), ["turn", "vanish"]);
    let pose = scene.pose_at(1.0);
    let sin = std::f32::consts::FRAC_1_SQRT_2;
    let beside = Vec3::new(-4.0 * sin, 0.0, -4.0 * sin);
    assert!((pose.lights[1].position_ws - beside).length() < 1e-5, "{}", pose.lights[1].position_ws);
    assert!((pose.lights[0].direction_ws - Vec3::new(-sin, 0.0, -sin)).length() < 1e-6);
    assert!((pose.cameras[0].eye_ws() - beside).length() < 1e-5);
    let forward = -Vec3::from(pose.cameras[0].world_from_view.matrix3.z_axis);
    assert!((forward - Vec3::new(-sin, 0.0, -sin)).length() < 1e-6);
    let loaded = d.load_at(Some(1.0)).unwrap();
    assert_eq!((loaded.cameras, loaded.lights), (pose.cameras, pose.lights));
    // A camera whose node has lost its orientation stays where it was.
    let mut pose = Pose::default();
    scene.pose_into(Moment::Playing { animation: 1, time_s: 1.999_999_999_9 }, &mut pose);
    assert_eq!(pose.cameras[0].projection, scene.cameras[0].projection);
    assert!(pose.cameras[0].world_from_view.is_finite() && pose.lights[1].position_ws.is_finite());
    for time_s in [f64::NAN, f64::INFINITY, -0.5, 1e300] {
        let pose = scene.pose_at(time_s);
        assert!(pose.cameras[0].world_from_view.is_finite(), "{time_s}");
    }
}

fn refused(result: Result<Scene, SceneError>, parts: &[&str]) {
    let text = result.expect_err("is refused").to_string();
    assert!(parts.iter().all(|part| text.contains(part)) && !text.contains('\n'), "{text}");
}

#[test]
fn broken_skins_and_weights_are_told() {
    // A joint past the skin's, at its vertex.
    let mut d = bar(&[0.0, 1.0, 2.0], &HELD);
    d.json["skins"][0]["joints"] = json!([1]);
    refused(d.load(), &["element 2", "found 1", "expected 0 to 0"]);
    // A joint past the nodes, and one that the scene does not draw.
    let mut d = bar(&[0.0, 1.0, 2.0], &HELD);
    d.json["skins"][0]["joints"] = json!([1, 9]);
    refused(d.load(), &["skins[0].joints[1]", "found 9"]);
    let mut d = bar(&[0.0, 1.0, 2.0], &HELD);
    d.json["nodes"][1]["children"] = json!([]);
    refused(d.load(), &["skins[0].joints[1]", "node 2"]);
    let mut d = bar(&[0.0, 1.0, 2.0], &HELD);
    d.json["skins"][0]["joints"] = json!([]);
    refused(d.load(), &["skins[0].joints", "found none"]);
    // Weights that are no numbers.
    let nan = [[f32::NAN, 0.0, 0.0, 0.0]; 3];
    refused(bar(&[0.0, 1.0, 2.0], &nan).load(), &["NaN", "finite"]);
    // Weights of another length than positions.
    let mut d = bar(&[0.0, 1.0, 2.0], &HELD);
    let short = d.floats(&[[1.0f32, 0.0, 0.0, 0.0]; 2]);
    d.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(short);
    refused(d.load(), &["2 elements", "6"]);
    // Too few inverse bind matrices.
    let mut d = bar(&[0.0, 1.0, 2.0], &HELD);
    d.json["skins"][0]["joints"] = json!([1, 2, 1]);
    refused(d.load(), &["2 matrices", "3 or more"]);
    // Values of a weights channel that fit neither keys nor targets.
    let mut d = quad("LINEAR", &[0.0, 0.0, 1.0, 0.5]);
    let short = d.floats(&[[0.0f32]; 3]);
    d.json["animations"][0]["samplers"][0]["output"] = json!(short);
    refused(d.load(), &["animations[0].channels[0]", "3 values", "expected 4"]);
    let mut d = quad("LINEAR", &[0.0, f32::NAN, 1.0, 0.5]);
    refused(d.load(), &["NaN"]);
    d = quad("LINEAR", &[0.0, 0.0, 1.0, 0.5]);
    let channel = d.json["animations"][0]["channels"][0].clone();
    d.json["animations"][0]["channels"] = json!([channel, channel]);
    refused(d.load(), &["second channel"]);
    d = quad("LINEAR", &[0.0, 0.0, 1.0, 0.5]);
    d.json["nodes"][0]["weights"] = json!([1.0]);
    refused(d.load(), &["nodes[0].weights", "found 1", "expected 2"]);
}

/// A short file that draws one mesh with many joints many times.
#[test]
fn a_scene_has_at_most_4_million_joint_matrices() {
    let mut d = bar(&[0.0, 1.0, 2.0], &HELD);
    d.json["skins"][0]["joints"] = json!(vec![1; 2048]);
    d.json["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
    let joints = d.json["nodes"].as_array().unwrap()[1..].to_vec();
    let mut load = |count: usize| {
        let drawn = (0..count).map(|_| json!({"mesh": 0, "skin": 0}));
        let nodes: Vec<_> = [json!({})].into_iter().chain(joints.clone()).chain(drawn).collect();
        d.json["scenes"] = json!([{"nodes": (0..nodes.len()).filter(|k| *k != 2).collect::<Vec<_>>()}]);
        d.json["nodes"] = json!(nodes);
        d.load()
    };
    assert_eq!(load(3).unwrap().pose_at(0.0).object_from_bind.len(), 3 * 2048);
    refused(load(2049), &["matrices of joints", "found 4196352", "at most 4194304"]);
}

#[test]
fn repairs_are_told() {
    let warned = |scene: &Scene, part: &str| {
        assert!(scene.warnings.iter().any(|w| w.contains(part)), "{part}: {:?}", scene.warnings);
    };
    // Weights that add up to nothing: the first joint holds the vertex.
    let scene = bar(&[0.0, 1.0, 2.0], &[HELD[0], HELD[1], [0.0; 4]]).load().unwrap();
    warned(&scene, "2 vertices have no weight of any joint and are held by the first");
    assert!((vertices(&posed(&scene, 1.0), 0)[5].0 - Vec3::new(0.1, 2.0, 0.0)).length() < 1e-6);
    // Weights below 0 count as 0.
    let scene = bar(&[0.0, 1.0, 2.0], &[HELD[0], HELD[1], [-1.0, 1.0, 0.0, 0.0]]).load().unwrap();
    warned(&scene, "2 vertices have negative weights");
    assert!((vertices(&posed(&scene, 1.0), 0)[5].0 - Vec3::new(-1.0, 1.1, 0.0)).length() < 1e-6);
    // Weights that add up to another number than 1 are scaled.
    let scene = bar(&[0.0, 1.0, 2.0], &[HELD[0], HELD[1], [0.0, 0.25, 0.0, 0.0]]).load().unwrap();
    assert!((vertices(&posed(&scene, 1.0), 0)[5].0 - Vec3::new(-1.0, 1.1, 0.0)).length() < 1e-6);
    // More than eight joints: the greatest weights stay.
    let mut d = bar(&[0.0, 1.0, 2.0], &HELD);
    for set in 1..3 {
        let joints = d.view(&[1u8; 24], None);
        let joints =
            d.accessor(json!({"bufferView": joints, "componentType": 5121, "count": 6, "type": "VEC4"}));
        let weights = d.floats(&[[0.5f32, 0.125, 0.125, 0.25]; 6]);
        let attributes = &mut d.json["meshes"][0]["primitives"][0]["attributes"];
        attributes[format!("JOINTS_{set}")] = json!(joints);
        attributes[format!("WEIGHTS_{set}")] = json!(weights);
    }
    let scene = d.load().unwrap();
    warned(&scene, "more than 8 joints");
    assert_eq!((scene.shapes[0].set_count, scene.shapes[0].influences.len()), (2, 12));
    for vertex in 0..6 {
        let of = scene.shapes[0].influences_of(vertex);
        let total: f32 = of.iter().flat_map(|set| set.weights).sum();
        assert!((total - 1.0).abs() < 1e-6, "{total}");
        let weights: Vec<f32> = of.iter().flat_map(|set| set.weights).collect();
        assert!(weights.is_sorted_by(|a, b| a >= b), "{weights:?}");
    }
    // A channel of weights for what has none.
    let mut d = quad("LINEAR", &[0.0, 0.0, 1.0, 0.5]);
    let mesh = d.json["meshes"][0].as_object_mut().unwrap();
    mesh.remove("weights");
    mesh["primitives"][0].as_object_mut().unwrap().remove("targets");
    let scene = d.load().unwrap();
    warned(&scene, "no morph targets");
    assert!(scene.deformations.is_empty() && scene.shapes.is_empty());
}

#[test]
fn scenes_without_deformation_keep_nothing_for_it() {
    for source in ["builtin:moving", "builtin:spheres"] {
        let scene = afterlight_scene::builtin::build(source).unwrap();
        let empty = scene.skins.is_empty() && scene.shapes.is_empty() && scene.deformations.is_empty();
        assert!(empty && scene.rest_weights.is_empty() && scene.camera_nodes.is_empty(), "{source}");
        assert_eq!(scene.deformation_of(0), None);
        let pose = scene.pose_at(0.3);
        assert!(pose.object_from_bind.capacity() == 0 && pose.weights.capacity() == 0);
        let mut posed = scene.clone();
        posed.pose(0.3);
        let worlds: Vec<Affine3A> = posed.instances.iter().map(|i| i.world_from_object).collect();
        assert_eq!(pose.world_from_object, worlds, "{source}");
    }
    assert_eq!(size_of::<afterlight_scene::Instance>(), 80, "as before there were skins");
}

/// A skin far from the origin of the file, bent: as exact as near it.
#[test]
fn a_skin_that_is_far_bends_as_one_that_is_near() {
    let far = DVec3::new(1_400_000.3, 35.2, -900_000.6);
    let near = bar(&[0.0, 1.0, 2.0], &HELD).load().unwrap();
    let mut d = bar(&[0.0, 1.0, 2.0], &HELD);
    d.json["nodes"][1]["translation"] = json!(far.to_array());
    let moved = d.load().unwrap();
    for time_s in [0.0, 0.4, 1.0] {
        let (a, b) = (posed(&near, time_s), posed(&moved, time_s));
        for ((p, n), (q, m)) in vertices(&a, 0).into_iter().zip(vertices(&b, 0)) {
            let off_m = (b.file_from_world(q) - far - a.file_from_world(p)).length();
            assert!(off_m < 2e-6 && (n - m).length() < 1e-4, "{time_s} s: {off_m} m");
        }
    }
    // A morphed mesh whose vertices are far from the origin of their object.
    let mut d = quad("LINEAR", &[0.0, 0.0, 1.0, 0.5]);
    let away = [65_536.0f32, 0.0, -32_768.0];
    let points = [[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let positions = d.floats(&points.map(|[x, y]| [away[0] + x, y, away[2]]));
    d.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(positions);
    let scene = d.load().unwrap();
    assert!(scene.origin_file != DVec3::ZERO);
    let scene = posed(&scene, 1.0);
    let expected = DVec3::from_array(away.map(f64::from)) + DVec3::new(1.5, 1.0, 0.25);
    let found = scene.file_from_world(vertices(&scene, 0)[3].0);
    assert!((found - expected).length() < 1e-6, "{found}, expected {expected}");
}

fn holds(bounds: &Aabb, p: Vec3) -> bool {
    p.cmpge(bounds.min).all() && p.cmple(bounds.max).all()
}

fn affine() -> impl Strategy<Value = Affine3A> {
    let axis = || prop::array::uniform3(-2.0f32..2.0);
    (axis(), axis(), axis(), prop::array::uniform3(-1e4f32..1e4))
        .prop_map(|(x, y, z, t)| Affine3A::from_cols(x.into(), y.into(), z.into(), t.into()))
}

proptest! {
    #[test]
    fn bounds_hold_what_any_joints_and_weights_make(
        joints in prop::collection::vec(affine(), 2),
        world in affine(),
        share in prop::collection::vec(0.0f32..1.0, 5),
        heights in prop::collection::vec(-3.0f32..3.0, 5),
    ) {
        let weights: Vec<[f32; 4]> = share.iter().map(|&s| [1.0 - s, s, 0.0, 0.0]).collect();
        let mut scene = bar(&heights, &weights).load().unwrap();
        let mut pose = scene.pose_at(0.0);
        pose.object_from_bind = joints;
        pose.world_from_object = vec![world];
        let bounds = scene.bounds_in_pose(&pose, 0);
        scene.take_pose(&pose);
        for (p, _) in vertices(&scene, 0) {
            // The matrix of the instance rounds as well.
            let slack = Vec3::splat(4e-7 * (p.abs().max_element() + 1e4));
            prop_assert!(holds(&Aabb { min: bounds.min - slack, max: bounds.max + slack }, p), "{p} {bounds:?}");
        }
    }

    #[test]
    fn bounds_hold_what_any_weights_of_targets_make(a in -3.0f32..3.0, b in -3.0f32..3.0) {
        let mut scene = quad("LINEAR", &[0.0, 0.0, 1.0, 0.5]).load().unwrap();
        let mut pose = scene.pose_at(0.0);
        pose.weights = vec![a, b];
        let bounds = scene.bounds_in_pose(&pose, 0);
        scene.take_pose(&pose);
        for (p, _) in vertices(&scene, 0) {
            prop_assert!(holds(&bounds, p), "{p} {bounds:?}");
        }
        // The box at rest would not do.
        let rest = quad("LINEAR", &[0.0, 0.0, 1.0, 0.5]).load().unwrap().meshes[0].bounds_os;
        prop_assert!(a.abs() < 1.0 || vertices(&scene, 0).iter().any(|(p, _)| !holds(&rest, *p)));
    }

    #[test]
    fn nodes_in_a_pose_are_those_of_the_scene(time_s in -20.0f64..20.0) {
        let scene = afterlight_scene::builtin::build("builtin:moving").unwrap();
        let pose = scene.pose_at(time_s);
        let worlds = scene.world_from_nodes(Some(time_s));
        for (instance, world) in scene.instances.iter().zip(&pose.world_from_object) {
            prop_assert_eq!(*world, worlds[instance.node as usize]);
        }
        let track = &scene.animations[0].tracks[0];
        let local: DAffine3 = track.local_at(scene.animations[0].wrap(time_s));
        prop_assert!(local.is_finite());
    }
}
