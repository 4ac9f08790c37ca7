//! What can go wrong between a scene and its image.

use afterlight_graph::{GraphError, gpu::GpuError};
use afterlight_params::ParamError;
use afterlight_scene::SceneError;

/// What the device says while a frame is planned or runs is an error of the device, whoever asked it.
impl From<GraphError> for TechniqueError {
    fn from(error: GraphError) -> Self {
        match error {
            GraphError::Gpu(error) => Self::Gpu(error),
            error => Self::Graph(error),
        }
    }
}

/// An error of preparing or running a technique: one line that names what, found and expected.
#[derive(Debug, thiserror::Error)]
pub enum TechniqueError {
    /// An image or buffer of the scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The frame graph.
    #[error(transparent)]
    Graph(GraphError),
    /// A shader name that the program does not have.
    #[error("shader {name:?}: not compiled into this program; expected one of the names in variants.txt")]
    UnknownShader {
        /// The name.
        name: String,
    },
    /// A parameter that a technique does not have, or a value out of its range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A motion has turned an instance inside out, so that its draws belong to another bucket.
    #[error(
        "instance {instance}: a motion mirrors it; expected one that keeps the hand of its matrix, or the scene uploaded anew"
    )]
    TurnedOver {
        /// The instance, by its number in the scene.
        instance: u32,
    },
    /// A scene that moves in a flight of a scene that was said to stand still.
    #[error(
        "a flight of a scene that stands still: found a pose, expected none without FlightOptions::scene_moves"
    )]
    SceneStandsStill,
    /// Lights that are not those which a flight was planned for.
    #[error(
        "lights of a pose: found others than the {expected} that the flight was planned for, expected as many of the same kinds"
    )]
    OtherLights {
        /// Lights that were planned for.
        expected: u32,
    },
    /// A pose's joints or weights of morph targets are not as many as the scene's.
    #[error(
        "shapes of a pose: found {} joints and {} weights of morph targets, expected {} and {} as the scene has",
        found[0], found[1], expected[0], expected[1]
    )]
    OtherShapes {
        /// Joints and weights of the pose.
        found: [usize; 2],
        /// Those of the scene.
        expected: [u32; 2],
    },
    /// Something larger than the device takes.
    #[error("{what}: found {found}, expected at most {limit}")]
    TooLarge {
        /// What.
        what: String,
        /// Found.
        found: u64,
        /// Limit.
        limit: u64,
    },
    /// A sample count that technique or device lack.
    #[error("samples for {technique}: found {found}, expected one of: {expected}")]
    Samples {
        /// The technique.
        technique: &'static str,
        /// The count asked for.
        found: u32,
        /// Counts that it can render here.
        expected: String,
    },
    /// A debug view that the technique does not have.
    #[error("view {found:?} of {technique}: found no such view, expected one of: {known}")]
    UnknownView {
        /// The technique.
        technique: &'static str,
        /// The view.
        found: String,
        /// Views that it has.
        known: String,
    },
    /// Parameters that do not go together.
    #[error("{technique}: found {found}, expected {expected}")]
    Conflict {
        /// The technique.
        technique: &'static str,
        /// What was asked for.
        found: String,
        /// What would do.
        expected: String,
    },
    /// Tessellated surfaces, which the technique does not draw.
    #[error("{technique}: found --tessellate, expected a technique that can (`techniques --json` tells)")]
    Untessellated {
        /// The technique.
        technique: &'static str,
    },
    /// The operating system gives no thread to plan on.
    #[error("no thread to plan on: {0}")]
    NoThread(std::io::Error),
    /// The device lacks features.
    #[error("{technique}: the device lacks {missing}")]
    Unavailable {
        /// The technique.
        technique: &'static str,
        /// The features.
        missing: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame that finds no memory is told apart from a frame that is wrong.
    #[test]
    fn an_error_of_the_device_is_one_wherever_it_comes_from() {
        let full = || GpuError::OutOfMemory { resource: "frame heap".to_owned(), bytes: 1 };
        let through_the_graph = TechniqueError::from(GraphError::Gpu(full()));
        assert!(matches!(through_the_graph, TechniqueError::Gpu(GpuError::OutOfMemory { .. })));
        assert_eq!(through_the_graph.to_string(), full().to_string());
    }
}
