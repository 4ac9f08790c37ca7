//! Animations of nodes and of the weights of morph targets.

use std::collections::BTreeMap;

use glam::{Quat, Vec3};
use gltf::json::{
    self, Root,
    accessor::{ComponentType, Type},
    animation::{Interpolation as JsonInterpolation, Property},
    validation::Checked,
};

use super::{
    accessor::Accessors,
    node::{Placement, rest_trs},
};
use crate::{
    SceneError,
    animation::{Animation, Curve, Interpolation, NodeTrack, WeightTrack},
};

/// Reads all animations; channels of nodes outside of the scene are left out.
pub(super) fn convert(
    accessors: &Accessors,
    root: &Root,
    placement: &Placement,
    warnings: &mut Vec<String>,
) -> Result<Vec<Animation>, SceneError> {
    let mut out = Vec::new();
    for (i, animation) in root.animations.iter().enumerate() {
        out.push(convert_one(accessors, root, placement, i, animation, warnings)?);
    }
    if out.len() > 1 {
        warnings.push(format!("{} animations: the first one is played", out.len()));
    }
    Ok(out)
}

fn convert_one(
    accessors: &Accessors,
    root: &Root,
    placement: &Placement,
    index: usize,
    animation: &json::Animation,
    warnings: &mut Vec<String>,
) -> Result<Animation, SceneError> {
    let mut tracks: BTreeMap<u32, NodeTrack> = BTreeMap::new();
    let mut weights: BTreeMap<u32, WeightTrack> = BTreeMap::new();
    let mut duration_s = 0.0f32;
    for (k, channel) in animation.channels.iter().enumerate() {
        let at = format!("animations[{index}].channels[{k}]");
        let invalid = |found: &str, expected: &str| SceneError::invalid(accessors.file, &at, found, expected);
        let target = channel.target.node.value();
        let Checked::Valid(property) = channel.target.path else {
            return Err(invalid("an unknown target.path", "translation, rotation, scale or weights"));
        };
        let sampler = &animation.samplers[channel.sampler.value()];
        let (times_s, interpolation) = read_times(accessors, &at, sampler)?;
        let cubic = interpolation == Interpolation::CubicSpline;
        let value_count = times_s.len() * if cubic { 3 } else { 1 };
        duration_s = duration_s.max(times_s.last().copied().unwrap_or(0.0));
        let doubled = || invalid("a second channel for the same property", "one");
        if property == Property::MorphTargetWeights {
            let target_count = target_count(root, target);
            if target_count == 0 {
                warnings.push(format!("{at}: node {target} has no morph targets whose weights could move"));
                continue;
            }
            let count = value_count.saturating_mul(target_count);
            let values = read_weights(accessors, &at, sampler.output.value(), count)?;
            let Some(node) = placement.scene_node[target] else { continue };
            let curve = Curve { times_s, values, interpolation };
            let track = WeightTrack { node, target_count: target_count as u32, curve };
            if weights.insert(node, track).is_some() {
                return Err(doubled());
            }
            continue;
        }
        if root.nodes[target].matrix.is_some() {
            return Err(invalid("a node with a matrix", "a node with translation, rotation and scale"));
        }
        let Some(node) = placement.scene_node[target] else { continue };
        let rest = rest_trs(accessors.file, root, &placement.places, target)?;
        let track = tracks.entry(node).or_insert_with(|| NodeTrack {
            node,
            rest_translation: rest.translation,
            rest_rotation: rest.rotation.as_quat(),
            rest_scale: rest.scale.as_vec3(),
            ..NodeTrack::default()
        });
        let output = sampler.output.value();
        match property {
            Property::Rotation => {
                let values = read_values::<4>(accessors, &at, output, value_count)?;
                let key = |k: usize| !cubic || k % 3 == 1;
                let unit = |(k, v): (usize, [f32; 4])| {
                    let q = Quat::from_array(v);
                    // tangents of splines are no rotations and stay as they are
                    if !key(k) {
                        q
                    } else if q.length_squared() > 0.0 {
                        q.normalize()
                    } else {
                        Quat::IDENTITY
                    }
                };
                let values = values.into_iter().enumerate().map(unit).collect();
                if track.rotation.replace(Curve { times_s, values, interpolation }).is_some() {
                    return Err(doubled());
                }
            }
            _ => {
                let values = read_values::<3>(accessors, &at, output, value_count)?;
                let curve =
                    Curve { times_s, values: values.into_iter().map(Vec3::from).collect(), interpolation };
                let slot =
                    if property == Property::Scale { &mut track.scale } else { &mut track.translation };
                if slot.replace(curve).is_some() {
                    return Err(doubled());
                }
            }
        }
    }
    Ok(Animation {
        name: animation.name.clone().unwrap_or_else(|| format!("animations[{index}]")),
        duration_s: f64::from(duration_s),
        tracks: tracks.into_values().collect(),
        weights: weights.into_values().collect(),
    })
}

/// Number of morph targets of a node's mesh; all of its primitives have as many.
fn target_count(root: &Root, node: usize) -> usize {
    let primitive = root.nodes[node].mesh.and_then(|mesh| root.meshes[mesh.value()].primitives.first());
    primitive.and_then(|primitive| primitive.targets.as_ref()).map_or(0, Vec::len)
}

fn read_times(
    accessors: &Accessors,
    at: &str,
    sampler: &json::animation::Sampler,
) -> Result<(Vec<f32>, Interpolation), SceneError> {
    let interpolation = match sampler.interpolation {
        Checked::Valid(JsonInterpolation::Step) => Interpolation::Step,
        Checked::Valid(JsonInterpolation::CubicSpline) => Interpolation::CubicSpline,
        Checked::Valid(JsonInterpolation::Linear) | Checked::Invalid => Interpolation::Linear,
    };
    let layout = accessors.layout(sampler.input.value())?;
    let at = format!("{at}, sampler input {}", accessors.place(sampler.input.value()));
    if layout.shape != Type::Scalar || layout.component != ComponentType::F32 {
        let found = format!("{:?} of {:?}", layout.shape, layout.component);
        return Err(SceneError::invalid(accessors.file, at, found, "SCALAR of F32"));
    }
    let times_s: Vec<f32> =
        accessors.floats::<1>(sampler.input.value(), 1, 0.0)?.into_iter().map(|[t]| t).collect();
    if interpolation == Interpolation::CubicSpline && times_s.len() < 2 {
        return Err(SceneError::invalid(accessors.file, at, "one key", "2 or more for a CUBICSPLINE"));
    }
    if times_s[0] < 0.0 || times_s.windows(2).any(|w| w[0] >= w[1]) {
        return Err(SceneError::invalid(
            accessors.file,
            at,
            "times out of order",
            "increasing times, 0 or more",
        ));
    }
    Ok((times_s, interpolation))
}

/// Weights: one a target for each value that the keys need.
fn read_weights(
    accessors: &Accessors,
    at: &str,
    output: usize,
    count: usize,
) -> Result<Vec<f32>, SceneError> {
    let layout = accessors.layout(output)?;
    let at = || format!("{at}, sampler output {}", accessors.place(output));
    let fits = layout.component == ComponentType::F32 || layout.normalized;
    if !fits || layout.shape != Type::Scalar {
        let found = format!("{:?} of {:?}", layout.shape, layout.component);
        return Err(SceneError::invalid(accessors.file, at(), found, "SCALAR of F32 or normalized integers"));
    }
    if layout.count != count {
        let expected = format!("{count}, as its keys and targets need");
        return Err(SceneError::invalid(accessors.file, at(), format!("{} values", layout.count), expected));
    }
    Ok(accessors.floats::<1>(output, 1, 0.0)?.into_iter().map(|[weight]| weight).collect())
}

fn read_values<const N: usize>(
    accessors: &Accessors,
    at: &str,
    output: usize,
    count: usize,
) -> Result<Vec<[f32; N]>, SceneError> {
    let layout = accessors.layout(output)?;
    let at = || format!("{at}, sampler output {}", accessors.place(output));
    let float = layout.component == ComponentType::F32;
    let fits = float || N == 4 && layout.normalized;
    if !fits {
        let expected = if N == 4 { "F32 or normalized integers" } else { "F32" };
        return Err(SceneError::invalid(accessors.file, at(), format!("{:?}", layout.component), expected));
    }
    if layout.count != count {
        let expected = format!("{count}, as its keys need");
        return Err(SceneError::invalid(accessors.file, at(), format!("{} values", layout.count), expected));
    }
    accessors.floats::<N>(output, N, 0.0)
}
