//! Scenes far from the origin of their file, and surfaces far from the eye: positions and depths have 32 bits, which must be
//! spent on the scene and not on the way to it.

mod common;

use std::path::Path;

use afterlight_image::Rgba8Image;
use afterlight_oracle::raster::{RayScene, pixel_ray};
use afterlight_renderer::Renderer;
use afterlight_techniques::{
    Settings, Shadows, Technique, find,
    graph::gpu,
    registry,
    scene::{
        Aabb, Camera, Instance, Light, LoadOptions, Material, Mesh, Projection, Scene, VertexAttributes,
        load_bytes,
    },
};
use common::{Stage, covered, image_of, least_db_of_four_lights, params, psnr, quads};
use glam::{Affine3A, DQuat, DVec3, Quat, Vec2, Vec3};
use serde_json::{Value, json};

const SIZE: (u32, u32) = (160, 90);

/// Where scenes stand, metres: at the origin, and at distances at which 32-bit floats are 0.001 m and 0.125 m apart.
const NEAR: DVec3 = DVec3::ZERO;
const AT_14_KM: DVec3 = DVec3::new(14_000.3, 35.2, -9_000.6);
const AT_1400_KM: DVec3 = DVec3::new(1_400_000.3, 1_200.7, -900_000.6);

/// How a file tells where its things are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Placing {
    /// Each node has the whole translation.
    Nodes,
    /// So has a child of a turned and scaled root.
    Children,
    /// Vertices have it, in 32 bits.
    Vertices,
}

/// Vertices and indices of boxes, as a glTF buffer: positions, normals, indices a mesh.
struct Boxes {
    bytes: Vec<u8>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    meshes: Vec<Value>,
}

impl Boxes {
    fn new() -> Self {
        Self { bytes: Vec::new(), accessors: Vec::new(), views: Vec::new(), meshes: Vec::new() }
    }

    fn accessor(&mut self, bytes: &[u8], mut accessor: Value) -> usize {
        self.views.push(json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()}));
        self.bytes.extend_from_slice(bytes);
        accessor["bufferView"] = json!(self.views.len() - 1);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// A box around a centre, its sides flat.
    fn add(&mut self, center: DVec3, size: DVec3, material: usize) {
        let (mut positions, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::<u32>::new());
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let [mut n, mut u, mut v] = [DVec3::ZERO; 3];
                n[axis] = side;
                u[(axis + 1) % 3] = side;
                v[(axis + 2) % 3] = 1.0;
                let first = (positions.len() / 3) as u32;
                for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                    let p = center + 0.5 * size * (n + a * u + b * v);
                    positions.extend(p.to_array().map(|c| c as f32));
                    normals.extend(n.to_array().map(|c| c as f32));
                }
                indices.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
            }
        }
        let vec3 = json!({"componentType": 5126, "type": "VEC3", "count": positions.len() / 3});
        let p = self.accessor(bytemuck::cast_slice(&positions), vec3.clone());
        let n = self.accessor(bytemuck::cast_slice(&normals), vec3);
        let scalar = json!({"componentType": 5125, "type": "SCALAR", "count": indices.len()});
        let i = self.accessor(bytemuck::cast_slice(&indices), scalar);
        self.meshes.push(json!({"primitives": [
            {"attributes": {"POSITION": p, "NORMAL": n}, "indices": i, "material": material}]}));
    }
}

/// A floor and two cubes, a sun, a spot light and a lamp; a perspective camera, an orthographic one before them, and one 500 km away with a
/// far plane at 10^6 m: all around a place.
fn cubes(place: DVec3, placing: Placing) -> Scene {
    let things = [
        (DVec3::new(0.0, -0.25, 0.0), DVec3::new(12.0, 0.5, 12.0), DQuat::IDENTITY),
        (DVec3::new(-1.0, 0.75, 0.25), DVec3::splat(1.5), DQuat::IDENTITY),
        (DVec3::new(1.25, 0.5, 1.0), DVec3::new(1.0, 1.0, 1.5), DQuat::from_rotation_y(0.5)),
    ];
    let mut boxes = Boxes::new();
    let mut nodes = Vec::new();
    for (i, (center, size, turn)) in things.into_iter().enumerate() {
        if placing == Placing::Vertices {
            boxes.add(place + center, size, i);
            nodes.push(json!({"mesh": i}));
        } else {
            boxes.add(DVec3::ZERO, size, i);
            let translation = (place + center).to_array();
            nodes.push(json!({"mesh": i, "translation": translation, "rotation": turn.to_array()}));
        }
    }
    let looking = |eye: DVec3, target: DVec3| {
        let camera = Camera::look_at("", eye.as_vec3(), target.as_vec3(), 1.0, 0.1);
        Quat::from_mat3a(&camera.world_from_view.matrix3).to_array()
    };
    let target = DVec3::new(0.0, 0.5, 0.0);
    let far_eye = target + 5e5 * DVec3::new(0.48, 0.6, 0.64);
    for (k, eye) in [DVec3::new(2.0, 2.5, 5.0), DVec3::new(2.0, 4.0, 6.0), far_eye].into_iter().enumerate() {
        nodes.push(
            json!({"camera": k, "translation": (place + eye).to_array(), "rotation": looking(eye, target)}),
        );
    }
    for (k, eye) in [DVec3::new(4.0, 6.0, 3.0), DVec3::new(-3.0, 5.0, 4.0), DVec3::new(0.5, 2.5, 2.5)]
        .into_iter()
        .enumerate()
    {
        nodes.push(json!({"translation": (place + eye).to_array(), "rotation": looking(eye, target),
            "extensions": {"KHR_lights_punctual": {"light": k}}}));
    }
    let mut roots: Vec<usize> = (0..nodes.len()).collect();
    if placing == Placing::Children {
        // A quarter turn about x and a scale, as exporters write them, undone by the translation and a turn of each child.
        let (turn, scale) = (DQuat::from_rotation_x(-0.5 * std::f64::consts::PI), 0.5);
        for node in &mut nodes {
            let t: [f64; 3] = serde_json::from_value(node["translation"].clone()).expect("a translation");
            let r: [f64; 4] = serde_json::from_value(node["rotation"].clone()).expect("a rotation");
            node["translation"] = json!((turn.inverse() * DVec3::from_array(t) / scale).to_array());
            node["rotation"] = json!((turn.inverse() * DQuat::from_array(r)).normalize().to_array());
            if node.get("mesh").is_some() {
                node["scale"] = json!([1.0 / scale, 1.0 / scale, 1.0 / scale]);
            }
        }
        nodes.push(json!({"rotation": turn.to_array(), "scale": [scale, scale, scale], "children": roots}));
        roots = vec![nodes.len() - 1];
    }
    let material = |color: [f64; 3]| {
        json!({"pbrMetallicRoughness":
        {"baseColorFactor": [color[0], color[1], color[2], 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.4}})
    };
    let root = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes,
        "meshes": boxes.meshes, "accessors": boxes.accessors, "bufferViews": boxes.views,
        "buffers": [{"byteLength": boxes.bytes.len()}],
        "materials": [material([0.7, 0.7, 0.7]), material([0.8, 0.2, 0.1]), material([0.2, 0.3, 0.9])],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}},
            {"type": "orthographic", "orthographic": {"xmag": 4.0, "ymag": 3.0, "znear": 0.1, "zfar": 100.0}},
            {"type": "orthographic", "orthographic": {"xmag": 4.0, "ymag": 3.0, "znear": 0.1, "zfar": 1e6}}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "directional", "intensity": 2.0},
            {"type": "spot", "intensity": 60.0, "range": 20.0, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}},
            {"type": "point", "intensity": 8.0, "range": 6.0, "color": [1.0, 0.8, 0.5]}]}},
    });
    load_glb(&root, &boxes.bytes)
}

/// Loads a GLB of a document and its buffer.
fn load_glb(root: &Value, buffer: &[u8]) -> Scene {
    let glb = quads::binary(root, buffer.to_vec());
    load_bytes(Path::new("cubes.glb"), &glb, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// The scene as it would be without an origin of its own: everything in the file's coordinates, in 32 bits.
fn in_file_coordinates(mut scene: Scene) -> Scene {
    let origin = std::mem::take(&mut scene.origin_file);
    let moved = |p: Vec3| (p.as_dvec3() + origin).as_vec3();
    for instance in &mut scene.instances {
        instance.world_from_object.translation = moved(instance.world_from_object.translation.into()).into();
    }
    scene.lights.iter_mut().for_each(|light| light.position_ws = moved(light.position_ws));
    for camera in &mut scene.cameras {
        camera.world_from_view.translation = moved(camera.eye_ws()).into();
    }
    scene
}

/// The view of a camera of the scene, one of its lights alone where that is asked for.
fn view_of(stage: &Stage, camera: usize, light: Option<usize>, shadows: Shadows) -> Settings {
    let mut settings = stage.from(stage.scene.cameras[camera].clone(), SIZE, 0);
    if let Some(light) = light {
        settings.lights = vec![stage.scene.lights[light]];
    }
    settings.with_effects(|effects| effects.shadows.method = shadows)
}

/// The same view of the scene at the origin: from the eye of the far scene, which is rounded to 32 bits where it stands. That of the third
/// camera has steps of 0.03 m, so it is taken where the view is fitted to.
fn view_at_origin(far: &Stage, place: DVec3, there: &Settings) -> Settings {
    let (mut camera, _) = there.camera.fitted(&far.scene.bounds_ws());
    camera.world_from_view.translation =
        (far.scene.file_from_world(camera.eye_ws()) - place).as_vec3().into();
    let to_origin = |light: &Light| Light {
        position_ws: (far.scene.file_from_world(light.position_ws) - place).as_vec3(),
        ..*light
    };
    Settings { camera, lights: there.lights.iter().map(to_origin).collect(), ..there.clone() }
}

fn forward() -> &'static dyn Technique {
    find("forward").expect("there")
}

/// Writes an image for the eye where `AFTERLIGHT_FAR_IMAGES` names a folder.
fn show(name: &str, image: &Rgba8Image) {
    let Ok(folder) = std::env::var("AFTERLIGHT_FAR_IMAGES") else { return };
    let file = Path::new(&folder).join(format!("{}.png", name.replace([' ', ':', '/'], "-")));
    afterlight_image::write_png(&file, image).unwrap_or_else(|e| panic!("{e}"));
}

/// Views that are compared wherever the scene stands: camera, light, shadows.
fn views() -> impl Iterator<Item = (usize, Option<usize>, Shadows)> {
    let lights =
        [(None, Shadows::None), (Some(0), Shadows::Map), (Some(1), Shadows::Map), (Some(2), Shadows::Map)];
    (0..3).flat_map(move |camera| lights.into_iter().map(move |(light, shadows)| (camera, light, shadows)))
}

/// The picture of a scene does not depend on where it is.
#[test]
fn pictures_are_alike_wherever_the_scene_stands() {
    let gpu = afterlight_testkit::gpu();
    let near = Stage::of(&gpu, cubes(NEAR, Placing::Nodes));
    assert_eq!(near.scene.origin_file, DVec3::ZERO);
    for (place, placing) in
        [(AT_14_KM, Placing::Nodes), (AT_1400_KM, Placing::Nodes), (AT_1400_KM, Placing::Children)]
    {
        let far = Stage::of(&gpu, cubes(place, placing));
        let lost = Stage::of(&gpu, in_file_coordinates(far.scene.clone()));
        let mut worst_lost_db = f64::INFINITY;
        for (camera, light, shadows) in views() {
            let there = view_of(&far, camera, light, shadows);
            let here = near.image(forward(), &view_at_origin(&far, place, &there));
            let there = far.image(forward(), &there);
            let without = lost.image(forward(), &view_of(&lost, camera, light, shadows));
            assert!(covered(&here) > 0.2, "camera {camera} shows {:.2}", covered(&here));
            let (db, lost_db) = (psnr(&here, &there), psnr(&here, &without));
            let what = format!("{place} {placing:?}, camera {camera}, light {light:?}, {shadows:?}");
            println!("{what}: {db:.1} dB; not recentred {lost_db:.1} dB");
            show(&format!("far {:.0} {placing:?} {camera} {light:?}", place.x), &there);
            show(&format!("lost {:.0} {placing:?} {camera} {light:?}", place.x), &without);
            assert!(db > 55.0, "{what}: {db:.1} dB to the scene at the origin");
            worst_lost_db = worst_lost_db.min(lost_db);
        }
        assert!(worst_lost_db < 50.0, "{place}: what is not recentred goes unseen: {worst_lost_db:.1} dB");
    }
}

/// Vertices that are far from the origin of their object: exact in the file, since all are multiples of 1/8 m.
#[test]
fn vertices_may_be_far_from_their_object() {
    let gpu = afterlight_testkit::gpu();
    let near = Stage::of(&gpu, cubes(NEAR, Placing::Vertices));
    let place = DVec3::new(1_400_000.0, 1_200.0, -900_000.0);
    let far = Stage::of(&gpu, cubes(place, Placing::Vertices));
    let largest = far.scene.positions_os.iter().flatten().fold(0f32, |largest, v| largest.max(v.abs()));
    assert!(largest < 32.0, "vertices at {largest} m");
    // Posing keeps what has moved in its place.
    let worlds = far.scene.world_from_nodes(None);
    assert!(far.scene.instances.iter().all(|i| worlds[i.node as usize] == i.world_from_object));
    for (camera, light, shadows) in views() {
        let there = view_of(&far, camera, light, shadows);
        let here = near.image(forward(), &view_at_origin(&far, place, &there));
        let db = psnr(&here, &far.image(forward(), &there));
        println!("camera {camera}, light {light:?}: {db:.1} dB");
        assert!(db > 55.0, "camera {camera}, light {light:?}: {db:.1} dB");
    }
}

/// A scene that code has put together far away is brought near by a call.
#[test]
fn scenes_of_code_are_recentred_when_asked() {
    let place = DVec3::new(1_400_000.0, 1_200.0, -900_000.0);
    let mut scene = in_file_coordinates(cubes(place, Placing::Nodes));
    let before = scene.clone();
    scene.recentre();
    assert!((scene.origin_file - place).abs().max_element() <= 8.0, "{}", scene.origin_file);
    let kept = |a: Vec3, b: Vec3| scene.file_from_world(a).abs_diff_eq(b.as_dvec3(), 1e-5);
    assert!(scene.cameras.iter().zip(&before.cameras).all(|(a, b)| kept(a.eye_ws(), b.eye_ws())));
    assert!(scene.lights.iter().zip(&before.lights).all(|(a, b)| kept(a.position_ws, b.position_ws)));
    let place_of = |i: &Instance| Vec3::from(i.world_from_object.translation);
    assert!(scene.instances.iter().zip(&before.instances).all(|(a, b)| kept(place_of(a), place_of(b))));
    let once = scene.clone();
    scene.recentre();
    assert_eq!(scene.origin_file, once.origin_file, "a second call finds nothing far");
}

/// `forward` against rays in 64 bits, both relative to the scene's origin: the share of pixels that are off, of those whose ray is away
/// from edges.
fn wrong_share(stage: &Stage, settings: &Settings) -> f64 {
    let rays = RayScene::new(&stage.scene);
    let image = stage.radiance(forward(), settings);
    let (mut wrong, mut all) = (0, 0);
    for (i, found) in image.iter().enumerate() {
        let pixel = [i as u32 % SIZE.0, i as u32 / SIZE.0];
        let hit = rays.first_hit(&pixel_ray(&settings.camera, pixel, [SIZE.0, SIZE.1]));
        if hit.is_none_or(|hit| hit.edge_distance < 0.02) {
            continue;
        }
        let expected = rays.shade_pixel(&settings.lights, &settings.camera, pixel, [SIZE.0, SIZE.1]);
        let found = DVec3::new(found[0].into(), found[1].into(), found[2].into());
        all += 1;
        wrong += u32::from((found - expected).abs().max_element() > 0.01 * (1.0 + expected.max_element()));
    }
    assert!(all > 500, "{all} pixels compared");
    f64::from(wrong) / f64::from(all)
}

#[test]
fn forward_is_what_rays_in_64_bits_find() {
    let gpu = afterlight_testkit::gpu();
    for place in [AT_14_KM, AT_1400_KM] {
        let stage = Stage::of(&gpu, cubes(place, Placing::Nodes));
        for camera in 0..3 {
            let wrong = wrong_share(&stage, &view_of(&stage, camera, None, Shadows::None));
            println!("{place}, camera {camera}: {wrong:.4} of pixels off");
            assert!(wrong <= 0.001, "{place}, camera {camera}: {wrong:.4} of pixels off");
        }
    }
}

/// Every technique at each number of samples that it has here, and other ways of filling, against `forward`.
fn all_agree(stage: &Stage, settings: &Settings, what: &str) {
    for samples in [1, 4] {
        let settings = &Settings { samples, ..settings.clone() };
        let reference = stage.image(forward(), settings);
        for technique in registry().iter().filter(|t| t.info().samples.contains(&samples)) {
            let id = technique.info().id;
            let ways: &[&[(&str, &str)]] = match id {
                "gbuffer-list" => &[&[], &[("fill", "raster")], &[("visibility", "compute")]],
                "dais" => &[&[], &[("fill", "cache")]],
                _ => &[&[]],
            };
            for way in ways {
                let params = params(*technique, way);
                let db = psnr(&reference, &image_of(&mut stage.prepare_with(*technique, settings, &params)));
                println!("{what}, {samples} samples: {id} {way:?}: {db:.2} dB");
                let least = least_db_of_four_lights(*technique, &params, samples);
                assert!(db >= least, "{what}, {samples} samples: {id} {way:?}: {db:.2} dB to forward");
            }
        }
    }
}

#[test]
fn every_technique_agrees_far_away() {
    let gpu = afterlight_testkit::gpu();
    for (place, camera, light, shadows) in [
        (AT_14_KM, 0, Some(1), Shadows::Map),
        (AT_14_KM, 2, None, Shadows::None),
        (AT_1400_KM, 0, None, Shadows::None),
        (AT_1400_KM, 1, Some(0), Shadows::Map),
        (AT_1400_KM, 2, Some(2), Shadows::Map),
    ] {
        let stage = Stage::of(&gpu, cubes(place, Placing::Nodes));
        let there = view_of(&stage, camera, light, shadows);
        all_agree(&stage, &there, &format!("{:.0} m, camera {camera}", place.x));
    }
}

/// Stairs: pairs of squares side by side across the view at growing distances, all of one mesh. Of each pair the farther one is drawn first and
/// the nearer one covers its middle. Both shine by themselves, the nearer one brighter.
fn stairs(first_m: f32, step_m: f32, projection: Projection) -> Scene {
    const COLUMNS: usize = 16;
    let half_width = match projection {
        Projection::Perspective { fov_y_rad, .. } => first_m * (0.5 * fov_y_rad).tan(),
        Projection::Orthographic { half_height_m, .. } => half_height_m,
    } * SIZE.0 as f32
        / SIZE.1 as f32;
    let column_m = 2.0 * half_width / COLUMNS as f32;
    let mut scene = Scene { name: "stairs".to_owned(), ..Scene::default() };
    for nearer in [false, true] {
        for k in 0..COLUMNS {
            // Distances that are no multiples of anything, two steps apart.
            let distance_m = first_m + 2.37 * k as f32 * step_m + if nearer { 0.0 } else { step_m };
            let center = Vec3::new((k as f32 + 0.5) * column_m - half_width, 0.0, -distance_m);
            let half = column_m * if nearer { Vec2::new(0.3, 2.0) } else { Vec2::new(0.45, 3.0) };
            let first = scene.positions_os.len() as u32;
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                scene.positions_os.push((center + Vec3::new(x * half.x, y * half.y, 0.0)).to_array());
                let color = if nearer { [1.0, 0.9, 0.2, 1.0] } else { [0.1, 0.1, 0.4, 1.0] };
                let packed = VertexAttributes::pack(Vec3::Z, Vec3::X, 1.0, Vec2::ZERO, Vec2::ZERO, color);
                scene.attributes.push(packed);
            }
            scene.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
    }
    let mut bounds_os = Aabb::EMPTY;
    scene.positions_os.iter().for_each(|p| bounds_os.extend(Vec3::from(*p)));
    scene.meshes.push(Mesh {
        name: "stairs".to_owned(),
        first_index: 0,
        index_count: scene.indices.len() as u32,
        first_vertex: 0,
        vertex_count: scene.positions_os.len() as u32,
        material: 0,
        bounds_os,
    });
    scene.materials.push(Material { unlit: true, ..Material::default() });
    scene.instances.push(Instance { mesh: 0, node: 0, world_from_object: Affine3A::IDENTITY });
    let camera = Camera::look_at("stairs", Vec3::ZERO, Vec3::NEG_Z, 0.1, 0.1);
    scene.cameras.push(Camera { projection, ..camera });
    scene
}

const PERSPECTIVE: Projection = Projection::Perspective { fov_y_rad: 0.1, near_m: 0.1 };
const ORTHOGRAPHIC: Projection = Projection::Orthographic { half_height_m: 2.0, near_m: 0.1, far_m: 1e6 };

/// Steps that 32-bit floats of reversed depth tell apart: 0.2 m at 1 km from a near plane of 0.1 m, of which 24 fixed bits make 0.6 m; 0.01 m
/// before a far plane of 10^6 m, for which even depths of 32 bits would be 0.06 m apart.
#[test]
fn depths_are_told_apart_far_from_the_eye_and_before_far_planes() {
    let gpu = afterlight_testkit::gpu();
    for (what, first_m, step_m, projection) in
        [("perspective", 1000.0, 0.2, PERSPECTIVE), ("orthographic", 10.0, 0.01, ORTHOGRAPHIC)]
    {
        let stage = Stage::of(&gpu, stairs(first_m, step_m, projection));
        let settings = stage.settings(SIZE, 0);
        show(what, &stage.image(forward(), &settings));
        let wrong = wrong_share(&stage, &settings);
        assert!(wrong == 0.0, "{what}: {wrong:.4} of pixels off");
        all_agree(&stage, &settings, what);
    }
    // A far plane that the scene itself reaches cannot be brought nearer: the same stairs are then not to be told apart.
    let mut stretched = stairs(10.0, 0.01, ORTHOGRAPHIC);
    for z in [-0.2, -9.9e5] {
        stretched.positions_os.push([0.0, 0.0, z]);
        stretched.attributes.push(stretched.attributes[0]);
        stretched.meshes[0].bounds_os.extend(Vec3::new(0.0, 0.0, z));
    }
    stretched.meshes[0].vertex_count += 2;
    // Two triangles without an area, so that bounds of draws reach there too.
    stretched.indices.extend([32 * 4, 32 * 4, 32 * 4, 32 * 4 + 1, 32 * 4 + 1, 32 * 4 + 1]);
    stretched.meshes[0].index_count += 6;
    let stage = Stage::of(&gpu, stretched);
    let wrong = wrong_share(&stage, &stage.settings(SIZE, 0));
    println!("not fitted: {wrong:.4} of pixels off");
    assert!(wrong > 0.05, "depths that are not fitted go unseen: {wrong:.4}");
}

/// A device whose depth with stencil has 24 bits: techniques with a stencil confuse surfaces, and it is told.
#[test]
fn depth_of_24_bits_is_caught_and_told() {
    // One device a process has validation on; this one takes its turn.
    let gpu = afterlight_testkit::gpu();
    let options = gpu::DeviceOptions { without_float_stencil: true, ..Default::default() };
    let coarse = gpu::Device::open(&options).unwrap_or_else(|e| panic!("{e}"));
    let scene = stairs(1000.0, 0.2, PERSPECTIVE);
    let [fine, coarse] = [&*gpu, &coarse].map(|device| Stage::of(device, scene.clone()));
    let settings = Settings { samples: 4, ..fine.settings(SIZE, 0) };
    let warnings = |stage: &Stage| {
        let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings);
        renderer.unwrap_or_else(|e| panic!("{e}")).warnings()
    };
    assert!(warnings(&fine).is_empty(), "{:?}", warnings(&fine));
    assert!(warnings(&coarse).iter().any(|line| line.contains("24 bits")), "{:?}", warnings(&coarse));
    let reference = fine.image(forward(), &settings);
    for (id, way) in [("dais-list", &[][..]), ("gbuffer-list", &[("fill", "raster")])] {
        let technique = find(id).expect("there");
        let of = |stage: &Stage| {
            let mut prepared = stage.prepare_with(technique, &settings, &params(technique, way));
            psnr(&reference, &image_of(&mut prepared))
        };
        let (fine_db, coarse_db) = (of(&fine), of(&coarse));
        println!("{id}: {fine_db:.1} dB, with 24 bits {coarse_db:.1} dB");
        assert!(fine_db >= 45.0, "{id}: {fine_db:.1} dB");
        assert!(coarse_db < 40.0, "{id}: 24 bits go unseen: {coarse_db:.1} dB");
    }
}
