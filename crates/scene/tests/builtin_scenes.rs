//! The built-in scenes: sound, deterministic, of the size that was asked for.

use afterlight_scene::{
    AlphaMode, Camera, Projection, Scene, SceneError,
    builtin::{build, edge_coverage, list},
    camera,
};
use glam::Vec3;

fn colonnade_small() -> Scene {
    build("builtin:colonnade?triangles=16384&texture=32").expect("the smallest colonnade")
}

/// Corners and normals of a triangle in object space.
fn check_geometry(scene: &Scene) {
    assert_eq!(scene.positions_os.len(), scene.attributes.len());
    assert!(scene.positions_os.iter().flatten().all(|v| v.is_finite()));
    for mesh in &scene.meshes {
        let (first, count) = (mesh.first_index as usize, mesh.index_count as usize);
        let (mut with, mut against) = (0, 0);
        for corners in scene.indices[first..first + count].chunks_exact(3) {
            assert!(corners.iter().all(|&i| i < mesh.vertex_count), "{}", mesh.name);
            let at = |k: usize| (mesh.first_vertex + corners[k]) as usize;
            let [a, b, c] = [0, 1, 2].map(|k| Vec3::from_array(scene.positions_os[at(k)]));
            for p in [a, b, c] {
                assert!(
                    p.cmpge(mesh.bounds_os.min).all() && p.cmple(mesh.bounds_os.max).all(),
                    "{}",
                    mesh.name
                );
            }
            let geometric = (b - a).cross(c - a);
            let shading: Vec3 = [0, 1, 2].map(|k| scene.attributes[at(k)].normal_os()).iter().sum();
            for k in 0..3 {
                let attributes = &scene.attributes[at(k)];
                let (tangent, _) = attributes.tangent_os();
                assert!(tangent.dot(attributes.normal_os()).abs() < 2e-3, "{}: tangent", mesh.name);
            }
            // normals that are clearly on one side
            if geometric.dot(shading) > 0.0 {
                with += 1;
            } else {
                against += 1;
            }
        }
        assert!(
            against * 20 <= with,
            "{}: {against} of {} triangles face away from their normals",
            mesh.name,
            with + against
        );
        assert!((mesh.material as usize) < scene.materials.len());
    }
    for instance in &scene.instances {
        assert_eq!(scene.world_from_nodes(None)[instance.node as usize], instance.world_from_object);
    }
}

#[test]
fn every_scene_is_sound_and_the_same_twice() {
    for builtin in list() {
        let small = match builtin.name {
            "colonnade" => "?triangles=131072&texture=32",
            "gradients" => "?texture=64",
            "spheres" | "furnace" | "moving" | "sphere" => "?segments=24",
            _ => "",
        };
        let spec = format!("builtin:{}{small}", builtin.name);
        let scene = build(&spec).unwrap_or_else(|e| panic!("{spec}: {e}"));
        assert_eq!(scene.name, format!("builtin:{}", builtin.name));
        assert!(!scene.cameras.is_empty() && !scene.instances.is_empty(), "{spec}");
        check_geometry(&scene);
        let again = build(&spec).unwrap_or_else(|e| panic!("{spec}: {e}"));
        assert!(scene.positions_os == again.positions_os && scene.attributes == again.attributes, "{spec}");
        assert!(scene.indices == again.indices && scene.lights == again.lights, "{spec}");
        for (a, b) in scene.images.iter().zip(&again.images) {
            assert_eq!(format!("{a:?}"), format!("{b:?}"), "{spec}");
        }
    }
}

#[test]
fn the_colonnade_has_what_it_is_for() {
    let scene = colonnade_small();
    let size = scene.bounds_ws().size();
    assert!((size - Vec3::new(30.0, 8.0, 12.0)).abs().max_element() < 0.5, "{size}");
    let any = |f: &dyn Fn(&afterlight_scene::Material) -> bool| scene.materials.iter().any(f);
    assert!(any(&|m| matches!(m.alpha_mode, AlphaMode::Mask { .. }) && m.double_sided));
    assert!(any(&|m| m.alpha_mode == AlphaMode::Blend));
    assert!(any(&|m| m.normal_texture.is_some() && m.occlusion_texture.is_some()));
    assert!(any(&|m| m.emissive_factor[0] > 1.0));
    assert!(scene.instances.iter().any(|i| i.world_from_object.matrix3.determinant() < 0.0));
    for name in ["nave", "wall", "away"] {
        assert!(scene.cameras.iter().any(|c| &*c.name == name), "{name}");
    }
}

#[test]
fn the_colonnade_meets_its_triangle_count() {
    for wanted in [16_384u32, 20_000, 65_536, 262_144, 1_000_000] {
        let scene = build(&format!("builtin:colonnade?triangles={wanted}&texture=16")).expect("in range");
        let found = scene.triangle_count() as f64;
        assert!((found / f64::from(wanted) - 1.0).abs() <= 0.02, "{wanted}: {found}");
    }
}

#[test]
fn bad_names_and_values_say_what_there_is() {
    let text = |spec: &str| build(spec).expect_err(spec).to_string();
    assert!(matches!(build("builtin:nowhere"), Err(SceneError::UnknownBuiltin { .. })));
    assert!(text("builtin:nowhere").contains("colonnade, spheres, furnace, edge"));
    assert!(text("builtin:colonnade?count=3").contains("triangles (16384 to 16777216)"));
    assert!(text("builtin:colonnade?triangles=3").contains("from 16384 to 16777216"));
    assert!(text("builtin:colonnade?triangles").contains("found ''"));
    assert!(text("builtin:edge?x=1").contains("no key"));
    for spec in
        ["builtin:", "builtin:?", "builtin:edge?=", "builtin:sphere?segments=99999999999999", "builtin:\n"]
    {
        let line = build(spec).map_or_else(|e| e.to_string(), |s| s.name);
        assert!(!line.contains('\n'), "{line}");
    }
}

#[test]
fn edge_coverage_is_the_mean_of_many_samples() {
    const STEPS: u32 = 64;
    for (width, height) in [(1, 1), (17, 3), (40, 24)] {
        let coverage = edge_coverage(width, height);
        assert_eq!(coverage.len(), (width * height) as usize);
        for (i, found) in coverage.iter().enumerate() {
            let (column, row) = (i as u32 % width, i as u32 / width);
            let mut inside = 0u32;
            for k in 0..STEPS * STEPS {
                let x = f64::from(column) + (f64::from(k % STEPS) + 0.5) / f64::from(STEPS);
                let y = f64::from(row) + (f64::from(k / STEPS) + 0.5) / f64::from(STEPS);
                let x_ws = (x - 0.5 * f64::from(width)) * 2.0 / f64::from(height);
                let y_ws = 1.0 - y * 2.0 / f64::from(height);
                inside += u32::from(x_ws < 0.0625 + 0.296_875 * y_ws);
            }
            let sampled = f64::from(inside) / f64::from(STEPS * STEPS);
            assert!((found - sampled).abs() < 0.02, "{width}×{height} pixel {i}: {found} against {sampled}");
        }
    }
    let total: f64 = edge_coverage(64, 36).iter().sum::<f64>() / (64.0 * 36.0);
    // the trapezoid left of the line: half the view and a strip of 1/16 m, of 32/9 m
    assert!((total - (16.0 / 9.0 + 0.0625) / (32.0 / 9.0)).abs() < 1e-12, "{total}");
}

#[test]
fn moving_objects_move_and_come_back() {
    let scene = build("builtin:moving?segments=8").expect("moving");
    let placed = |time_s: f64| {
        let mut posed = scene.clone();
        posed.pose(time_s);
        posed.instances.iter().map(|i| i.world_from_object).collect::<Vec<_>>()
    };
    let (rest, later) = (placed(0.0), placed(1.1));
    let moved = rest.iter().zip(&later).filter(|(a, b)| !a.abs_diff_eq(**b, 1e-4)).count();
    assert_eq!(moved, 4, "slider, spinner, scaler and swinger");
    for (a, b) in rest.iter().zip(&placed(4.0)) {
        assert!(a.abs_diff_eq(*b, 1e-4));
    }
    for (a, b) in rest.iter().zip(&scene.instances) {
        assert!(a.abs_diff_eq(b.world_from_object, 1e-4), "the rest pose is that of time 0");
    }
}

#[test]
fn cameras_are_chosen_by_name_index_and_numbers() {
    let scene = colonnade_small();
    let name = |spec: Option<&str>| camera::select(&scene, spec).map(|c| c.name.to_string());
    assert_eq!(name(None).expect("first"), "nave");
    assert_eq!(name(Some("aisle")).expect("by name"), "aisle");
    assert_eq!(name(Some("1")).expect("by index"), "axis");
    let by_numbers = camera::select(&scene, Some("1,2,3, 4,2,3, 60")).expect("by numbers");
    assert_eq!(
        by_numbers,
        Camera::look_at(
            "command line",
            Vec3::new(1.0, 2.0, 3.0),
            Vec3::new(4.0, 2.0, 3.0),
            60f32.to_radians(),
            0.1
        )
    );
    for bad in [
        "",
        "99",
        "-1",
        "nowhere",
        "1,2,3",
        "1,2,3,1,2,3,60",
        "1,2,3,4,5,6,0",
        "1,2,3,4,5,6,180",
        "nan,2,3,4,5,6,60",
        "1,2,3,4,5,6,60,0",
        "1,2,3,4,5,6,60,7,8",
        "1,2,3,4,5,6,orthographic",
        "1,2,3,4,5,6,orthographic,0,1,2",
        "1,2,3,4,5,6,orthographic,1,2,2",
        "1e39,0,0,1,1,1,40",
    ] {
        let error = camera::select(&scene, Some(bad)).expect_err(bad).to_string();
        assert!(error.contains("'nave'") && error.contains("fov_deg") && !error.contains('\n'), "{error}");
    }
}

/// What `verify` prints is read back to the same camera, bit by bit.
#[test]
fn cameras_of_numbers_have_a_near_plane_or_no_perspective() {
    let scene = colonnade_small();
    let of = |spec: &str| camera::select(&scene, Some(spec)).expect(spec).projection;
    let [near_m, half_height_m] = [0.1f32 / 3.0, 1e-7 / 7.0];
    assert_eq!(
        of(&format!("1,2,3,4,2,3,60,{near_m}")),
        Projection::Perspective { fov_y_rad: 60f32.to_radians(), near_m }
    );
    assert_eq!(
        of(&format!("1,2,3,4,2,3,orthographic,{half_height_m},0,{}", 1e6)),
        Projection::Orthographic { half_height_m, near_m: 0.0, far_m: 1e6 }
    );
}

#[test]
fn the_floor_is_two_triangles_below_a_standing_eye() {
    let scene = build("builtin:floor").expect("is there");
    assert_eq!(scene.triangle_count(), 2);
    assert_eq!(scene.bounds_ws().size(), Vec3::new(40.0, 0.0, 40.0));
    assert_eq!(scene.cameras[0].eye_ws(), Vec3::new(0.0, 1.7, 0.0));
    assert_eq!(scene.cameras[0].clip_near_m(), 0.004);
}

#[test]
fn made_cameras_stand_inside_interiors_and_before_objects() {
    let hall = colonnade_small();
    let inside = camera::default_camera(&hall);
    let bounds = hall.bounds_ws();
    let eye = inside.eye_ws();
    assert!(eye.cmpgt(bounds.min).all() && eye.cmplt(bounds.max).all(), "{eye}");
    assert!(eye.x.abs() < 2.0 || eye.x.abs() > 10.0, "near an end, or before the fountain: {eye}");
    let object = build("builtin:sphere?segments=24").expect("sphere");
    let outside = camera::default_camera(&object);
    assert!(outside.eye_ws().z > 2.0 && outside.eye_ws().y > 0.0, "{}", outside.eye_ws());
    let nothing = camera::default_camera(&Scene::default());
    assert!(nothing.eye_ws().is_finite());
    for scene in [&hall, &object, &Scene::default()] {
        let path = camera::CameraPath::fly_through(scene);
        for i in 0..=40 {
            let m = path.at(i as f32 / 40.0).world_from_view;
            assert!(m.is_finite() && (m.matrix3.determinant() - 1.0).abs() < 1e-4);
        }
        let (first, last) = (path.at(0.0), path.at(1.0));
        assert!(first.eye_ws().abs_diff_eq(last.eye_ws(), 1e-3), "closed");
    }
}

#[test]
fn camera_paths_pass_through_their_keyframes() {
    let file = std::path::Path::new("path.json");
    let text = r#"{"name": "p", "keyframes": [
        {"eye_ws": [0, 0, 0], "target_ws": [0, 0, -1], "fov_deg": 40},
        {"eye_ws": [1, 2, 0], "target_ws": [0, 0, -1], "fov_deg": 60},
        {"eye_ws": [3, 0, 1], "target_ws": [0, 0, -1], "fov_deg": 50}]}"#;
    let path = camera::CameraPath::from_json(text, file).expect("a path");
    for (i, key) in path.keyframes().iter().enumerate() {
        let camera = path.at(i as f32 / 2.0);
        assert!(camera.eye_ws().abs_diff_eq(glam::DVec3::from_array(key.eye_ws).as_vec3(), 1e-5));
    }
    for bad in [
        "",
        "{}",
        r#"{"name": "p", "keyframes": []}"#,
        r#"{"name": "p", "keyframes": [{"eye_ws": [0, 0, 0], "target_ws": [0, 0, -1], "fov_deg": 0}]}"#,
        r#"{"name": "p", "near_m": 0, "keyframes": [{"eye_ws": [0, 0, 0], "target_ws": [0, 0, -1], "fov_deg": 9}]}"#,
        r#"{"name": "p", "keyframes": [{"eye_ws": [0, 0], "target_ws": [0, 0, -1], "fov_deg": 9}]}"#,
    ] {
        let error = camera::CameraPath::from_json(bad, file).expect_err(bad).to_string();
        assert!(error.starts_with("path.json: ") && !error.contains('\n'), "{error}");
    }
}
