//! Animation: translation, rotation and scale of nodes, and weights of morph targets, over time.
//!
//! Files have 32 bits; values between keys are found in 64 ([`NodeTrack::local_at`], [`WeightTrack::weights_at`]).

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

/// The weights of the morph targets of one node's mesh over time (glTF 2.0, 3.11).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WeightTrack {
    /// Index into [`Scene::nodes`] of the node whose mesh is morphed.
    pub node: u32,
    /// Number of morph targets.
    pub target_count: u32,
    /// Times of the keys in seconds, and for each key a weight of each target, one key after another; for
    /// [`Interpolation::CubicSpline`] in-tangents of all targets, then their weights, then their out-tangents.
    pub curve: Curve<f32>,
}

/// An animation: motions of several nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Animation {
    /// Name, as the file has it.
    pub name: String,
    /// Time of the last key, seconds; times beyond wrap around.
    pub duration_s: f64,
    /// Motions, at most one a node.
    pub tracks: Vec<NodeTrack>,
    /// Changes of shape, at most one a node.
    pub weights: Vec<WeightTrack>,
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
fn hermite_weights(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, t3 - t2, 3.0 * t2 - 2.0 * t3]
}

/// The shorter way between two rotations at an even speed (glTF 2.0, C.4).
pub(crate) fn slerp(a: DQuat, b: DQuat, t: f64) -> DQuat {
    let (a, b) = (unit(a), unit(b));
    let b = if a.dot(b) < 0.0 { -b } else { b };
    // The sine of the angle between them, which a dot product near 1 does not tell.
    let angle = 2.0 * (0.5 * (b - a).length()).min(1.0).asin();
    let sine = angle.sin();
    // Nearly one rotation: the chord is the arc, and the quotient has no digits.
    if sine < 1e-6 {
        return unit(a * (1.0 - t) + b * t);
    }
    unit(a * (((1.0 - t) * angle).sin() / sine) + b * ((t * angle).sin() / sine))
}

impl Animated for Vec3 {
    fn mix(a: Self, b: Self, t: f32) -> Self {
        a.lerp(b, t)
    }

    fn hermite(a: Self, out_a: Self, in_b: Self, b: Self, t: f32) -> Self {
        let w = hermite_weights(f64::from(t)).map(|w| w as f32);
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
        let w = hermite_weights(f64::from(t)).map(|w| w as f32);
        let q = a * w[0] + out_a * w[1] + in_b * w[2] + b * w[3];
        if q.length_squared() > 0.0 { q.normalize() } else { a }
    }

    fn scaled(self, factor: f32) -> Self {
        self * factor
    }
}

/// Where a time lies among the keys of a curve.
enum Place {
    /// The value of this key holds.
    Key(usize),
    /// At `t` in [0, 1] between this key and the next, `span_s` seconds apart.
    After { key: usize, t: f64, span_s: f64 },
}

impl<T> Curve<T> {
    /// Where a time lies; `None` without keys.
    fn place(&self, time_s: f64) -> Option<Place> {
        let next = self.times_s.partition_point(|&key_s| f64::from(key_s) <= time_s);
        let key = next.saturating_sub(1);
        if next == 0 || next == self.times_s.len() || self.interpolation == Interpolation::Step {
            return (!self.times_s.is_empty()).then_some(Place::Key(key));
        }
        let span_s = f64::from(self.times_s[next]) - f64::from(self.times_s[key]);
        let t = if span_s > 0.0 { (time_s - f64::from(self.times_s[key])) / span_s } else { 0.0 };
        Some(Place::After { key, t, span_s })
    }

    /// Whether each key has two tangents beside its value.
    fn is_cubic(&self) -> bool {
        self.interpolation == Interpolation::CubicSpline
    }
}

impl<T: Copy> Curve<T> {
    /// The value in 64 bits at a time, of values that `wide` widens: `mix` is the value between two, and a spline's value
    /// is the sum of its four parts.
    fn wide_at<W>(&self, time_s: f64, wide: impl Fn(T) -> W, mix: impl Fn(W, W, f64) -> W) -> Option<W>
    where
        W: Copy + std::ops::Mul<f64, Output = W> + std::ops::Add<Output = W>,
    {
        let value = |k: usize| self.values.get(k).map(|&v| wide(v));
        let key_value = |k: usize| value(if self.is_cubic() { 3 * k + 1 } else { k });
        match self.place(time_s)? {
            Place::Key(key) => key_value(key),
            Place::After { key, t, .. } if !self.is_cubic() => {
                Some(mix(key_value(key)?, key_value(key + 1)?, t))
            }
            Place::After { key, t, span_s } => {
                let w = hermite_weights(t);
                let (a, b) = (key_value(key)?, key_value(key + 1)?);
                let (out_a, in_b) = (value(3 * key + 2)?, value(3 * key + 3)?);
                Some(a * w[0] + out_a * (w[1] * span_s) + in_b * (w[2] * span_s) + b * w[3])
            }
        }
    }
}

impl<T: Animated> Curve<T> {
    /// The value at a time; `None` where the curve has no key or fewer values than its keys need.
    pub fn at(&self, time_s: f32) -> Option<T> {
        let value = |k: usize| self.values.get(k).copied();
        let key_value = |k: usize| value(if self.is_cubic() { 3 * k + 1 } else { k });
        match self.place(f64::from(time_s))? {
            Place::Key(key) => key_value(key),
            Place::After { key, t, .. } if !self.is_cubic() => {
                Some(T::mix(key_value(key)?, key_value(key + 1)?, t as f32))
            }
            Place::After { key, t, span_s } => {
                let (a, b) = (key_value(key)?, key_value(key + 1)?);
                let (out_a, in_b) = (value(3 * key + 2)?, value(3 * key + 3)?);
                let [out_a, in_b] = [out_a, in_b].map(|tangent| T::scaled(tangent, span_s as f32));
                Some(T::hermite(a, out_a, in_b, b, t as f32))
            }
        }
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
        let time_s = f64::from(time_s);
        let vector = |curve: &Option<Curve<Vec3>>| {
            curve.as_ref().and_then(|c| c.wide_at(time_s, |v| v.as_dvec3(), |a, b, t| a.lerp(b, t)))
        };
        let rotation = self.rotation.as_ref().and_then(|c| c.wide_at(time_s, |q| q.as_dquat(), slerp));
        local(
            vector(&self.scale).unwrap_or(self.rest_scale.as_dvec3()),
            rotation.unwrap_or(self.rest_rotation.as_dquat()),
            vector(&self.translation).unwrap_or(self.rest_translation),
        )
    }
}

impl WeightTrack {
    /// Writes the weights at a time into `weights`, one a target; what the curve does not have stays.
    pub fn weights_at(&self, time_s: f32, weights: &mut [f32]) {
        let Some(place) = self.curve.place(f64::from(time_s)) else { return };
        let count = self.target_count as usize;
        // Rows of the values: a key has one, or three where it has tangents.
        let value = |row: usize, target: usize| {
            self.curve.values.get(row * count + target).map(|&weight| f64::from(weight))
        };
        let key_row = |key: usize| if self.curve.is_cubic() { 3 * key + 1 } else { key };
        let at = |target: usize| -> Option<f64> {
            match place {
                Place::Key(key) => value(key_row(key), target),
                Place::After { key, t, span_s } => {
                    let (a, b) = (value(key_row(key), target)?, value(key_row(key + 1), target)?);
                    if !self.curve.is_cubic() {
                        return Some(a + (b - a) * t);
                    }
                    let w = hermite_weights(t);
                    let (out_a, in_b) = (value(3 * key + 2, target)?, value(3 * key + 3, target)?);
                    Some(a * w[0] + out_a * (w[1] * span_s) + in_b * (w[2] * span_s) + b * w[3])
                }
            }
        };
        for (target, weight) in weights.iter_mut().enumerate().take(count) {
            *weight = at(target).map_or(*weight, |found| found as f32);
        }
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
        let nodes = self.file_from_nodes(time_s);
        nodes.into_iter().map(|file_from_node| self.world_from(file_from_node)).collect()
    }

    /// World from a space, given the file's space from it.
    pub(crate) fn world_from(&self, mut file_from_space: DAffine3) -> Affine3A {
        file_from_space.translation -= self.origin_file;
        file_from_space.as_affine3a()
    }

    /// The file's space from node for every node, as [`Self::world_from_nodes`].
    pub(crate) fn file_from_nodes(&self, time_s: Option<f64>) -> Vec<DAffine3> {
        let mut nodes = Vec::with_capacity(self.nodes.len());
        let playing = time_s.and_then(|time_s| self.animations.first().map(|a| (a, a.wrap(time_s))));
        self.file_from_nodes_into(playing, &mut nodes);
        nodes
    }

    /// The file's space from node for every node, at rest or as an animation has them at a time within it.
    pub(crate) fn file_from_nodes_into(&self, playing: Option<(&Animation, f32)>, nodes: &mut Vec<DAffine3>) {
        nodes.clear();
        nodes.extend(self.nodes.iter().map(|n| n.local));
        if let Some((animation, time_s)) = playing {
            for track in &animation.tracks {
                if let Some(local) = nodes.get_mut(track.node as usize) {
                    *local = track.local_at(time_s);
                }
            }
        }
        // Parents come first, so that theirs are done.
        for (k, node) in self.nodes.iter().enumerate() {
            if let Some(parent) = node.parent.and_then(|p| nodes.get(p as usize)).copied() {
                nodes[k] = parent * nodes[k];
            }
        }
    }
}
