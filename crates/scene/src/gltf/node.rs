//! Nodes, and what hangs on them: draws, lights, cameras, skins.

use std::{collections::HashMap, path::Path};

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
use crate::{Camera, Instance, Light, LightKind, Node, Projection, Scene, SceneError, animation};

/// Most nodes and most draws of a scene: instancing lets a short file ask for many.
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

/// Finds what is drawn where. Skinned meshes are drawn by a node of their own at the world's
/// origin, instanced ones (EXT_mesh_gpu_instancing) by a child node for each instance.
pub(super) fn find_draws(
    accessors: &Accessors,
    root: &Root,
    placement: &Placement,
    scene: &mut Scene,
) -> Result<Draws, SceneError> {
    let rest_worlds = scene.file_from_nodes(None);
    let mut plain: HashMap<usize, usize> = HashMap::new();
    let mut variants = Vec::new();
    let mut draws = Vec::new();
    for &index in &placement.order {
        let node = &root.nodes[index];
        let (Some(mesh), Some(place)) = (node.mesh, placement.scene_node[index]) else { continue };
        let json = &root.meshes[mesh.value()];
        let has_targets = json.primitives.iter().any(|p| p.targets.as_ref().is_some_and(|t| !t.is_empty()));
        let weights = if has_targets { node.weights.as_ref().or(json.weights.as_ref()) } else { None };
        if has_targets {
            scene
                .warnings
                .push(format!("nodes[{index}]: morph targets are drawn with their weights at rest"));
        }
        let skinned =
            json.primitives.iter().any(|p| p.attributes.contains_key(&Checked::Valid(Semantic::Joints(0))));
        let skin = node.skin.filter(|_| skinned);
        let mut variant =
            Variant { mesh: mesh.value(), weights: weights.cloned().unwrap_or_default(), joints: Vec::new() };
        let mut draw_node = place;
        if let Some(skin) = skin {
            scene.warnings.push(format!("nodes[{index}]: its skin is drawn in the rest pose"));
            let skin = (skin.value(), skin_origin(root, placement, &rest_worlds, skin.value()));
            variant.joints = joint_matrices(accessors, root, placement, &rest_worlds, skin)?;
            draw_node = scene.nodes.len() as u32;
            let name = format!("{} (skinned)", scene.nodes[place as usize].name);
            scene.nodes.push(Node { name, parent: None, local: DAffine3::from_translation(skin.1) });
        }
        let own_shape = skin.is_some() || node.weights.is_some() && has_targets;
        let variant = if own_shape {
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
                check_count(accessors.file, scene.nodes.len() + instances.len())?;
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

fn check_count(file: &Path, count: usize) -> Result<(), SceneError> {
    if count as u64 > INSTANCE_COUNT_MAX {
        let what = "nodes and draws".to_owned();
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

/// The skin's origin from bind space for each joint of a skin, at rest.
fn joint_matrices(
    accessors: &Accessors,
    root: &Root,
    placement: &Placement,
    worlds: &[DAffine3],
    (index, origin): (usize, DVec3),
) -> Result<Vec<Mat4>, SceneError> {
    let skin = &root.skins[index];
    let bind = match skin.inverse_bind_matrices {
        None => vec![Mat4::IDENTITY.to_cols_array(); skin.joints.len()],
        Some(accessor) => accessors.floats::<16>(accessor.value(), 16, 0.0)?,
    };
    if skin.joints.is_empty() {
        return Err(SceneError::invalid(
            accessors.file,
            format!("skins[{index}].joints"),
            "none",
            "1 or more",
        ));
    }
    let joints = skin.joints.iter().zip(bind).enumerate();
    joints
        .map(|(k, (joint, bind))| match placement.scene_node[joint.value()] {
            Some(node) => {
                let world = DMat4::from_translation(-origin) * DMat4::from(worlds[node as usize]);
                Ok((world * Mat4::from_cols_array(&bind).as_dmat4()).as_mat4())
            }
            None => Err(SceneError::invalid(
                accessors.file,
                format!("skins[{index}].joints[{k}]"),
                format!("node {}", joint.value()),
                "a node of the scene that is drawn",
            )),
        })
        .collect()
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
    check_count(file, count)?;
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
    let file_from_nodes = scene.file_from_nodes(time_s);
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
        check_count(file, scene.instances.len() + meshes[draw.variant].len())?;
        let instance = |mesh| Instance { mesh, node: draw.node, world_from_object: world };
        scene.instances.extend(meshes[draw.variant].clone().map(instance));
        worlds.resize(scene.instances.len(), file_from_object);
    }
    scene.settle(&worlds);
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
    for &index in &placement.order {
        let node = &root.nodes[index];
        let Some(place) = placement.scene_node[index] else { continue };
        let world = worlds[place as usize];
        if let Some(l) = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) {
            let direction_ws = world.transform_vector3(Vec3::NEG_Z).try_normalize().unwrap_or(Vec3::NEG_Y);
            let position_ws = world.translation.into();
            scene.lights.push(Light { position_ws, direction_ws, ..lights[l.light.value()] });
        }
        if let Some(c) = node.camera {
            let json = &root.cameras[c.value()];
            let name =
                json.name.clone().or(node.name.clone()).unwrap_or_else(|| format!("camera {}", c.value()));
            match rigid(&world) {
                Some(world_from_view) => {
                    let projection = projection(file, c.value(), json)?;
                    scene.cameras.push(Camera { name, world_from_view, projection });
                }
                None => scene.warnings.push(format!("camera {name:?} has no orientation and is left out")),
            }
        }
    }
    Ok(())
}

/// Position and orientation of a frame without its scale; the view direction −Z is kept.
fn rigid(world: &Affine3A) -> Option<Affine3A> {
    let z = Vec3::from(world.matrix3.z_axis).try_normalize()?;
    let x = Vec3::from(world.matrix3.y_axis).cross(z).try_normalize()?;
    let frame = Affine3A::from_cols(x.into(), z.cross(x).into(), z.into(), world.translation);
    frame.is_finite().then_some(frame)
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
        assert!(check_count(file, 1 << 22).is_ok());
        let error = check_count(file, (1 << 22) + 1).expect_err("one more").to_string();
        assert!(error.contains("found 4194305, expected at most 4194304"), "{error}");
    }
}
