//! Camera paths: what they read, where they lead, and how near they come to walls.

mod load_common;

use std::path::Path;

use afterlight_scene::{
    Camera, LoadOptions, Scene,
    camera::{CameraPath, Keyframe},
    load, load_source,
};
use glam::{DVec3, Quat, Vec3};
use load_common::Document;
use proptest::prelude::*;
use serde_json::{Value, json};

fn read(json: &Value) -> CameraPath {
    CameraPath::from_json(&json.to_string(), Path::new("p.json")).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(json: &Value, parts: &[&str]) {
    let text =
        CameraPath::from_json(&json.to_string(), Path::new("p.json")).expect_err("no path").to_string();
    assert!(text.starts_with("p.json: ") && !text.contains('\n'), "{text}");
    assert!(text.contains(": found ") && text.contains(", expected "), "{text}");
    assert!(parts.iter().all(|part| text.contains(part)), "{text} lacks one of {parts:?}");
}

fn place(x: f64) -> Value {
    json!({"eye_ws": [x, 0.0, 0.0], "target_ws": [x, 0.0, -1.0], "fov_deg": 60.0})
}

fn at(x: f64, time_s: f64) -> Value {
    let mut key = place(x);
    key["time_s"] = json!(time_s);
    key
}

fn path(keyframes: &[Value]) -> Value {
    json!({"name": "walk", "keyframes": keyframes})
}

/// The uniform spline by its matrix (Catmull, Rom 1974), for comparison.
fn uniform([a, b, c, d]: [f64; 4], u: f64) -> f64 {
    0.5 * ((2.0 * b)
        + (c - a) * u
        + (2.0 * a - 5.0 * b + 4.0 * c - d) * u * u
        + (3.0 * b - a - 3.0 * c + d) * u * u * u)
}

#[test]
fn even_times_give_the_uniform_spline() {
    let xs = [0.0, 1.0, 4.0, 2.0];
    let mut json = path(&xs.map(place));
    for closed in [false, true] {
        json["closed"] = json!(closed);
        let path = read(&json);
        let spans = if closed { 4 } else { 3 };
        assert_eq!(path.duration_s(), 2.0 * f64::from(spans));
        let key = |k: i32| {
            let k = if closed { k.rem_euclid(4) } else { k.clamp(0, 3) };
            xs[k as usize]
        };
        for step in 0..spans * 10 {
            let (span, u) = (step / 10, f64::from(step % 10) / 10.0);
            let expected = uniform([-1, 0, 1, 2].map(|k| key(span + k)), u);
            for camera in [
                path.camera_at(2.0 * (f64::from(span) + u)),
                path.at((f64::from(span) + u) as f32 / spans as f32),
            ] {
                let off = (f64::from(camera.eye_ws().x) - expected).abs();
                assert!(off < 1e-5, "closed {closed}, {span} + {u}: {} {expected}", camera.eye_ws());
            }
        }
        let end = if closed { 0.0 } else { 2.0 };
        assert_eq!(path.at(1.0).eye_ws().x, end);
        assert_eq!(path.camera_at(path.duration_s()).eye_ws().x, end);
    }
}

#[test]
fn times_are_kept_and_the_way_is_smooth() {
    let path = read(&path(&[at(0.0, 1.0), at(1.0, 2.0), at(3.0, 6.0), at(3.5, 6.5)]));
    assert_eq!(path.duration_s(), 5.5);
    let x = |time_s: f64| f64::from(path.camera_at(time_s).eye_ws().x);
    for (time_s, expected) in
        [(1.0, 0.0), (2.0, 1.0), (6.0, 3.0), (6.5, 3.5), (0.0, 0.0), (9.0, 3.5), (f64::NAN, 0.0)]
    {
        assert!((x(time_s) - expected).abs() < 1e-6, "{time_s} s: {}", x(time_s));
    }
    // The speed has no jump at a keyframe.
    for time_s in [2.0, 6.0] {
        let speed = |from_s: f64| (x(from_s + 1e-2) - x(from_s)) / 1e-2;
        let (before, after) = (speed(time_s - 1e-2), speed(time_s));
        assert!((before - after).abs() < 0.05, "{time_s} s: {before} {after}");
        let chord = if time_s == 2.0 { 3.0 / 5.0 } else { 2.5 / 4.5 };
        assert!((after - chord).abs() < 0.05, "{after}, expected {chord}");
    }
    // A mutant: at even times the camera would be elsewhere.
    let even = read(&json!({"name": "even", "keyframes": [place(0.0), place(1.0), place(3.0), place(3.5)]}));
    assert!((f64::from(even.camera_at(3.0).eye_ws().x) - x(3.0)).abs() > 0.1);
}

#[test]
fn a_cut_is_a_jump() {
    let mut second = at(10.0, 2.0);
    second["cut"] = json!(true);
    let mut json = path(&[at(0.0, 0.0), at(1.0, 1.0), second, at(11.0, 3.0)]);
    let path = read(&json);
    let x = |time_s: f64| path.camera_at(time_s).eye_ws().x;
    assert_eq!([x(1.0), x(1.5), x(1.999)], [1.0; 3], "it stands until the cut");
    assert_eq!(x(2.0), 10.0);
    // The spline on either side knows nothing of the other: both are straight.
    assert!((x(0.5) - 0.5).abs() < 1e-6 && (x(2.5) - 10.5).abs() < 1e-6, "{} {}", x(0.5), x(2.5));
    assert_eq!([0.0, 1.999, 2.0, 99.0].map(|t| path.shot_at(t)), [0, 0, 1, 1]);
    assert!(
        path.is_cut_between(1.9, 2.1) && !path.is_cut_between(2.1, 2.9) && !path.is_cut_between(0.1, 1.9)
    );
    // Without the mark it is a way.
    json["keyframes"][2]["cut"] = json!(false);
    assert!((read(&json).camera_at(1.5).eye_ws().x - 5.5).abs() < 1.0);
    // A cut at the time of the keyframe before it leaves no time to stand.
    json["keyframes"][2]["cut"] = json!(true);
    json["keyframes"][2]["time_s"] = json!(1.0);
    let path = read(&json);
    assert_eq!(path.camera_at(1.0).eye_ws().x, 10.0);
    assert!(path.camera_at(0.999).eye_ws().x < 1.0);
    // Round and round, with a cut at the start: each round is one more shot, and the one in its middle.
    json["closed"] = json!(true);
    json["duration_s"] = json!(4.0);
    json["keyframes"][0]["cut"] = json!(true);
    let path = read(&json);
    assert_eq!([0.5, 1.5, 3.9, 4.5, 5.5, 8.1].map(|t| path.shot_at(t)), [0, 1, 1, 2, 3, 4]);
    assert_eq!(path.camera_at(3.9).eye_ws().x, 11.0);
}

#[test]
fn rotations_are_those_of_gltf() {
    let key = |turn: f32, time_s: f64| {
        let rotation = Quat::from_rotation_y(turn).to_array();
        // Both quaternions of a rotation are one.
        let sign = if time_s > 0.0 { -2.0 } else { 1.0 };
        json!({"time_s": time_s, "eye_ws": [1.0, 2.0, 3.0], "rotation": rotation.map(|v| sign * v), "fov_deg": 40.0 + 10.0 * time_s})
    };
    let path = read(&path(&[key(0.0, 0.0), key(std::f32::consts::FRAC_PI_2, 2.0)]));
    for (time_s, expected) in
        [(0.0, Vec3::NEG_Z), (1.0, Vec3::new(-1.0, 0.0, -1.0).normalize()), (2.0, Vec3::NEG_X)]
    {
        let camera = path.camera_at(time_s);
        let forward = -Vec3::from(camera.world_from_view.matrix3.z_axis);
        assert!((forward - expected).length() < 1e-5, "{time_s} s: {forward}");
        assert_eq!(camera.eye_ws(), Vec3::new(1.0, 2.0, 3.0));
        let afterlight_scene::Projection::Perspective { fov_y_rad, .. } = camera.projection else {
            panic!("perspective")
        };
        assert!((fov_y_rad.to_degrees() - (40.0 + 10.0 * time_s as f32)).abs() < 1e-4);
    }
}

#[test]
fn paths_that_are_none_are_told() {
    let good = path(&[at(0.0, 0.0), at(1.0, 1.0), at(2.0, 2.0)]);
    read(&good);
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut json = good.clone();
        change(&mut json);
        json
    };
    for (change, parts) in [
        (
            &(|j: &mut Value| j["speed"] = json!(1)) as &dyn Fn(&mut Value),
            &["unknown field `speed`", "line 1"][..],
        ),
        (&|j| j["keyframes"][1]["fov"] = json!(60), &["unknown field `fov`", "fov_deg"]),
        (&|j| j["keyframes"] = json!([]), &["keyframes", "none", "at least one"]),
        (&|j| j["keyframes"][1]["eye_ws"] = json!([0.0, 1.0]), &["length 2"]),
        (&|j| j["keyframes"][1]["eye_ws"] = json!("x"), &["invalid type: string"]),
        (&|j| j["keyframes"][1]["eye_ws"] = json!([1e300, 0.0, 0.0]), &["keyframes[1]", "out of range"]),
        (&|j| j["keyframes"][1]["fov_deg"] = json!(180.0), &["keyframes[1].fov_deg", "180"]),
        (
            &|j| j["keyframes"][1]["time_s"] = json!(0.0),
            &["keyframes[1].time_s", "found 0", "more than the 0"],
        ),
        (&|j| j["keyframes"][2]["time_s"] = json!(-1.0), &["keyframes[2].time_s", "-1"]),
        (&|j| j["keyframes"][2]["time_s"] = json!(1e9), &["keyframes[2].time_s", "864000"]),
        (&|j| j["keyframes"][2]["time_s"] = json!(null), &["keyframes[2].time_s", "none", "a time"]),
        (&|j| j["keyframes"][0]["time_s"] = json!(null), &["keyframes[1].time_s", "found 1", "none"]),
        (&|j| j["keyframes"][0]["cut"] = json!(true), &["keyframes[0].cut", "nothing comes before"]),
        (
            &|j| j["keyframes"][1]["target_ws"] = json!(null),
            &["keyframes[1]", "neither target_ws nor rotation"],
        ),
        (
            &|j| j["keyframes"][1]["target_ws"] = json!([1.0, 0.0, 0.0]),
            &["keyframes[1].target_ws", "the eye"],
        ),
        (
            &|j| j["keyframes"][1]["rotation"] = json!([0.0, 0.0, 0.0, 1.0]),
            &["keyframes[1]", "target_ws and rotation"],
        ),
        (
            &|j| {
                j["keyframes"][1]["target_ws"] = json!(null);
                j["keyframes"][1]["rotation"] = json!([0.0, 0.0, 0.0, 1.0]);
            },
            &["keyframes[1]", "found rotation", "target_ws, as keyframes[0]"],
        ),
        (
            &|j| {
                j["keyframes"][1]["target_ws"] = json!(null);
                j["keyframes"][1]["rotation"] = json!([0.0, 0.0, 0.0, 0.0]);
            },
            &["keyframes[1].rotation", "length 0"],
        ),
        (&|j| j["near_m"] = json!(0.0), &["near_m", "found 0"]),
        (&|j| j["duration_s"] = json!(0.0), &["duration_s", "found 0"]),
        (&|j| j["duration_s"] = json!(5.0), &["duration_s", "found 5", "the 2 from the first"]),
        (
            &|j| {
                j["closed"] = json!(true);
                j["duration_s"] = json!(2.0);
            },
            &["duration_s", "more than the 2"],
        ),
        (&|j| *j = json!([]), &["camera path"]),
    ] {
        refused(&changed(change), parts);
    }
    for text in ["", "{", "null", "\u{0}"] {
        assert!(CameraPath::from_json(text, Path::new("p.json")).is_err(), "{text:?}");
    }
    let missing = CameraPath::load(Path::new("no/such.json")).expect_err("no file").to_string();
    assert!(missing.contains("such.json") && missing.contains("cannot be read"), "{missing}");
}

#[test]
fn what_is_written_is_read_again() {
    let mut cut = at(2.0, 2.0);
    cut["cut"] = json!(true);
    let written = json!({"name": "walk", "near_m": 0.25, "closed": true, "duration_s": 4.5, "keyframes": [at(0.0, 0.0), at(1.0, 1.0), cut]});
    let path = read(&written);
    let again: Value = serde_json::to_value(&path).unwrap();
    assert_eq!(again, written);
    assert_eq!(read(&again), path);
    let found: &[Keyframe] = path.keyframes();
    assert!(found[2].cut && found[1].time_s == Some(1.0));
}

#[test]
fn a_camera_of_the_file_is_a_path() {
    let mut d = Document::new();
    let positions = d.floats(&[[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    d.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": positions}}]}]);
    let times = d.floats(&[[0.0f32], [2.0]]);
    let quarter = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2).to_array();
    let turns = d.floats(&[[0.0f32, 0.0, 0.0, 1.0], quarter]);
    d.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.75, "znear": 0.125}}]);
    d.json["nodes"] = json!([
        {"mesh": 0}, {"children": [2]}, {"translation": [0.0, 0.0, -4.0], "camera": 0, "name": "rider"},
        {"camera": 0, "name": "still"}]);
    d.json["scenes"] = json!([{"nodes": [0, 1, 3]}]);
    d.json["animations"] = json!([{"samplers": [{"input": times, "output": turns}],
        "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}]}]);
    let scene = d.load().unwrap();
    assert_eq!(CameraPath::names(&scene), ["fly-through", "rider"]);
    assert!(CameraPath::of_camera(&scene, 1).is_none() && CameraPath::of_camera(&scene, 9).is_none());
    let path = CameraPath::select(&scene, Some("rider")).unwrap();
    assert_eq!((path.duration_s(), path.name.as_str()), (2.0, "rider"));
    for time_s in [0.0, 0.3, 1.7, 2.9, -0.4, f64::NAN] {
        assert_eq!(path.camera_at(time_s), scene.pose_at(time_s).cameras[0], "{time_s} s");
    }
    assert!(path.is_cut_between(1.9, 2.1) && !path.is_cut_between(0.1, 1.9));
}

#[test]
fn a_request_names_a_path_or_a_file() {
    let scene = load_source("builtin:spheres", &LoadOptions::default()).unwrap();
    let text = CameraPath::select(&scene, Some("nave")).expect_err("no such path").to_string();
    assert!(
        text.contains("--path: found 'nave'") && text.contains("fly-through") && text.contains(".json"),
        "{text}"
    );
    assert_eq!(CameraPath::select(&scene, None).unwrap().name, "fly-through");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("walk.json");
    std::fs::write(&file, path(&[place(0.0), place(1.0)]).to_string()).unwrap();
    let far = Scene { origin_file: DVec3::new(1000.0, 0.0, 0.0), ..scene };
    let path = CameraPath::select(&far, file.to_str()).unwrap();
    assert_eq!(path.camera_at(0.0).eye_ws().x, -1000.0, "a file's places are in the file's coordinates");
    assert!(CameraPath::select(&far, Some("absent.json")).is_err());
    // A scene of a known name and another size is not the known one.
    let named = Scene { name: "sponza".to_owned(), ..far };
    assert_eq!(CameraPath::names(&named), ["fly-through"]);
}

proptest! {
    /// Whatever a file holds, it is a path that gives finite cameras, or one line.
    #[test]
    fn damaged_files_end_in_a_path_or_an_error(
        cuts in prop::collection::vec((0usize..400, any::<u8>()), 0..4),
        numbers in prop::collection::vec(prop::sample::select(vec!["0", "-1", "1e300", "1e-300", "null", "[]", "5", "true"]), 3),
        closed: bool, has_times: bool, turned: bool,
    ) {
        let keyframes: Vec<Value> = (0..3).map(|k| {
            let mut key = json!({"eye_ws": [k, 2, 3], "fov_deg": 50, "cut": k == 1});
            if turned { key["rotation"] = json!([0, k - 1, 0, 1]) } else { key["target_ws"] = json!([0, 0, -7]) }
            if has_times { key["time_s"] = json!(k * k) }
            key
        }).collect();
        let mut text = json!({"name": "p", "closed": closed, "near_m": 0.5, "keyframes": keyframes}).to_string();
        for (k, number) in numbers.iter().enumerate() {
            let digits: Vec<usize> = text.char_indices().filter(|(_, c)| c.is_ascii_digit()).map(|(at, _)| at).collect();
            let at = digits[(k * 7 + text.len()) % digits.len()];
            text.replace_range(at..=at, number);
        }
        for (at, byte) in cuts {
            let at = at % text.len();
            text.replace_range(at..=at, &char::from(byte % 128).to_string());
        }
        match CameraPath::from_json(&text, Path::new("p.json")) {
            Ok(path) => {
                for time_s in [-1.0, 0.0, 0.3, 1.0, 2.5, 1e12, f64::NAN, f64::NEG_INFINITY] {
                    let camera = path.camera_at(time_s);
                    prop_assert!(camera.world_from_view.matrix3.is_finite(), "{text} at {time_s}");
                    path.shot_at(time_s);
                }
            }
            Err(error) => prop_assert!(!error.to_string().contains('\n'), "{error}"),
        }
    }
}

/// Distance of a point to a triangle (Ericson 2005, 5.1.5), metres.
fn distance_m(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let nearest = if d1 <= 0.0 && d2 <= 0.0 {
        a
    } else if d3 >= 0.0 && d4 <= d3 {
        b
    } else if d6 >= 0.0 && d5 <= d6 {
        c
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        a + ab * (d1 / (d1 - d3))
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        a + ac * (d2 / (d2 - d6))
    } else if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))
    } else {
        a + ab * (vb / (va + vb + vc)) + ac * (vc / (va + vb + vc))
    };
    (p - nearest).length()
}

/// Distances of points to the nearest triangle of a scene, metres, as far as they are below `reach_m`.
fn clearances_m(scene: &Scene, points: &[Vec3], reach_m: f32) -> Vec<f32> {
    let mut out = vec![reach_m; points.len()];
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let bounds = mesh.bounds_os.transformed(&instance.world_from_object);
        let is_near = |p: &Vec3| (p.clamp(bounds.min, bounds.max) - *p).length() < reach_m;
        let near: Vec<usize> = (0..points.len()).filter(|&k| is_near(&points[k])).collect();
        if near.is_empty() {
            continue;
        }
        let indices =
            &scene.indices[mesh.first_index as usize..(mesh.first_index + mesh.index_count) as usize];
        for t in indices.chunks_exact(3) {
            let corners = [t[0], t[1], t[2]].map(|k| {
                let vertex = (mesh.first_vertex + k) as usize;
                instance.world_from_object.transform_point3(scene.positions_os[vertex].into())
            });
            let [a, b, c] = corners;
            let (min, max) = (a.min(b).min(c) - reach_m, a.max(b).max(c) + reach_m);
            for &k in &near {
                if points[k].cmpge(min).all() && points[k].cmple(max).all() {
                    out[k] = out[k].min(distance_m(points[k], corners));
                }
            }
        }
    }
    out
}

/// Nearest that a path may come to a triangle, metres: five times the near plane of the paths.
const CLEARANCE_M: f32 = 0.25;

fn check_routes(scene: &Scene, expected: &[&str]) {
    let names = CameraPath::names(scene);
    let mut wanted = expected.to_vec();
    wanted.push("fly-through");
    assert_eq!(names, wanted, "{}", scene.name);
    let bounds = scene.bounds_ws();
    for name in expected {
        let path = CameraPath::named(scene, name).expect("a path");
        let steps = 200;
        let times: Vec<f64> =
            (0..=steps).map(|k| path.duration_s() * f64::from(k) / f64::from(steps)).collect();
        let cameras: Vec<Camera> = times.iter().map(|&t| path.camera_at(t)).collect();
        let eyes: Vec<Vec3> = cameras.iter().map(Camera::eye_ws).collect();
        for (&time_s, clearance_m) in times.iter().zip(clearances_m(scene, &eyes, 0.5)) {
            let eye = path.camera_at(time_s).eye_ws();
            assert!(
                clearance_m >= CLEARANCE_M,
                "{} {name}: {clearance_m} m at {time_s} s, {eye}",
                scene.name
            );
            assert!(
                eye.cmpge(bounds.min).all() && eye.cmple(bounds.max).all(),
                "{} {name}: {eye}",
                scene.name
            );
        }
        // People walk at 1.5 m/s, and turn their heads slowly.
        for pair in cameras.windows(2) {
            let dt_s = path.duration_s() / f64::from(steps);
            let speed = f64::from((pair[1].eye_ws() - pair[0].eye_ws()).length()) / dt_s;
            let axes = [&pair[0], &pair[1]].map(|c| Vec3::from(c.world_from_view.matrix3.z_axis));
            let turn_deg = f64::from(axes[0].angle_between(axes[1]).to_degrees()) / dt_s;
            assert!(
                speed < 5.0 && turn_deg < 120.0,
                "{} {name}: {speed} m/s, {turn_deg} degrees/s at {}",
                scene.name,
                pair[0].eye_ws()
            );
        }
    }
}

#[test]
fn routes_keep_off_walls() {
    let colonnade = load_source("builtin:colonnade", &LoadOptions::default()).unwrap();
    check_routes(&colonnade, &["nave", "arcade"]);
    let coarse = load_source("builtin:colonnade?triangles=16384", &LoadOptions::default()).unwrap();
    check_routes(&coarse, &["nave", "arcade"]);
    let Some(folder) = load_common::scenes_dir() else { return };
    for (file, expected) in [
        ("sponza/sponza.gltf", ["nave", "aisles"]),
        ("san_miguel/san_miguel.gltf", ["courtyard", "entrance"]),
    ] {
        let scene = load(&folder.join(file), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        check_routes(&scene, &expected);
    }
}
