//! Animation of nodes: translation, rotation and scale over time.

use glam::{Affine3A, DAffine3, DQuat, DVec3, Quat, Vec3};

use crate::Scene;

/// How values between two keys are found (glTF 2.0, appendix C).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the key before.
    Step,
    /// Linear; spherical linear for rotations.
    #[default]
    Linear,
    /// Cubic Hermite spline with a tangent on either side of each key.
    CubicSpline,
}

/// A curve: values at times. Outside of its keys the first or last value holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve<T> {
    /// Times of the keys, seconds, increasing.
    pub times_s: Vec<f32>,
    /// A value a key; for [`Interpolation::CubicSpline`] three: in-tangent, value, out-tangent.
    pub values: Vec<T>,
    /// How values between keys are found.
    pub interpolation: Interpolation,
}

/// The motion of one node.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeTrack {
    /// Index into [`Scene::nodes`].
    pub node: u32,
    /// Translation where `translation` is absent, metres.
    pub rest_translation: DVec3,
    /// Rotation where `rotation` is absent.
    pub rest_rotation: Quat,
    /// Scale where `scale` is absent.
    pub rest_scale: Vec3,
    /// Translation over time, metres.
    pub translation: Option<Curve<Vec3>>,
    /// Rotation over time, unit quaternions.
    pub rotation: Option<Curve<Quat>>,
    /// Scale over time.
    pub scale: Option<Curve<Vec3>>,
}

/// An animation: motions of several nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Animation {
    /// Name for messages.
    pub name: String,
    /// Time of the last key, seconds; times beyond wrap around.
    pub duration_s: f64,
    /// Motions, at most one a node.
    pub tracks: Vec<NodeTrack>,
}

/// A value that a curve can have.
pub trait Animated: Copy {
    /// The value at `t` in [0, 1] between two keys, linear or spherical linear.
    fn mix(a: Self, b: Self, t: f32) -> Self;
    /// The cubic Hermite spline through `a` and `b` with the tangents `out_a` and `in_b`, already
    /// scaled by the time between the keys.
    fn hermite(a: Self, out_a: Self, in_b: Self, b: Self, t: f32) -> Self;
    /// The value times a number, not normalised.
    fn scaled(self, factor: f32) -> Self;
}

/// Weights of start value, start tangent, end tangent, end value (glTF 2.0, C.5).
fn hermite_weights(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, t3 - t2, 3.0 * t2 - 2.0 * t3]
}

impl Animated for Vec3 {
    fn mix(a: Self, b: Self, t: f32) -> Self {
        a.lerp(b, t)
    }

    fn hermite(a: Self, out_a: Self, in_b: Self, b: Self, t: f32) -> Self {
        let w = hermite_weights(t);
        a * w[0] + out_a * w[1] + in_b * w[2] + b * w[3]
    }

    fn scaled(self, factor: f32) -> Self {
        self * factor
    }
}

impl Animated for Quat {
    fn mix(a: Self, b: Self, t: f32) -> Self {
        a.slerp(b, t)
    }

    fn hermite(a: Self, out_a: Self, in_b: Self, b: Self, t: f32) -> Self {
        let w = hermite_weights(t);
        let q = a * w[0] + out_a * w[1] + in_b * w[2] + b * w[3];
        if q.length_squared() > 0.0 { q.normalize() } else { a }
    }

    fn scaled(self, factor: f32) -> Self {
        self * factor
    }
}

impl<T: Animated> Curve<T> {
    /// The value at a time; `None` where the curve has no key or fewer values than its keys need.
    pub fn at(&self, time_s: f32) -> Option<T> {
        let cubic = self.interpolation == Interpolation::CubicSpline;
        let key = |k: usize| self.values.get(if cubic { 3 * k + 1 } else { k }).copied();
        let next = self.times_s.partition_point(|&t| t <= time_s);
        if next == 0 {
            return key(0);
        }
        let last = next - 1;
        if next == self.times_s.len() || self.interpolation == Interpolation::Step {
            return key(last);
        }
        let span_s = self.times_s[next] - self.times_s[last];
        let t = if span_s > 0.0 { (time_s - self.times_s[last]) / span_s } else { 0.0 };
        let (a, b) = (key(last)?, key(next)?);
        if !cubic {
            return Some(T::mix(a, b, t));
        }
        let (out_a, in_b) = (*self.values.get(3 * last + 2)?, *self.values.get(3 * next)?);
        Some(T::hermite(a, T::scaled(out_a, span_s), T::scaled(in_b, span_s), b, t))
    }
}

impl Default for NodeTrack {
    fn default() -> Self {
        Self {
            node: 0,
            rest_translation: DVec3::ZERO,
            rest_rotation: Quat::IDENTITY,
            rest_scale: Vec3::ONE,
            translation: None,
            rotation: None,
            scale: None,
        }
    }
}

impl NodeTrack {
    /// Parent from node at a time.
    pub fn local_at(&self, time_s: f32) -> DAffine3 {
        let translation = self.translation.as_ref().and_then(|c| c.at(time_s));
        let translation = translation.map_or(self.rest_translation, |t| t.as_dvec3());
        let rotation = self.rotation.as_ref().and_then(|c| c.at(time_s)).unwrap_or(self.rest_rotation);
        let scale = self.scale.as_ref().and_then(|c| c.at(time_s)).unwrap_or(self.rest_scale);
        local(scale.as_dvec3(), rotation.as_dquat(), translation)
    }
}

/// Parent from node, in 64 bits: a rotation that is rounded to 32 moves what is 1,400 km from its axis by 0.1 m.
pub(crate) fn local(scale: DVec3, rotation: DQuat, translation: DVec3) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(scale, unit(rotation), translation)
}

/// The rotation that a quaternion of any length stands for; none for that of length 0.
pub(crate) fn unit(rotation: DQuat) -> DQuat {
    if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY }
}

impl Animation {
    /// Time within the animation for a time of the clock: wrapped at the duration.
    pub fn wrap(&self, time_s: f64) -> f32 {
        if self.duration_s > 0.0 && time_s.is_finite() {
            time_s.rem_euclid(self.duration_s) as f32
        } else {
            0.0
        }
    }
}

impl Scene {
    /// World from node for every node: at rest, or as the first animation has it at a time.
    pub fn world_from_nodes(&self, time_s: Option<f64>) -> Vec<Affine3A> {
        let relative = |m: DAffine3| DAffine3 { translation: m.translation - self.origin_file, ..m };
        self.file_from_nodes(time_s).into_iter().map(|m| relative(m).as_affine3a()).collect()
    }

    /// The file's space from node for every node, as [`Self::world_from_nodes`].
    pub(crate) fn file_from_nodes(&self, time_s: Option<f64>) -> Vec<DAffine3> {
        let mut locals: Vec<_> = self.nodes.iter().map(|n| n.local).collect();
        if let (Some(time_s), Some(animation)) = (time_s, self.animations.first()) {
            let time_s = animation.wrap(time_s);
            for track in &animation.tracks {
                if let Some(local) = locals.get_mut(track.node as usize) {
                    *local = track.local_at(time_s);
                }
            }
        }
        let mut worlds: Vec<DAffine3> = Vec::with_capacity(locals.len());
        for (node, local) in self.nodes.iter().zip(locals) {
            let world = node.parent.map_or(local, |p| worlds[p as usize] * local);
            worlds.push(world);
        }
        worlds
    }

    /// Places the instances as the first animation has them at a time; without an animation
    /// nothing changes. Lights and cameras stay: ask for a time on loading to move them too.
    pub fn pose(&mut self, time_s: f64) {
        if self.animations.is_empty() {
            return;
        }
        let worlds = self.world_from_nodes(Some(time_s));
        for instance in &mut self.instances {
            instance.world_from_object = worlds[instance.node as usize];
        }
    }
}
