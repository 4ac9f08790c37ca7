//! Poses of every sample that moves, against a reading of the files that shares no code with the loader: JSON, accessors, curves, nodes,
//! morph targets and skins in f64, as glTF 2.0 has them.

use std::path::{Path, PathBuf};

use afterlight_oracle::deform::{posed_vertices, posed_vertices_ws};
use afterlight_scene::{
    Deformation, Influences, Instance, LoadOptions, Mesh, MorphTarget, Node, Pose, Scene, Shape, Skin,
    VertexAttributes, load,
};
use base64::Engine;
use glam::{Affine3A, DAffine3, DMat3, DMat4, DQuat, DVec3, DVec4, Vec2, Vec3};
use serde_json::Value;

/// A glTF file as the test reads it.
struct Document {
    json: Value,
    buffers: Vec<Vec<u8>>,
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn number(value: &Value) -> usize {
    value.as_u64().expect("a whole number") as usize
}

impl Document {
    fn read(file: &Path) -> Self {
        let bytes = std::fs::read(file).expect("a sample");
        let word =
            |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let (text, bin) = if bytes.starts_with(b"glTF") {
            let end = 20 + word(&bytes, 12);
            let bin = bytes.get(end + 8..).map(|rest| rest[..word(&bytes, end)].to_vec());
            (bytes[20..end].to_vec(), bin)
        } else {
            (bytes, None)
        };
        let json: Value = serde_json::from_slice(&text).expect("JSON");
        let read = |buffer: &Value| match buffer["uri"].as_str() {
            None => bin.clone().unwrap_or_default(),
            Some(uri) => match uri.split_once("base64,") {
                Some((_, data)) => base64::engine::general_purpose::STANDARD.decode(data).expect("base64"),
                None => std::fs::read(file.with_file_name(uri.replace("%20", " "))).expect("a buffer"),
            },
        };
        let buffers = list(&json["buffers"]).iter().map(read).collect();
        Self { json, buffers }
    }

    fn component(kind: usize, bytes: &[u8], normalized: bool) -> f64 {
        let (value, limit) = match kind {
            5120 => (f64::from(bytes[0] as i8), 127.0),
            5121 => (f64::from(bytes[0]), 255.0),
            5122 => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
            5123 => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
            5125 => (f64::from(u32::from_le_bytes(bytes[..4].try_into().unwrap())), 1.0),
            _ => (f64::from(f32::from_le_bytes(bytes[..4].try_into().unwrap())), 1.0),
        };
        if normalized { (value / limit).max(-1.0) } else { value }
    }

    /// The elements of an accessor, each as many numbers as it has components.
    fn accessor(&self, index: &Value) -> Vec<Vec<f64>> {
        let a = &self.json["accessors"][number(index)];
        let kind = number(&a["componentType"]);
        let size = [1, 1, 2, 2, 0, 4, 4][kind - 5120];
        let width = [("SCALAR", 1), ("VEC2", 2), ("VEC3", 3), ("VEC4", 4), ("MAT4", 16)]
            .into_iter()
            .find(|t| a["type"] == t.0);
        let width = width.expect("a type").1;
        let normalized = a["normalized"] == true;
        let read = |view: &Value, offset: &Value, kind: usize, size: usize, width: usize, count: usize| {
            let view = &self.json["bufferViews"][number(view)];
            let start = view["byteOffset"].as_u64().unwrap_or(0) + offset.as_u64().unwrap_or(0);
            let stride = view["byteStride"].as_u64().map_or(size * width, |s| s as usize);
            let bytes = &self.buffers[number(&view["buffer"])];
            let one = |k: usize, c: usize| {
                Self::component(kind, &bytes[start as usize + k * stride + c * size..], normalized)
            };
            (0..count).map(|k| (0..width).map(|c| one(k, c)).collect()).collect::<Vec<Vec<f64>>>()
        };
        let count = number(&a["count"]);
        let mut out = match &a["bufferView"] {
            Value::Null => vec![vec![0.0; width]; count],
            view => read(view, &a["byteOffset"], kind, size, width, count),
        };
        if let Some(sparse) = a.get("sparse") {
            let count = number(&sparse["count"]);
            let index_kind = number(&sparse["indices"]["componentType"]);
            let index_size = [1, 1, 2, 2, 0, 4][index_kind - 5120];
            let (indices, values) = (&sparse["indices"], &sparse["values"]);
            let indices =
                read(&indices["bufferView"], &indices["byteOffset"], index_kind, index_size, 1, count);
            let values = read(&values["bufferView"], &values["byteOffset"], kind, size, width, count);
            for (index, value) in indices.iter().zip(values) {
                out[index[0] as usize] = value;
            }
        }
        out
    }

    /// The value of a sampler: for weights of all targets, so `width` numbers.
    fn sample(&self, sampler: &Value, time_s: f64, width: usize, is_rotation: bool) -> Vec<f64> {
        let times: Vec<f64> = self.accessor(&sampler["input"]).into_iter().flatten().collect();
        let values: Vec<f64> = self.accessor(&sampler["output"]).into_iter().flatten().collect();
        let kind = sampler["interpolation"].as_str().unwrap_or("LINEAR");
        let row = |row: usize| values[row * width..(row + 1) * width].to_vec();
        let key = |k: usize| if kind == "CUBICSPLINE" { row(3 * k + 1) } else { row(k) };
        let after = times.iter().take_while(|&&t| t <= time_s).count();
        if after == 0 || after == times.len() {
            return key(if after == 0 { 0 } else { after - 1 });
        }
        let (from, to) = (after - 1, after);
        let span = times[to] - times[from];
        let u = (time_s - times[from]) / span;
        let (a, b) = (key(from), key(to));
        match kind {
            "STEP" => a,
            "CUBICSPLINE" => {
                let (out_a, in_b) = (row(3 * from + 2), row(3 * to));
                let value = |k: usize| {
                    (2.0 * u.powi(3) - 3.0 * u.powi(2) + 1.0) * a[k]
                        + span * (u.powi(3) - 2.0 * u.powi(2) + u) * out_a[k]
                        + (-2.0 * u.powi(3) + 3.0 * u.powi(2)) * b[k]
                        + span * (u.powi(3) - u.powi(2)) * in_b[k]
                };
                (0..width).map(value).collect()
            }
            _ if is_rotation => {
                let [a, b] = [a, b].map(|q| DQuat::from_slice(&q).normalize());
                let dot = a.dot(b);
                let angle = dot.abs().min(1.0).acos();
                let (wa, wb) = if angle < 1e-4 {
                    (1.0 - u, u)
                } else {
                    (((1.0 - u) * angle).sin() / angle.sin(), (u * angle).sin() / angle.sin())
                };
                (a * wa + b * (wb * dot.signum())).to_array().to_vec()
            }
            _ => a.iter().zip(&b).map(|(a, b)| (1.0 - u) * a + u * b).collect(),
        }
    }

    fn duration_s(&self) -> f64 {
        let samplers = list(&self.json["animations"][0]["channels"]).iter().map(|c| self.sampler(c));
        samplers.flat_map(|s| self.accessor(&s["input"])).map(|t| t[0]).fold(0.0, f64::max)
    }

    fn sampler(&self, channel: &Value) -> &Value {
        &self.json["animations"][0]["samplers"][number(&channel["sampler"])]
    }

    /// The animated value of a property of a node, if it is animated.
    fn animated(&self, node: usize, path: &str, time_s: f64, width: usize) -> Option<Vec<f64>> {
        let mut channels = list(&self.json["animations"][0]["channels"]).iter();
        let channel = channels.find(|c| c["target"]["node"] == node && c["target"]["path"] == path)?;
        Some(self.sample(self.sampler(channel), time_s, width, path == "rotation"))
    }

    fn local(&self, node: usize, time_s: f64) -> DMat4 {
        let json = &self.json["nodes"][node];
        let floats = |value: &Value| list(value).iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
        if !json["matrix"].is_null() {
            return DMat4::from_cols_slice(&floats(&json["matrix"]));
        }
        let property = |path: &str, width: usize, rest: &[f64]| {
            self.animated(node, path, time_s, width).unwrap_or_else(|| match &json[path] {
                Value::Null => rest.to_vec(),
                value => floats(value),
            })
        };
        DMat4::from_scale_rotation_translation(
            DVec3::from_slice(&property("scale", 3, &[1.0; 3])),
            DQuat::from_slice(&property("rotation", 4, &[0.0, 0.0, 0.0, 1.0])).normalize(),
            DVec3::from_slice(&property("translation", 3, &[0.0; 3])),
        )
    }

    /// The scene's nodes, parents first, in the order of the file, with their places in the world.
    fn nodes(&self, time_s: f64) -> Vec<(usize, DMat4)> {
        let scene = self.json["scene"].as_u64().unwrap_or(0) as usize;
        let mut stack: Vec<(usize, DMat4)> = list(&self.json["scenes"][scene]["nodes"])
            .iter()
            .rev()
            .map(|n| (number(n), DMat4::IDENTITY))
            .collect();
        let mut out = Vec::new();
        while let Some((node, parent)) = stack.pop() {
            let world = parent * self.local(node, time_s);
            out.push((node, world));
            stack
                .extend(list(&self.json["nodes"][node]["children"]).iter().rev().map(|c| (number(c), world)));
        }
        out
    }

    /// Corners of the triangles of everything drawn: for each draw position and normal of each corner. A normal is `None` where the file
    /// has none, or where it is so short that its direction says little.
    fn draws(&self, time_s: f64) -> Vec<Corners> {
        let nodes = self.nodes(time_s);
        let world = |node: usize| nodes.iter().find(|n| n.0 == node).expect("a joint of the scene").1;
        let mut out = Vec::new();
        for (node, node_world) in &nodes {
            let json = &self.json["nodes"][*node];
            let Some(mesh) = json.get("mesh") else { continue };
            let mesh = &self.json["meshes"][number(mesh)];
            for primitive in list(&mesh["primitives"]) {
                let attributes = &primitive["attributes"];
                if primitive["mode"].as_u64().is_some_and(|mode| mode != 4) {
                    continue;
                }
                let targets = list(&primitive["targets"]);
                let rest = json
                    .get("weights")
                    .or(mesh.get("weights"))
                    .map(|w| list(w).iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>());
                let weights = self
                    .animated(*node, "weights", time_s, targets.len())
                    .or(rest)
                    .unwrap_or_else(|| vec![0.0; targets.len()]);
                let morphed = |name: &str| {
                    let mut base: Vec<DVec3> =
                        self.accessor(&attributes[name]).iter().map(|v| DVec3::from_slice(&v[..3])).collect();
                    for (target, weight) in
                        targets.iter().zip(&weights).filter(|(t, _)| t.get(name).is_some())
                    {
                        for (sum, d) in base.iter_mut().zip(self.accessor(&target[name])) {
                            *sum += *weight * DVec3::from_slice(&d);
                        }
                    }
                    base
                };
                let positions = morphed("POSITION");
                let normals = attributes.get("NORMAL").map(|_| morphed("NORMAL"));
                let skin = json.get("skin").filter(|_| attributes.get("JOINTS_0").is_some());
                let matrices = match skin {
                    None => vec![*node_world; positions.len()],
                    Some(skin) => {
                        let skin = &self.json["skins"][number(skin)];
                        let bind = skin.get("inverseBindMatrices").map(|a| self.accessor(a));
                        let joints: Vec<DMat4> = (list(&skin["joints"]).iter().enumerate())
                            .map(|(k, joint)| {
                                let bind =
                                    bind.as_ref().map_or(DMat4::IDENTITY, |b| DMat4::from_cols_slice(&b[k]));
                                world(number(joint)) * bind
                            })
                            .collect();
                        let mut sums = vec![(DMat4::ZERO, 0.0); positions.len()];
                        for set in 0.. {
                            let (ids, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
                            let Some(ids) = attributes.get(&ids) else { break };
                            let (ids, weights) = (self.accessor(ids), self.accessor(&attributes[&weights]));
                            for (sum, (ids, weights)) in sums.iter_mut().zip(ids.iter().zip(&weights)) {
                                for (id, weight) in ids.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
                                    *sum = (sum.0 + *weight * joints[*id as usize], sum.1 + weight);
                                }
                            }
                        }
                        let one = |(sum, total): &(DMat4, f64)| {
                            if *total > 0.0 { *sum * (1.0 / total) } else { joints[0] }
                        };
                        sums.iter().map(one).collect()
                    }
                };
                let corners: Vec<usize> = match primitive.get("indices") {
                    Some(indices) => self.accessor(indices).iter().map(|i| i[0] as usize).collect(),
                    None => (0..positions.len()).collect(),
                };
                let corner = |&k: &usize| {
                    let position = (matrices[k] * DVec4::from((positions[k], 1.0))).truncate();
                    let turn = DMat3::from_mat4(matrices[k]);
                    // Where a matrix all but flattens, rounding of what comes in decides where normals go.
                    let volume = turn.determinant().abs();
                    let longest = [turn.x_axis, turn.y_axis, turn.z_axis]
                        .map(|v| v.length())
                        .into_iter()
                        .fold(0.0, f64::max);
                    let normal = normals.as_ref().map(|n| n[k]).filter(|n| n.length() > 0.3);
                    let normal = normal.filter(|_| volume > 0.05 * longest.powi(3));
                    (position, normal.map(|n| (turn.inverse().transpose() * n).normalize()))
                };
                out.push(corners[..corners.len() / 3 * 3].iter().map(corner).collect());
            }
        }
        out
    }
}

/// Every sample of the scenes folder that has animations, skins or morph targets, and that this program loads.
fn moving_samples() -> Option<Vec<PathBuf>> {
    let root = afterlight_testkit::shared_scenes()?.join("samples");
    let mut stack = vec![root];
    let mut out = Vec::new();
    while let Some(folder) = stack.pop() {
        for path in std::fs::read_dir(&folder).expect("a folder").map(|entry| entry.expect("an entry").path())
        {
            if path.is_dir() {
                // Broken files and those made for one fault of a reader have tests of their own.
                if !path.ends_with("invalid") && !path.ends_with("field") {
                    stack.push(path);
                }
            } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
                let bytes = std::fs::read(&path).expect("a sample");
                let has = |word: &str| bytes.windows(word.len()).any(|w| w == word.as_bytes());
                let moves = has("\"animations\"") || has("\"skins\"") || has("\"targets\"");
                // What the test's own reader cannot: compressed views, and instances of an extension.
                if moves && !has("meshopt_compression") && !has("draco") && !has("EXT_mesh_gpu_instancing") {
                    out.push(path);
                }
            }
        }
    }
    out.sort();
    Some(out)
}

/// Times that fall on no key, the last one after the animation's end, so that it has begun again.
const PARTS: [f64; 5] = [0.0013, 0.137, 0.371, 0.7093, 1.911];

#[test]
fn every_sample_that_moves_is_where_its_file_says() {
    let Some(samples) = moving_samples() else { return };
    let mut count = [0; 3];
    for file in samples {
        let Ok(mut scene) = load(&file, &LoadOptions::default()) else { continue };
        let document = Document::read(&file);
        let duration_s = document.duration_s();
        count[0] += 1;
        count[1] += usize::from(!scene.skins.is_empty());
        count[2] += usize::from(!scene.rest_weights.is_empty());
        for part in PARTS {
            let time_s = part * duration_s;
            let local_s = if duration_s > 0.0 { time_s % duration_s } else { 0.0 };
            compare(&file, &mut scene, &document, time_s, local_s);
        }
    }
    assert!(count[0] >= 30 && count[1] >= 10 && count[2] >= 8, "found {count:?} samples");
}

/// A triangle put together by code, held by two joints; where it lies, and what blends of matrices do to its frame, is known.
#[test]
fn frames_turn_as_is_known() {
    let corner = VertexAttributes::pack(Vec3::Z, Vec3::X, 1.0, Vec2::ZERO, Vec2::ZERO, [1.0; 4]);
    let half = Influences { joints: [0, 1, 0, 0], weights: [0.5, 0.5, 0.0, 0.0] };
    let mut shape = Shape {
        positions_os: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        frames_os: vec![[corner.normal_os_oct, corner.tangent_os_oct]; 3],
        set_count: 1,
        influences: vec![half; 3],
        targets: [MorphTarget::new(vec![[0.0, 0.0, 2.0]; 3], vec![[1.0, 0.0, 0.0]; 3], Vec::new())].into(),
        ..Shape::default()
    };
    shape.find_bounds();
    let mesh = Mesh {
        name: "triangle".to_owned(),
        first_index: 0,
        index_count: 3,
        first_vertex: 0,
        vertex_count: 3,
        material: 0,
        bounds_os: shape.bounds_os,
    };
    let node = Node { name: String::new(), parent: None, local: DAffine3::IDENTITY };
    let skin =
        Skin { name: "two".to_owned(), joints: vec![0, 0], joint_from_bind: vec![Affine3A::IDENTITY; 2] };
    let deformation = Deformation {
        mesh: 0,
        shape: 0,
        object_node: 0,
        weights_node: 0,
        skin: Some(0),
        first_joint: 0,
        first_weight: 0,
    };
    let scene = Scene {
        positions_os: shape.positions_os.clone(),
        attributes: vec![corner; 3],
        indices: vec![0, 1, 2],
        meshes: vec![mesh],
        nodes: vec![node],
        instances: vec![Instance {
            mesh: 0,
            node: 0,
            world_from_object: Affine3A::from_translation(Vec3::X),
        }],
        skins: vec![skin],
        shapes: vec![shape],
        deformations: vec![deformation],
        rest_weights: vec![0.0],
        ..Scene::default()
    };
    let scaled = |x: f32, y: f32, z: f32| Affine3A::from_scale(Vec3::new(x, y, z));
    // Joints, weight of the target; position of the second corner in world space, normal, sign of the bitangent.
    for (joints, weight, position, normal, handedness) in [
        ([scaled(1.0, 1.0, 1.0); 2], 0.0, [2.0, 0.0, 0.0], [0.0, 0.0, 1.0], 1.0),
        // Morphed first, then moved: the target's 2 m are 4.
        ([scaled(1.0, 1.0, 2.0); 2], 1.0, [2.0, 0.0, 4.0], [2.0, 0.0, 1.0], 1.0),
        // The mean of a scale of 4 and none along X: normals lean the other way.
        ([scaled(4.0, 1.0, 1.0), scaled(0.0, 1.0, 1.0)], 1.0, [3.0, 0.0, 2.0], [0.5, 0.0, 1.0], 1.0),
        // A mirror.
        ([scaled(-1.0, 1.0, 1.0); 2], 0.0, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], -1.0),
        // Two opposite joints leave nothing of one axis: the cofactors still tell the normal.
        ([scaled(1.0, 1.0, 1.0), scaled(1.0, 1.0, -1.0)], 0.0, [2.0, 0.0, 0.0], [0.0, 0.0, 1.0], 1.0),
    ] {
        let mut pose = scene.pose_at(0.0);
        (pose.object_from_bind, pose.weights) = (joints.to_vec(), vec![weight]);
        let found = posed_vertices_ws(&scene, &pose, 0)[1];
        let normal = DVec3::from_array(normal).normalize();
        assert!(
            (found.position - DVec3::from_array(position)).length() < 1e-9,
            "{joints:?}: {}",
            found.position
        );
        assert!((found.normal - normal).length() < 1e-4, "{joints:?}: {}, expected {normal}", found.normal);
        assert_eq!(found.handedness, handedness, "{joints:?}");
        let mut own = scene.clone();
        own.take_pose(&pose);
        let (tangent, sign) = own.attributes[1].tangent_os();
        assert!((own.attributes[1].normal_os().as_dvec3() - normal).length() < 2e-4, "{joints:?}");
        assert!(
            (tangent.as_dvec3() - found.tangent).length() < 3e-4 && f64::from(sign) == handedness,
            "{joints:?}: {tangent}"
        );
        let bounds = scene.bounds_in_pose(&pose, 0);
        let p = found.position.as_vec3();
        assert!(p.cmpge(bounds.min).all() && p.cmple(bounds.max).all(), "{p} {bounds:?}");
    }
}

/// A scene whose twin forgets something is seen to be off, in every sample that has it.
#[test]
fn what_is_forgotten_shows() {
    let Some(samples) = moving_samples() else { return };
    let mut count = [0; 3];
    for file in samples {
        let Ok(scene) = load(&file, &LoadOptions::default()) else { continue };
        let document = Document::read(&file);
        let time_s = 0.371 * document.duration_s();
        let expected = document.draws(time_s);
        let pose = scene.pose_at(time_s);
        let is_off = |scene: &Scene, pose: &Pose| {
            let size_m = size_m(&expected);
            let off_m = (0..expected.len()).map(|k| off_m(scene, pose, k, &expected[k])).fold(0.0, f64::max);
            off_m > BOUND * size_m
        };
        assert!(!is_off(&scene, &pose), "{}", file.display());
        let binds = scene.skins.iter().flat_map(|skin| &skin.joint_from_bind);
        if binds.clone().any(|m| !m.abs_diff_eq(Affine3A::IDENTITY, 0.01)) {
            let mut forgetful = scene.clone();
            forgetful.skins.iter_mut().for_each(|skin| skin.joint_from_bind.fill(Affine3A::IDENTITY));
            assert!(
                is_off(&forgetful, &forgetful.pose_at(time_s)),
                "{}: inverse bind matrices",
                file.display()
            );
            count[0] += 1;
        }
        if pose.weights.iter().any(|weight| *weight > 0.05) {
            let mut still = pose.clone();
            still.weights.fill(0.0);
            assert!(is_off(&scene, &still), "{}: weights of morph targets", file.display());
            count[1] += 1;
        }
        // The pose of a frame before.
        let before = scene.pose_at(0.9 * time_s).object_from_bind;
        let joints = pose.object_from_bind.iter().zip(&before);
        if joints.into_iter().any(|(a, b)| !a.abs_diff_eq(*b, 0.01 * a.translation.length().max(1.0))) {
            let mut late = pose.clone();
            late.object_from_bind = before;
            assert!(is_off(&scene, &late), "{}: joints", file.display());
            count[2] += 1;
        }
    }
    assert!(count.iter().all(|&n| n >= 3), "found {count:?} samples");
}

/// Distance that is allowed, as a fraction of the extent of what is drawn.
const BOUND: f64 = 1e-5;

/// What is drawn, as [`Document::draws`] gives it.
type Corners = Vec<(DVec3, Option<DVec3>)>;

/// Extent of what is drawn, metres. Where it stands far from the origin, 32 bits of its places are what there is.
fn size_m(expected: &[Corners]) -> f64 {
    let all = expected.iter().flatten().map(|corner| corner.0);
    let (min, max) = all.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |b, p| (b.0.min(p), b.1.max(p)));
    (max - min).max_element().max(0.1 * min.abs().max(max.abs()).max_element())
}

/// The greatest distance of an instance's corners in a pose to where they are to be, metres.
fn off_m(scene: &Scene, pose: &Pose, instance: usize, expected: &[(DVec3, Option<DVec3>)]) -> f64 {
    let mesh = &scene.meshes[scene.instances[instance].mesh as usize];
    let found = posed_vertices_ws(scene, pose, instance);
    let indices = &scene.indices[mesh.first_index as usize..(mesh.first_index + mesh.index_count) as usize];
    let off = |(&k, (position, _)): (&u32, &(DVec3, Option<DVec3>))| {
        (found[k as usize].position + scene.origin_file - *position).length()
    };
    indices.iter().zip(expected).map(off).fold(0.0, f64::max)
}

fn compare(file: &Path, scene: &mut Scene, document: &Document, time_s: f64, local_s: f64) {
    let at = |text: &str| format!("{} at {time_s} s: {text}", file.display());
    let pose = scene.pose_at(time_s);
    let expected = document.draws(local_s);
    assert_eq!(expected.len(), scene.instances.len(), "{}", at("draws"));
    let size_m = size_m(&expected);
    for (instance, expected) in expected.iter().enumerate() {
        let mesh = &scene.meshes[scene.instances[instance].mesh as usize];
        let indices =
            &scene.indices[mesh.first_index as usize..(mesh.first_index + mesh.index_count) as usize];
        assert_eq!(indices.len(), expected.len(), "{}", at("corners"));
        let found = posed_vertices_ws(scene, &pose, instance);
        let bounds = scene.bounds_in_pose(&pose, instance);
        for (&index, (position, normal)) in indices.iter().zip(expected) {
            let v = &found[index as usize];
            let off_m = (v.position + scene.origin_file - *position).length();
            assert!(
                off_m <= BOUND * size_m,
                "{}",
                at(&format!("draw {instance} is off by {off_m} of {size_m} m"))
            );
            if let Some(normal) = normal {
                // Vertices keep their normals in 2 × 16 bits.
                let off = (v.normal - *normal).length();
                assert!(
                    off < 2e-3,
                    "{}",
                    at(&format!("draw {instance}, a normal is off by {off}: {normal} {}", v.normal))
                );
            }
            let p = v.position.as_vec3();
            let slack = 1e-6 * size_m as f32;
            assert!(
                p.cmpge(bounds.min - slack).all() && p.cmple(bounds.max + slack).all(),
                "{}",
                at(&format!("draw {instance}: {p} is out of its bounds {bounds:?}"))
            );
        }
    }
    // What the scene itself writes for a pose is what the twin says.
    let posed: Vec<_> = (0..scene.instances.len()).map(|k| posed_vertices(scene, &pose, k)).collect();
    scene.take_pose(&pose);
    for (instance, posed) in posed.iter().enumerate() {
        let mesh = &scene.meshes[scene.instances[instance].mesh as usize];
        for (k, v) in posed.iter().enumerate() {
            let vertex = mesh.first_vertex as usize + k;
            let off_m = (DVec3::from(scene.positions_os[vertex].map(f64::from)) - v.position).length();
            assert!(
                off_m <= 1e-6 * v.position.length().max(1e-3),
                "{}",
                at(&format!("vertex {k} is off by {off_m} m"))
            );
            let normal = scene.attributes[vertex].normal_os().as_dvec3();
            let off = (normal - v.normal).length();
            assert!(v.normal == DVec3::ZERO || off < 1e-4, "{}", at(&format!("normal {k} is off by {off}")));
        }
    }
    let cameras = document
        .nodes(local_s)
        .into_iter()
        .filter(|(node, _)| document.json["nodes"][*node].get("camera").is_some());
    for ((_, world), camera) in cameras.zip(&pose.cameras) {
        let off_m = (scene.file_from_world(camera.eye_ws()) - world.w_axis.truncate()).length();
        assert!(off_m < BOUND * size_m.max(1.0), "{}", at(&format!("a camera is off by {off_m} m")));
        let back = world.z_axis.truncate().normalize();
        let off = (camera.world_from_view.matrix3.z_axis.as_dvec3() - back).length();
        assert!(off < 1e-5, "{}", at(&format!("a camera looks elsewhere, by {off}")));
    }
}
