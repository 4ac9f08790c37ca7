//! Nodes, and what hangs on them: draws, lights, cameras, skins.

use std::{
    collections::{HashMap, HashSet},
    path::Path,
};

use glam::{Affine3A, DAffine3, DMat4, DQuat, DVec3, Mat4, Vec3};
use gltf::json::{
    self, Root,
    camera::Type as CameraType,
    extensions::scene::khr_lights_punctual::{Light as JsonLight, Type as LightType},
    mesh::Semantic,
    validation::Checked,
};

use serde::Deserialize;

use super::{accessor::Accessors, check, mesh::Variant};
use crate::{
    Attachment, Camera, Instance, Light, LightKind, Node, Projection, Scene, SceneError, ShapePose, Skin,
    animation, pose,
};

/// What is counted against [`INSTANCE_COUNT_MAX`], for messages.
const NODES: &str = "nodes and draws";

/// Most nodes and most draws of a scene: instancing lets a short file ask for many. So many matrices of joints and weights as well: a short
/// file can draw one mesh with many joints or targets many times.
const INSTANCE_COUNT_MAX: u64 = 1 << 22;

/// Translation, rotation and scale.
#[derive(Clone, Copy)]
pub(super) struct Trs {
    pub(super) translation: DVec3,
    pub(super) rotation: DQuat,
    pub(super) scale: DVec3,
}

impl Trs {
    fn local(&self) -> DAffine3 {
        animation::local(self.scale, self.rotation, self.translation)
    }
}

/// Transforms of the file's nodes in 64 bits: the typed document rounds them to 32.
#[derive(Default)]
pub(super) struct Places {
    /// A place a node; none where no node is far from its parent.
    nodes: Vec<Place>,
}

#[derive(Clone, Copy, Default, Deserialize)]
struct Place {
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
    matrix: Option<[f64; 16]>,
}

impl Places {
    /// Reads them from the JSON where a node is so far from its parent that rounding would show.
    pub(super) fn read(root: &Root, json: &[u8]) -> Self {
        #[derive(Deserialize)]
        struct Nodes {
            nodes: Vec<Place>,
        }
        // Up to here 32 bits are at most 4 µm off.
        const NEAR_M: f32 = 64.0;
        let offset = |node: &json::Node| node.translation.or(node.matrix.map(|m| [m[12], m[13], m[14]]));
        let is_far = |node: &json::Node| offset(node).is_some_and(|t| t.iter().any(|v| v.abs() > NEAR_M));
        if !root.nodes.iter().any(is_far) {
            return Self::default();
        }
        // The document has been read once: what fails here fails by rules that are stricter than glTF's, and keeps 32 bits.
        serde_json::from_slice::<Nodes>(json)
            .map_or_else(|_| Self::default(), |all| Self { nodes: all.nodes })
    }

    /// The transform of a node, as exact as it is known.
    fn of(&self, root: &Root, index: usize) -> Place {
        let node = &root.nodes[index];
        self.nodes.get(index).copied().unwrap_or_else(|| Place {
            translation: node.translation.map(|t| t.map(f64::from)),
            rotation: node.rotation.map(|q| q.0.map(f64::from)),
            scale: node.scale.map(|s| s.map(f64::from)),
            matrix: node.matrix.map(|m| m.map(f64::from)),
        })
    }
}

/// Where the nodes of the file are in the scene.
pub(super) struct Placement {
    /// For each glTF node, its place in [`Scene::nodes`]; `None` outside of the scene shown.
    pub(super) scene_node: Vec<Option<u32>>,
    /// glTF nodes of the scene in the scene's order.
    pub(super) order: Vec<usize>,
    /// Translations of the glTF nodes.
    pub(super) places: Places,
}

/// One place of a mesh: the scene's node and the variant drawn there.
struct Draw {
    node: u32,
    variant: usize,
}

/// The rest pose of a node as translation, rotation and scale.
pub(super) fn rest_trs(file: &Path, root: &Root, places: &Places, index: usize) -> Result<Trs, SceneError> {
    let place = places.of(root, index);
    let trs = Trs {
        translation: place.translation.map_or(DVec3::ZERO, DVec3::from_array),
        rotation: animation::unit(place.rotation.map_or(DQuat::IDENTITY, DQuat::from_array)),
        scale: place.scale.map_or(DVec3::ONE, DVec3::from_array),
    };
    let finite = trs.translation.as_vec3().is_finite() && trs.scale.as_vec3().is_finite();
    if !(finite && trs.rotation.as_quat().is_finite()) {
        return Err(SceneError::invalid(
            file,
            format!("nodes[{index}]"),
            "a transform that overflows",
            "finite numbers",
        ));
    }
    Ok(trs)
}

fn local(file: &Path, root: &Root, places: &Places, index: usize) -> Result<DAffine3, SceneError> {
    let Some(m) = places.of(root, index).matrix else {
        return Ok(rest_trs(file, root, places, index)?.local());
    };
    let at = || format!("nodes[{index}].matrix");
    if !m.iter().all(|v| (*v as f32).is_finite()) {
        return Err(SceneError::invalid(file, at(), "numbers that overflow", "finite numbers"));
    }
    let last_row = [m[3], m[7], m[11], m[15]].map(|v| v as f32);
    if last_row != [0.0, 0.0, 0.0, 1.0] {
        let found = format!("the last row {last_row:?}");
        return Err(SceneError::invalid(file, at(), found, "0, 0, 0, 1"));
    }
    Ok(DAffine3::from_mat4(DMat4::from_cols_array(&m)))
}

/// Puts the nodes of the default scene (else the first, else all roots) into `scene`.
pub(super) fn place(
    file: &Path,
    root: &Root,
    places: Places,
    scene: &mut Scene,
) -> Result<Placement, SceneError> {
    let chosen = root.scene.map(|s| s.value()).or((!root.scenes.is_empty()).then_some(0));
    let roots: Vec<usize> = match chosen {
        Some(s) => root.scenes[s].nodes.iter().map(|n| n.value()).collect(),
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            root.nodes
                .iter()
                .flat_map(|n| n.children.iter().flatten())
                .for_each(|c| is_child[c.value()] = true);
            (0..root.nodes.len()).filter(|&n| !is_child[n]).collect()
        }
    };
    let mut placement = Placement { scene_node: vec![None; root.nodes.len()], order: Vec::new(), places };
    let mut stack: Vec<(usize, Option<u32>)> = roots.into_iter().rev().map(|n| (n, None)).collect();
    while let Some((index, parent)) = stack.pop() {
        let node = &root.nodes[index];
        let place = scene.nodes.len() as u32;
        let name = node.name.clone().unwrap_or_else(|| format!("nodes[{index}]"));
        scene.nodes.push(Node { name, parent, local: local(file, root, &placement.places, index)? });
        placement.scene_node[index] = Some(place);
        placement.order.push(index);
        stack.extend(node.children.iter().flatten().rev().map(|c| (c.value(), Some(place))));
    }
    Ok(placement)
}

/// Draws of the scene, with the variants of meshes that they need.
pub(super) struct Draws {
    pub(super) variants: Vec<Variant>,
    draws: Vec<Draw>,
}

/// Finds what is drawn where, and the skins. Skinned meshes are drawn by a node of their own at the world's
/// origin, instanced ones (EXT_mesh_gpu_instancing) by a child node for each instance.
pub(super) fn find_draws(
    accessors: &Accessors,
    root: &Root,
    placement: &Placement,
    scene: &mut Scene,
) -> Result<Draws, SceneError> {
    let rest_worlds = scene.file_from_nodes(None);
    let tracks = scene.animations.iter().flat_map(|animation| &animation.weights);
    let animated: HashSet<u32> = tracks.map(|track| track.node).collect();
    let mut plain: HashMap<usize, usize> = HashMap::new();
    let mut skins: HashMap<usize, u32> = HashMap::new();
    let mut variants: Vec<Variant> = Vec::new();
    let (mut matrix_count, mut weight_count) = (0, 0);
    let mut draws = Vec::new();
    for &index in &placement.order {
        let node = &root.nodes[index];
        let (Some(mesh), Some(place)) = (node.mesh, placement.scene_node[index]) else { continue };
        let json = &root.meshes[mesh.value()];
        let targets = |p: &json::mesh::Primitive| p.targets.as_ref().map_or(0, Vec::len);
        let target_count = json.primitives.iter().map(targets).max().unwrap_or(0);
        let mut weights = node.weights.as_ref().or(json.weights.as_ref()).cloned().unwrap_or_default();
        weights.resize(target_count, 0.0);
        let skinned =
            json.primitives.iter().any(|p| p.attributes.contains_key(&Checked::Valid(Semantic::Joints(0))));
        let skin = node.skin.filter(|_| skinned);
        let mut variant =
            Variant { mesh: mesh.value(), weights, skin: None, node: place, object_node: place };
        if let Some(skin) = skin {
            let skin = skin.value();
            let known = match skins.get(&skin) {
                Some(&known) => known,
                None => {
                    scene.skins.push(convert_skin(accessors, root, placement, skin, &mut scene.warnings)?);
                    let new = scene.skins.len() as u32 - 1;
                    skins.insert(skin, new);
                    new
                }
            };
            variant.skin = Some(known);
            variant.object_node = scene.nodes.len() as u32;
            let name = format!("{} (skinned)", scene.nodes[place as usize].name);
            let origin = skin_origin(root, placement, &rest_worlds, skin);
            scene.nodes.push(Node { name, parent: None, local: DAffine3::from_translation(origin) });
        }
        let draw_node = variant.object_node;
        if let Some(skin) = variant.skin {
            matrix_count += scene.skins[skin as usize].joints.len();
            check_count(accessors.file, "matrices of joints", matrix_count)?;
        }
        weight_count += target_count;
        check_count(accessors.file, "weights of morph targets", weight_count)?;
        // A mesh has one shape at a time: nodes that can be shaped in ways of their own have vertices of their own.
        let own_weights = target_count > 0 && (node.weights.is_some() || animated.contains(&place));
        let variant = if skin.is_some() || own_weights {
            variants.push(variant);
            variants.len() - 1
        } else {
            *plain.entry(mesh.value()).or_insert_with(|| {
                variants.push(variant);
                variants.len() - 1
            })
        };
        let instancing = node.extensions.as_ref().and_then(|e| e.others.get(INSTANCING));
        match instancing.filter(|_| skin.is_none()) {
            None => draws.push(Draw { node: draw_node, variant }),
            Some(extension) => {
                let at = format!("nodes[{index}].extensions.{INSTANCING}");
                let instances = instance_transforms(accessors, &at, extension)?;
                let name = scene.nodes[place as usize].name.clone();
                check_count(accessors.file, NODES, scene.nodes.len() + instances.len())?;
                for (k, trs) in instances.into_iter().enumerate() {
                    let node = scene.nodes.len() as u32;
                    scene.nodes.push(Node {
                        name: format!("{name}[{k}]"),
                        parent: Some(place),
                        local: trs.local(),
                    });
                    draws.push(Draw { node, variant });
                }
            }
        }
    }
    Ok(Draws { variants, draws })
}

const INSTANCING: &str = "EXT_mesh_gpu_instancing";

fn check_count(file: &Path, what: &str, count: usize) -> Result<(), SceneError> {
    if count as u64 > INSTANCE_COUNT_MAX {
        let what = what.to_owned();
        return Err(SceneError::TooLarge {
            file: file.to_owned(),
            what,
            found: count as u64,
            limit: INSTANCE_COUNT_MAX,
        });
    }
    Ok(())
}

/// Origin of the vertices of a skin, which are put into their place on loading: beside its first joint.
fn skin_origin(root: &Root, placement: &Placement, worlds: &[DAffine3], skin: usize) -> DVec3 {
    let joint = root.skins[skin].joints.first().and_then(|joint| placement.scene_node[joint.value()]);
    joint.map_or(DVec3::ZERO, |node| {
        let place = worlds[node as usize].translation;
        crate::origin::origin_of(place - 1.0, place + 1.0)
    })
}

/// A skin with its joints among the nodes of the scene.
fn convert_skin(
    accessors: &Accessors,
    root: &Root,
    placement: &Placement,
    index: usize,
    warnings: &mut Vec<String>,
) -> Result<Skin, SceneError> {
    let skin = &root.skins[index];
    let at = |rest: &str| format!("skins[{index}]{rest}");
    if skin.joints.is_empty() {
        return Err(SceneError::invalid(accessors.file, at(".joints"), "none", "1 or more"));
    }
    let joint = |(k, joint): (usize, &json::Index<json::Node>)| {
        placement.scene_node[joint.value()].ok_or_else(|| {
            let found = format!("node {}", joint.value());
            let expected = "a node of the scene that is drawn";
            SceneError::invalid(accessors.file, at(&format!(".joints[{k}]")), found, expected)
        })
    };
    let joints = skin.joints.iter().enumerate().map(joint).collect::<Result<Vec<_>, _>>()?;
    let mut joint_from_bind = vec![Affine3A::IDENTITY; joints.len()];
    if let Some(accessor) = skin.inverse_bind_matrices {
        let mut is_affine = true;
        for (own, m) in joint_from_bind.iter_mut().zip(accessors.floats::<16>(accessor.value(), 16, 0.0)?) {
            is_affine &= [m[3], m[7], m[11], m[15]] == [0.0, 0.0, 0.0, 1.0];
            *own = Affine3A::from_mat4(Mat4::from_cols_array(&m));
        }
        if !is_affine {
            warnings.push(format!(
                "{}: last rows other than 0, 0, 0, 1 are not used",
                at(".inverseBindMatrices")
            ));
        }
    }
    Ok(Skin { name: skin.name.clone().unwrap_or_else(|| at("")), joints, joint_from_bind })
}

fn instance_transforms(
    accessors: &Accessors,
    at: &str,
    extension: &json::Value,
) -> Result<Vec<Trs>, SceneError> {
    let file = accessors.file;
    let attribute = |name: &str| -> Result<Option<usize>, SceneError> {
        let Some(value) = extension.get("attributes").and_then(|a| a.get(name)) else { return Ok(None) };
        let at = format!("{at}.attributes.{name}");
        let index = value
            .as_u64()
            .ok_or_else(|| SceneError::invalid(file, &at, value.to_string(), "an accessor's index"))?;
        let index = usize::try_from(index).unwrap_or(usize::MAX);
        if index >= accessors.layouts.len() {
            return Err(check::unresolved(file, at, index, accessors.layouts.len()));
        }
        Ok(Some(index))
    };
    let (t, r, s) = (attribute("TRANSLATION")?, attribute("ROTATION")?, attribute("SCALE")?);
    let counts: Vec<usize> = [t, r, s].into_iter().flatten().map(|a| accessors.layouts[a].count).collect();
    let Some(&count) = counts.first() else { return Ok(Vec::new()) };
    if counts.iter().any(|&c| c != count) {
        return Err(SceneError::invalid(
            file,
            at,
            format!("attributes of {counts:?} elements"),
            "as many in each",
        ));
    }
    check_count(file, NODES, count)?;
    let vec3 = |a: Option<usize>, rest: f32| {
        a.map_or(Ok(vec![[rest; 3]; count]), |a| accessors.floats::<3>(a, 3, 0.0))
    };
    let translations = vec3(t, 0.0)?;
    let scales = vec3(s, 1.0)?;
    let rotations = r.map_or(Ok(vec![[0.0, 0.0, 0.0, 1.0]; count]), |a| accessors.floats::<4>(a, 4, 0.0))?;
    Ok((0..count)
        .map(|k| Trs {
            translation: DVec3::from_array(translations[k].map(f64::from)),
            rotation: DQuat::from_array(rotations[k].map(f64::from)),
            scale: DVec3::from_array(scales[k].map(f64::from)),
        })
        .collect())
}

/// Makes the instances: each mesh of a variant at each of its draws, as nodes are at a time; and chooses the scene's origin.
pub(super) fn make_instances(
    file: &Path,
    draws: &Draws,
    meshes: &[std::ops::Range<u32>],
    time_s: Option<f64>,
    scene: &mut Scene,
) -> Result<(), SceneError> {
    let playing = time_s.and_then(|time_s| scene.animations.first().map(|a| (a, a.wrap(time_s))));
    let (mut file_from_nodes, mut joints, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    scene.file_from_nodes_into(playing, &mut file_from_nodes);
    scene.joints_into(&file_from_nodes, &mut joints);
    scene.weights_into(playing, &mut weights);
    if let Some((mesh, vertex)) = scene.write_deformed(&joints, &weights) {
        let at = format!("mesh {:?} vertex {vertex}", scene.meshes[mesh as usize].name);
        let expected = "finite numbers after morphing and skinning";
        return Err(SceneError::invalid(file, at, "a place that overflows", expected));
    }
    let mut worlds = Vec::with_capacity(draws.draws.len());
    for draw in &draws.draws {
        let file_from_object = file_from_nodes[draw.node as usize];
        let world = file_from_object.as_affine3a();
        if !world.is_finite() {
            let at = format!("node {:?}", scene.nodes[draw.node as usize].name);
            return Err(SceneError::invalid(
                file,
                at,
                "a place in the world that overflows",
                "finite numbers",
            ));
        }
        check_count(file, NODES, scene.instances.len() + meshes[draw.variant].len())?;
        let instance = |mesh| Instance { mesh, node: draw.node, world_from_object: world };
        scene.instances.extend(meshes[draw.variant].clone().map(instance));
        worlds.resize(scene.instances.len(), file_from_object);
    }
    scene.settle(&worlds);
    if !scene.deformations.is_empty() {
        // Meshes that have moved in their node's space have their joints seen from another place.
        let playing = time_s.and_then(|time_s| scene.animations.first().map(|a| (a, a.wrap(time_s))));
        scene.file_from_nodes_into(playing, &mut file_from_nodes);
        scene.joints_into(&file_from_nodes, &mut joints);
        scene.shaped = ShapePose { object_from_bind: joints, weights };
    }
    Ok(())
}

/// Makes the lights and cameras of the scene's nodes.
pub(super) fn make_lights_and_cameras(
    file: &Path,
    root: &Root,
    placement: &Placement,
    worlds: &[Affine3A],
    scene: &mut Scene,
) -> Result<(), SceneError> {
    for (i, camera) in root.cameras.iter().enumerate() {
        projection(file, i, camera)?;
    }
    let lights =
        root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()).map_or(&[][..], |l| &l.lights);
    let lights = lights.iter().enumerate().map(|(i, l)| light(file, i, l)).collect::<Result<Vec<_>, _>>()?;
    let is_animated = !scene.animations.is_empty();
    for &index in &placement.order {
        let node = &root.nodes[index];
        let Some(place) = placement.scene_node[index] else { continue };
        let world = worlds[place as usize];
        if let Some(l) = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) {
            if is_animated {
                scene.light_nodes.push(Attachment { index: scene.lights.len() as u32, node: place });
            }
            scene.lights.push(pose::placed(&lights[l.light.value()], &world));
        }
        if let Some(c) = node.camera {
            let json = &root.cameras[c.value()];
            let name =
                json.name.clone().or(node.name.clone()).unwrap_or_else(|| format!("camera {}", c.value()));
            match pose::rigid(&world) {
                Some(world_from_view) => {
                    let projection = projection(file, c.value(), json)?;
                    if is_animated {
                        scene
                            .camera_nodes
                            .push(Attachment { index: scene.cameras.len() as u32, node: place });
                    }
                    scene.cameras.push(Camera { name: name.into(), world_from_view, projection });
                }
                None => scene.warnings.push(format!("camera {name:?} has no orientation and is left out")),
            }
        }
    }
    Ok(())
}

fn projection(file: &Path, index: usize, camera: &json::Camera) -> Result<Projection, SceneError> {
    let wrong = |found: String, expected: &str| {
        SceneError::invalid(file, format!("cameras[{index}]"), found, expected)
    };
    match (&camera.type_, &camera.perspective, &camera.orthographic) {
        (Checked::Valid(CameraType::Perspective), Some(p), None) => {
            let far_is_right = p.zfar.is_none_or(|f| f > p.znear);
            if !(p.yfov > 0.0
                && p.yfov < std::f32::consts::PI
                && p.znear > 0.0
                && p.znear.is_finite()
                && far_is_right)
            {
                let found = format!("yfov {}, znear {}, zfar {:?}", p.yfov, p.znear, p.zfar);
                return Err(wrong(found, "0 < yfov < π and 0 < znear < zfar"));
            }
            Ok(Projection::Perspective { fov_y_rad: p.yfov, near_m: p.znear })
        }
        (Checked::Valid(CameraType::Orthographic), None, Some(o)) => {
            let sizes = [o.xmag, o.ymag, o.znear, o.zfar];
            if !(sizes.iter().all(|v| v.is_finite())
                && o.xmag != 0.0
                && o.ymag != 0.0
                && o.znear >= 0.0
                && o.zfar > o.znear)
            {
                let found = format!("xmag {}, ymag {}, znear {}, zfar {}", o.xmag, o.ymag, o.znear, o.zfar);
                return Err(wrong(found, "sizes other than 0 and 0 ≤ znear < zfar"));
            }
            Ok(Projection::Orthographic { half_height_m: o.ymag.abs(), near_m: o.znear, far_m: o.zfar })
        }
        _ => Err(wrong(
            "properties that do not fit its type".into(),
            "perspective or orthographic, as its type says",
        )),
    }
}

/// A light at the origin; node transforms are applied by the caller.
fn light(file: &Path, index: usize, json: &JsonLight) -> Result<Light, SceneError> {
    let at = format!("extensions.KHR_lights_punctual.lights[{index}]");
    let kind = match (&json.type_, &json.spot) {
        (Checked::Valid(LightType::Point), _) => LightKind::Point,
        (Checked::Valid(LightType::Directional), _) => LightKind::Directional,
        (Checked::Valid(LightType::Spot), Some(spot)) => {
            let (inner_angle_rad, outer_angle_rad) = (spot.inner_cone_angle, spot.outer_cone_angle);
            let right = 0.0 <= inner_angle_rad
                && inner_angle_rad < outer_angle_rad
                && outer_angle_rad <= std::f32::consts::FRAC_PI_2 + 1e-6;
            if !right {
                let found = format!("inner {inner_angle_rad}, outer {outer_angle_rad}");
                return Err(SceneError::invalid(
                    file,
                    format!("{at}.spot"),
                    found,
                    "0 ≤ inner < outer ≤ π/2",
                ));
            }
            LightKind::Spot { inner_angle_rad, outer_angle_rad }
        }
        (Checked::Valid(LightType::Spot), None) => {
            return Err(SceneError::invalid(file, at, "a spot light without spot", "its cone"));
        }
        (Checked::Invalid, _) => {
            return Err(SceneError::invalid(
                file,
                format!("{at}.type"),
                "an unknown name",
                "directional, point or spot",
            ));
        }
    };
    let intensity = Vec3::from(json.color) * json.intensity;
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return Err(SceneError::invalid(
            file,
            at,
            format!("colour × intensity {intensity}"),
            "finite, 0 or more",
        ));
    }
    if let Some(range) = json.range.filter(|r| !(r.is_finite() && *r > 0.0)) {
        return Err(SceneError::invalid(file, format!("{at}.range"), range.to_string(), "more than 0"));
    }
    let range_m = json.range.unwrap_or(f32::INFINITY);
    Ok(Light { kind, position_ws: Vec3::ZERO, direction_ws: Vec3::NEG_Z, intensity, range_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_has_at_most_4_million_nodes_and_draws() {
        let file = Path::new("test.gltf");
        assert!(check_count(file, NODES, 1 << 22).is_ok());
        let error = check_count(file, NODES, (1 << 22) + 1).expect_err("one more").to_string();
        assert!(error.contains("found 4194305, expected at most 4194304"), "{error}");
    }
}
