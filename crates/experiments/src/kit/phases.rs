//! What passes and buffers are for, in the terms of an experiment's columns: by their roles, never by their names.

use afterlight_measure::{Buffer, BufferRole, Pass, PassRole};
use serde::Serialize;

/// What a pass is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// What all techniques share: the choice of draws, the light's view, and blended surfaces.
    Indirect,
    /// The depth pre-pass.
    Prepass,
    /// Drawing what shows: G-buffer, triangle IDs, keys, references, lists, with what is cleared for it.
    Fill,
    /// Finding the triangles that show in a finished visibility buffer, and sizes of dispatches.
    Find,
    /// Screen-space derivatives of visible triangles.
    Derivatives,
    /// Finding the lights of tiles, clusters or pixels.
    Lights,
    /// Shading, and the average of samples.
    Shade,
    /// What every frame ends in.
    Present,
    /// Debug views and measurements.
    Upkeep,
}

impl Phase {
    fn of_role(role: PassRole) -> Phase {
        match role {
            PassRole::Shared | PassRole::Culling | PassRole::Transparency => Phase::Indirect,
            PassRole::DepthPrepass => Phase::Prepass,
            PassRole::Geometry => Phase::Fill,
            PassRole::TriangleSelection => Phase::Find,
            PassRole::Derivatives => Phase::Derivatives,
            PassRole::LightAssignment => Phase::Lights,
            PassRole::Shading | PassRole::Resolve => Phase::Shade,
            PassRole::Filter | PassRole::Present => Phase::Present,
            PassRole::Upkeep => Phase::Upkeep,
        }
    }
}

/// What a pass is for; none in a record from before passes had roles.
pub(crate) fn phase(pass: &Pass) -> Option<Phase> {
    pass.role.map(Phase::of_role)
}

/// The first buffer of a role.
pub(crate) fn of_role(buffers: &[Buffer], role: BufferRole) -> Option<&Buffer> {
    buffers.iter().find(|buffer| buffer.role == Some(role))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use afterlight_measure::RunResult;

    /// The same result under other names of passes and buffers.
    pub fn renamed(result: &RunResult) -> RunResult {
        let mut result = result.clone();
        let mut count = 0;
        let mut name = || {
            count += 1;
            format!("shade/depth {count}")
        };
        let mut rename = |buffers: &mut Vec<Buffer>| buffers.iter_mut().for_each(|one| one.name = name());
        for pass in &mut result.passes {
            rename(&mut pass.reads);
            rename(&mut pass.writes);
        }
        if let Some(memory) = &mut result.memory {
            rename(&mut memory.buffers);
        }
        for (index, pass) in result.passes.iter_mut().enumerate() {
            pass.name = format!("clear/resolve {index}");
        }
        result
    }

    #[test]
    fn every_role_has_a_phase_and_shared_work_is_apart() {
        for role in PassRole::ALL {
            assert_eq!(Phase::of_role(*role) == Phase::Indirect, role.is_shared(), "{role}");
        }
    }
}
