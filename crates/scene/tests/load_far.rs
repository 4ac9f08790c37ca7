//! Scenes far from the origin of their file: what is loaded is the scene as it would be there, to the rounding of its own size.

mod load_common;

use std::path::Path;

use afterlight_scene::{
    Aabb, Camera, LoadOptions, Projection, Scene,
    camera::{self, CameraPath},
    load_bytes,
};
use glam::{DVec3, Vec3};
use load_common::Document;
use serde_json::json;

const FAR: DVec3 = DVec3::new(1_400_000.3, 1_200.7, -900_000.6);

/// A square of 10 m and a triangle over it, as text.
fn obj(place: DVec3) -> Scene {
    let mut text = String::new();
    for p in [
        [-5.0, 0.0, 5.0],
        [5.0, 0.0, 5.0],
        [5.0, 0.0, -5.0],
        [-5.0, 0.0, -5.0],
        [0.1, 1.3, 0.7],
        [1.1, 1.3, 0.7],
        [0.1, 2.3, 0.7],
    ] {
        let [x, y, z] = (place + DVec3::from_array(p)).to_array();
        text += &format!("v {x} {y} {z}\n");
    }
    text += "f 1 2 3\nf 1 3 4\nf 5 6 7\n";
    load_bytes(Path::new("far.obj"), text.as_bytes(), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Corners of all triangles in the file's coordinates.
fn corners(scene: &Scene) -> Vec<DVec3> {
    let of = |i: &afterlight_scene::Instance| {
        let mesh = &scene.meshes[i.mesh as usize];
        let indices = &scene.indices[mesh.first_index as usize..][..mesh.index_count as usize];
        let place = |k: &u32| {
            let p = Vec3::from(scene.positions_os[(mesh.first_vertex + k) as usize]);
            scene.file_from_world(i.world_from_object.transform_point3(p))
        };
        indices.iter().map(place).collect::<Vec<_>>()
    };
    scene.instances.iter().flat_map(of).collect()
}

/// The greatest distance of corners from those of the scene at the origin, moved to a place, m.
fn off_m(far: &Scene, near: &Scene, place: DVec3) -> f64 {
    let (a, b) = (corners(far), corners(near));
    assert_eq!(a.len(), b.len());
    a.iter().zip(&b).map(|(a, b)| (*a - *b - place).length()).fold(0.0, f64::max)
}

#[test]
fn text_keeps_its_digits() {
    let (near, far) = (obj(DVec3::ZERO), obj(FAR));
    assert_eq!(near.origin_file, DVec3::ZERO);
    assert!((far.origin_file - FAR).abs().max_element() < 6.0, "{}", far.origin_file);
    assert!(off_m(&far, &near, FAR) < 2e-6, "{} m", off_m(&far, &near, FAR));
    // The camera made to fit sees the same.
    let eye = |scene: &Scene| scene.file_from_world(scene.cameras[0].eye_ws());
    assert!((eye(&far) - eye(&near) - FAR).length() < 1e-4);
    // Nodes lead to where the instances are.
    assert_eq!(
        far.world_from_nodes(None)[far.instances[0].node as usize],
        far.instances[0].world_from_object
    );
}

#[test]
fn cameras_of_people_are_in_the_coordinates_of_the_file() {
    let far = obj(FAR);
    let [x, y, z] = (FAR + DVec3::new(1.0, 2.0, 9.0)).to_array();
    let [tx, ty, tz] = FAR.to_array();
    let camera =
        camera::select(&far, Some(&format!("{x},{y},{z},{tx},{ty},{tz},50"))).expect("seven numbers");
    assert!((far.file_from_world(camera.eye_ws()) - DVec3::new(x, y, z)).length() < 2e-6);
    let keyframe = json!({"eye_ws": [x, y, z], "target_ws": [tx, ty, tz], "fov_deg": 50.0});
    let path = json!({"name": "p", "keyframes": [keyframe]}).to_string();
    let path = CameraPath::from_json(&path, Path::new("p.json")).expect("a path").through(&far);
    assert_eq!(path.at(0.0).world_from_view, camera.world_from_view);
    // A path made of the scene is one that could be written to a file and read again.
    let flight = CameraPath::fly_through(&far);
    let text = serde_json::to_string(&flight).expect("JSON");
    let again = CameraPath::from_json(&text, Path::new("p.json")).expect("a path");
    let again = again.through(&far);
    let same = |t: f32| again.at(t).world_from_view.abs_diff_eq(flight.at(t).world_from_view, 1e-6);
    assert!([0.0, 0.3, 0.9].into_iter().all(same));
    let near = obj(DVec3::ZERO);
    let moved = |t: f32| {
        let eye = |path: &CameraPath, scene: &Scene| scene.file_from_world(path.at(t).eye_ws());
        eye(&flight, &far) - eye(&CameraPath::fly_through(&near), &near) - FAR
    };
    assert!([0.0, 0.3, 0.9].into_iter().all(|t| moved(t).length() < 1e-4));
}

/// A chain of nodes whose far parent turns, with a triangle, a skin and instances at its end.
fn animated(place: DVec3, time_s: Option<f64>) -> Scene {
    let mut d = Document::new();
    let positions = d.floats(&[[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let normals = d.floats(&[[0.0f32, 0.0, 1.0]; 3]);
    let times = d.view(bytemuck::cast_slice::<f32, u8>(&[0.0, 1.0]), None);
    let times = d.accessor(json!({"bufferView": times, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0.0], "max": [1.0]}));
    let turns = d
        .view(bytemuck::cast_slice::<f32, u8>(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.70710677, 0.0, 0.70710677]), None);
    let turns = d.accessor(json!({"bufferView": turns, "componentType": 5126, "count": 2, "type": "VEC4"}));
    let joints = d.view(&[0u8; 12], None);
    let joints = d.accessor(json!({"bufferView": joints, "componentType": 5121, "count": 3, "type": "VEC4"}));
    let weights = d.floats(&[[1.0f32, 0.0, 0.0, 0.0]; 3]);
    let attributes = json!({"POSITION": positions, "NORMAL": normals});
    let mut skinned = attributes.clone();
    (skinned["JOINTS_0"], skinned["WEIGHTS_0"]) = (json!(joints), json!(weights));
    d.json["meshes"] =
        json!([{"primitives": [{"attributes": attributes}]}, {"primitives": [{"attributes": skinned}]}]);
    let beside = (place + DVec3::new(2.2, 0.4, 0.0)).to_array();
    d.json["nodes"] = json!([
        {"translation": place.to_array(), "children": [1]},
        {"mesh": 0, "translation": [0.3, 0.0, 0.1]},
        {"translation": beside},
        {"mesh": 1, "skin": 0}]);
    d.json["skins"] = json!([{"joints": [2]}]);
    d.json["scenes"] = json!([{"nodes": [0, 2, 3]}]);
    d.json["animations"] = json!([{"samplers": [{"input": times, "output": turns}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}]}]);
    d.load_at(time_s).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn nodes_that_move_and_skins_stay_exact() {
    for time_s in [None, Some(0.4)] {
        let (near, mut far) = (animated(DVec3::ZERO, time_s), animated(FAR, time_s));
        assert!((far.origin_file - FAR).abs().max_element() < 4.0, "{}", far.origin_file);
        assert!(off_m(&far, &near, FAR) < 2e-6, "{} m", off_m(&far, &near, FAR));
        far.pose(0.8);
        let mut posed = near.clone();
        posed.pose(0.8);
        assert!(off_m(&far, &posed, FAR) < 2e-6, "{} m after posing", off_m(&far, &posed, FAR));
        assert!(off_m(&far, &near, FAR) > 0.1, "nothing moves");
    }
}

/// What a fitted orthographic camera sees: corners of the box stay between its planes, and in their pixels.
#[test]
fn orthographic_planes_are_drawn_in_and_cut_nothing() {
    let bounds = Aabb { min: Vec3::new(-3.0, 0.0, -4.0), max: Vec3::new(5.0, 2.0, 4.0) };
    for eye in [Vec3::new(2.0, 5.0, 9.0), Vec3::new(1e3, 4e3, 2e3), Vec3::new(2.4e5, 3e5, 3.2e5)] {
        let projection = Projection::Orthographic { half_height_m: 6.0, near_m: 0.1, far_m: 1e6 };
        let camera = Camera { projection, ..Camera::look_at("c", eye, Vec3::ZERO, 1.0, 0.1) };
        let (fitted, moved_m) = camera.fitted(&bounds);
        let Projection::Orthographic { near_m, far_m, .. } = fitted.projection else {
            panic!("orthographic")
        };
        assert!(near_m > 0.0 && far_m - near_m < 16.0 && near_m < 64.0 * 16.0, "{near_m} to {far_m}");
        assert_eq!(moved_m > 0.0, eye.length() > 1e3);
        for i in 0..8 {
            let pick = glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0);
            let p = Vec3::select(pick, bounds.min, bounds.max);
            let [a, b] = [&camera, &fitted].map(|c| c.clip_from_world(1.5).project_point3(p));
            assert!(b.z > 0.0 && b.z < 1.0, "{b}");
            // The place of the far eye itself has steps of 0.03 m.
            assert!((a - b).truncate().abs().max_element() < 1e-5, "{a} {b}");
        }
    }
    // Planes that cut the box stay.
    let projection = Projection::Orthographic { half_height_m: 6.0, near_m: 9.0, far_m: 10.0 };
    let camera = Camera { projection, ..Camera::look_at("c", Vec3::Z * 9.5, Vec3::ZERO, 1.0, 0.1) };
    assert_eq!(camera.fitted(&bounds).0, camera);
    assert_eq!(camera.fitted(&Aabb::EMPTY).0, camera);
    let perspective = Camera::look_at("c", Vec3::Z * 9e5, Vec3::ZERO, 1.0, 0.1);
    assert_eq!(perspective.fitted(&bounds), (perspective.clone(), 0.0));
}
