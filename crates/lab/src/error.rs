//! What ends a laboratory's work early.

use std::fmt::Display;

use afterlight_graph::GraphError;
use afterlight_graph::gpu::GpuError;
use afterlight_image::ImageError;
use afterlight_scene::SceneError;
use afterlight_techniques::TechniqueError;

/// What ends a laboratory's work early. Its text is what was named, what was found and what is expected.
#[derive(Debug, thiserror::Error)]
pub enum LabError {
    /// A setting of a specification whose value is not taken.
    #[error("{name}: found {found}, expected {expected}")]
    Setting {
        /// The setting, its words joined by dashes as the command line names it, without leading dashes.
        name: &'static str,
        /// The value.
        found: String,
        /// What would do.
        expected: String,
    },
    /// A specification that does not read.
    #[error("specification of {experiment}: {reason}")]
    Specification {
        /// What it is for.
        experiment: &'static str,
        /// What does not read, with its line.
        reason: String,
    },
    /// The scene, its camera or a camera path.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The frame graph.
    #[error(transparent)]
    Graph(Box<GraphError>),
    /// A technique, or its parameters.
    #[error(transparent)]
    Technique(Box<TechniqueError>),
    /// Images that cannot be compared or encoded.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Figures that cannot be written as JSON.
    #[error("JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// What the Vulkan validation layers said.
    #[error("{} Vulkan validation message(s), expected none", .0.len())]
    Validation(
        /// The messages.
        Vec<String>,
    ),
    /// What broke off while it ran.
    #[error("{what}: {reason}")]
    BrokeOff {
        /// What.
        what: String,
        /// Why.
        reason: String,
    },
}

impl From<GraphError> for LabError {
    fn from(error: GraphError) -> LabError {
        LabError::Graph(Box::new(error))
    }
}

impl From<TechniqueError> for LabError {
    fn from(error: TechniqueError) -> LabError {
        LabError::Technique(Box::new(error))
    }
}

impl LabError {
    /// A setting whose value is not taken.
    pub fn setting(name: &'static str, found: impl Display, expected: impl Display) -> LabError {
        LabError::Setting { name, found: found.to_string(), expected: expected.to_string() }
    }
}
