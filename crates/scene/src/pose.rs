//! A scene at a moment: what moves, in a form that is refilled frame by frame without allocating.

use glam::{Affine3A, DAffine3, Vec3};

use crate::{Aabb, Camera, Light, Scene};

/// When a scene is posed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Moment {
    /// As the file has its nodes, without an animation.
    #[default]
    Rest,
    /// While an animation plays.
    Playing {
        /// Index into [`Scene::animations`]; where there is none of that number, the scene rests.
        animation: usize,
        /// Time of the clock, seconds; wraps around at the animation's end.
        time_s: f64,
    },
}

impl Moment {
    /// The first animation at a time of the clock, seconds.
    pub fn at(time_s: f64) -> Self {
        Self::Playing { animation: 0, time_s }
    }
}

/// What moves in a scene, at one moment. All lists have the order of the scene's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Object to world for each of [`Scene::instances`].
    pub world_from_object: Vec<Affine3A>,
    /// Object space of the mesh from the space of its shape, for each joint of the skins in use:
    /// [`Deformation::joints`](crate::Deformation::joints) are a mesh's. That the node of a skinned mesh does not move it is in them.
    pub object_from_bind: Vec<Affine3A>,
    /// Weights of morph targets: [`Deformation::weights`](crate::Deformation::weights) are a mesh's.
    pub weights: Vec<f32>,
    /// Cameras. One whose node has lost its orientation, as by a scale of 0, stays as it was loaded.
    pub cameras: Vec<Camera>,
    /// Lights of the file.
    pub lights: Vec<Light>,
    /// The file's space from node, for each of [`Scene::nodes`].
    file_from_nodes: Vec<DAffine3>,
}

/// A camera or a light of the scene that hangs on a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Index into [`Scene::cameras`] or [`Scene::lights`].
    pub index: u32,
    /// Index into [`Scene::nodes`].
    pub node: u32,
}

impl Scene {
    /// The scene while its first animation plays, at a time of the clock in seconds that wraps around at the animation's end;
    /// at rest without an animation.
    pub fn pose_at(&self, time_s: f64) -> Pose {
        let mut pose = Pose::default();
        self.pose_into(Moment::at(time_s), &mut pose);
        pose
    }

    /// As [`Self::pose_at`], for any moment, into a pose whose memory is used again: nothing is allocated where it has been filled for
    /// this scene before.
    pub fn pose_into(&self, moment: Moment, pose: &mut Pose) {
        let playing = match moment {
            Moment::Rest => None,
            Moment::Playing { animation, time_s } => {
                self.animations.get(animation).map(|found| (found, found.wrap(time_s)))
            }
        };
        let mut nodes = std::mem::take(&mut pose.file_from_nodes);
        self.file_from_nodes_into(playing, &mut nodes);
        pose.world_from_object.clear();
        pose.world_from_object.extend(self.instances.iter().map(|instance| {
            // Without animations instances stay where they are, also those that code has put there without a node.
            let node = nodes.get(instance.node as usize).filter(|_| !self.animations.is_empty());
            node.map_or(instance.world_from_object, |&file_from_node| self.world_from(file_from_node))
        }));
        self.joints_into(&nodes, &mut pose.object_from_bind);
        self.weights_into(playing, &mut pose.weights);
        self.cameras_into(&nodes, &mut pose.cameras);
        self.lights_into(&nodes, &mut pose.lights);
        pose.file_from_nodes = nodes;
    }

    /// Moves the scene into a pose of its own: instances, the vertices of deformed meshes, cameras and lights.
    pub fn take_pose(&mut self, pose: &Pose) {
        self.place_in(pose);
        self.cameras.iter_mut().zip(&pose.cameras).for_each(|(own, posed)| own.clone_from(posed));
        self.lights.iter_mut().zip(&pose.lights).for_each(|(own, posed)| *own = *posed);
    }

    /// Places the instances, and the vertices of deformed meshes, as the first animation has them at a time; without an animation
    /// nothing changes. Lights and cameras stay: [`Self::take_pose`] moves them too.
    pub fn pose(&mut self, time_s: f64) {
        if !self.animations.is_empty() {
            self.place_in(&self.pose_at(time_s));
        }
    }

    fn place_in(&mut self, pose: &Pose) {
        for (instance, world_from_object) in self.instances.iter_mut().zip(&pose.world_from_object) {
            instance.world_from_object = *world_from_object;
        }
        self.write_deformed(&pose.object_from_bind, &pose.weights);
    }

    /// A box in world space that holds an instance in a pose, whatever its skin and its morph targets do; empty for an instance that does
    /// not exist. Conservative: it may be larger than the vertices' own.
    pub fn bounds_in_pose(&self, pose: &Pose, instance: usize) -> Aabb {
        let Some((found, world_from_object)) =
            self.instances.get(instance).zip(pose.world_from_object.get(instance))
        else {
            return Aabb::EMPTY;
        };
        let deformed = self.deformation_of(instance).and_then(|k| {
            let d = &self.deformations[k];
            let joints = pose.object_from_bind.get(d.joints(self))?;
            let weights = pose.weights.get(d.weights(self))?;
            Some(self.shapes.get(d.shape as usize)?.bounds_in(weights, joints))
        });
        let bounds_os = deformed.or_else(|| Some(self.meshes.get(found.mesh as usize)?.bounds_os));
        bounds_os.unwrap_or(Aabb::EMPTY).transformed(world_from_object)
    }

    /// For each instance whether an animation moves it or changes its shape; the others are alike at all times.
    pub fn moving_instances(&self, animation: usize) -> Vec<bool> {
        let mut moves = vec![false; self.nodes.len()];
        let Some(animation) = self.animations.get(animation) else {
            return vec![false; self.instances.len()];
        };
        for track in &animation.tracks {
            if let Some(node) = moves.get_mut(track.node as usize) {
                *node = true;
            }
        }
        for (k, node) in self.nodes.iter().enumerate() {
            moves[k] |= node.parent.is_some_and(|p| moves.get(p as usize) == Some(&true));
        }
        let moved = |node: u32| moves.get(node as usize) == Some(&true);
        let is_deformed = |instance: usize| {
            let Some(d) = self.deformation_of(instance).map(|k| &self.deformations[k]) else { return false };
            let skin = d.skin.and_then(|skin| self.skins.get(skin as usize));
            skin.is_some_and(|skin| skin.joints.iter().any(|&joint| moved(joint)))
                || animation.weights.iter().any(|track| track.node == d.weights_node)
        };
        let instances = self.instances.iter().enumerate();
        instances.map(|(k, instance)| moved(instance.node) || is_deformed(k)).collect()
    }

    /// The matrices of all deformations' joints ([`Pose::object_from_bind`]).
    pub(crate) fn joints_into(&self, file_from_nodes: &[DAffine3], out: &mut Vec<Affine3A>) {
        out.clear();
        for deformation in &self.deformations {
            let Some(skin) = deformation.skin.and_then(|skin| self.skins.get(skin as usize)) else {
                continue;
            };
            // Meshes of one node share what the first of them has made.
            if (deformation.first_joint as usize) < out.len() {
                continue;
            }
            let node = |k: u32| file_from_nodes.get(k as usize).copied().unwrap_or(DAffine3::IDENTITY);
            let object_from_file = node(deformation.object_node).inverse();
            let joints = skin.joints.iter().zip(&skin.joint_from_bind);
            out.extend(joints.map(|(&joint, joint_from_bind)| {
                (object_from_file * (node(joint) * joint_from_bind.as_daffine3())).as_affine3a()
            }));
        }
    }

    /// The weights of all deformations ([`Pose::weights`]).
    pub(crate) fn weights_into(
        &self,
        playing: Option<(&crate::animation::Animation, f32)>,
        out: &mut Vec<f32>,
    ) {
        out.clear();
        out.extend_from_slice(&self.rest_weights);
        let Some((animation, time_s)) = playing else { return };
        for track in &animation.weights {
            // Deformations stand by rising node of their weights.
            let first = self.deformations.partition_point(|d| d.weights_node < track.node);
            let Some(deformation) = self.deformations.get(first).filter(|d| d.weights_node == track.node)
            else {
                continue;
            };
            if let Some(weights) = out.get_mut(deformation.weights(self)) {
                track.weights_at(time_s, weights);
            }
        }
    }

    fn cameras_into(&self, file_from_nodes: &[DAffine3], out: &mut Vec<Camera>) {
        out.clone_from(&self.cameras);
        for attached in &self.camera_nodes {
            let node = file_from_nodes.get(attached.node as usize);
            let place = node.and_then(|&node| rigid(&self.world_from(node)));
            if let Some((camera, place)) = out.get_mut(attached.index as usize).zip(place) {
                camera.world_from_view = place;
            }
        }
    }

    fn lights_into(&self, file_from_nodes: &[DAffine3], out: &mut Vec<Light>) {
        out.clear();
        out.extend_from_slice(&self.lights);
        for attached in &self.light_nodes {
            let node = file_from_nodes.get(attached.node as usize);
            if let Some((light, &node)) = out.get_mut(attached.index as usize).zip(node) {
                *light = placed(light, &self.world_from(node));
            }
        }
    }
}

/// A light as a node places it: it shines along the node's −Z.
pub(crate) fn placed(light: &Light, world_from_node: &Affine3A) -> Light {
    let direction_ws = world_from_node.transform_vector3(Vec3::NEG_Z).try_normalize().unwrap_or(Vec3::NEG_Y);
    Light { position_ws: world_from_node.translation.into(), direction_ws, ..*light }
}

/// Position and orientation of a frame without its scale; the view direction −Z is kept.
pub(crate) fn rigid(world: &Affine3A) -> Option<Affine3A> {
    let z = Vec3::from(world.matrix3.z_axis).try_normalize()?;
    let x = Vec3::from(world.matrix3.y_axis).cross(z).try_normalize()?;
    let frame = Affine3A::from_cols(x.into(), z.cross(x).into(), z.into(), world.translation);
    frame.is_finite().then_some(frame)
}
