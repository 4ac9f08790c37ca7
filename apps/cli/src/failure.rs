//! What ends the program early, and its exit code.

use afterlight_graph::GraphError;
use afterlight_graph::gpu::GpuError;
use afterlight_image::ImageError;
use afterlight_lab::LabError;
use afterlight_report::FileError;
use afterlight_scene::SceneError;
use afterlight_techniques::TechniqueError;

use crate::output::one_line;

/// Exit code of a check that failed, and of a device or disk that broke off.
pub const FAILED: u8 = 1;
/// Exit code of bad usage and bad input.
pub const BAD_INPUT: u8 = 2;
/// Exit code of Vulkan validation messages.
pub const VALIDATION: u8 = 3;
/// Exit code of a machine without a usable device.
pub const NO_DEVICE: u8 = 4;

/// How to get a device where there is none.
pub const INSTALL_DEVICE: &str = "install one, for example a software device: apt-get install -y libvulkan1 mesa-vulkan-drivers \
     (Fedora: dnf install -y vulkan-loader mesa-vulkan-drivers; Arch: pacman -S vulkan-icd-loader vulkan-swrast)";

/// What ends the program early.
#[derive(Debug)]
pub enum Failure {
    /// A check that the command makes failed, or something broke off while it ran.
    Failed(String),
    /// Bad usage or bad input.
    Input(String),
    /// Vulkan validation messages.
    Validation(Vec<String>),
    /// No usable device.
    NoDevice(String),
}

impl Failure {
    /// An option's value that is not taken.
    pub fn option(name: &str, found: impl std::fmt::Display, expected: impl std::fmt::Display) -> Failure {
        Failure::Input(format!("{name}: found {found}, expected {expected}"))
    }

    /// The exit code.
    pub fn code(&self) -> u8 {
        match self {
            Failure::Failed(_) => FAILED,
            Failure::Input(_) => BAD_INPUT,
            Failure::Validation(_) => VALIDATION,
            Failure::NoDevice(_) => NO_DEVICE,
        }
    }

    /// What to tell, a line each.
    pub fn lines(&self) -> Vec<String> {
        match self {
            Failure::Failed(text) | Failure::Input(text) | Failure::NoDevice(text) => {
                vec![one_line(text)]
            }
            Failure::Validation(messages) => {
                let mut lines: Vec<String> =
                    messages.iter().map(|message| format!("validation: {}", one_line(message))).collect();
                lines.push(format!("{} Vulkan validation message(s), expected none", messages.len()));
                lines
            }
        }
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Failure {
        Failure::Input(error.to_string())
    }
}

impl From<GpuError> for Failure {
    fn from(error: GpuError) -> Failure {
        let text = error.to_string();
        match error {
            GpuError::NoLoader { .. } | GpuError::MissingFeature { .. } => {
                Failure::NoDevice(format!("{text}; {INSTALL_DEVICE}"))
            }
            GpuError::NoDevice { ref found, .. } if found.starts_with("none") => {
                Failure::NoDevice(format!("{text}; {INSTALL_DEVICE}"))
            }
            GpuError::NoDevice { .. } => Failure::Input(format!("--device: {text}")),
            GpuError::NoValidationLayer
            | GpuError::TooLarge { .. }
            | GpuError::UnsupportedSamples { .. }
            | GpuError::UnsupportedFormat { .. } => Failure::Input(text),
            _ => Failure::Failed(text),
        }
    }
}

impl From<GraphError> for Failure {
    fn from(error: GraphError) -> Failure {
        match error {
            GraphError::Gpu(error) => error.into(),
            GraphError::Groups { .. } => Failure::Input(error.to_string()),
            other => Failure::Failed(other.to_string()),
        }
    }
}

impl From<TechniqueError> for Failure {
    fn from(error: TechniqueError) -> Failure {
        match error {
            TechniqueError::Scene(error) => error.into(),
            TechniqueError::Gpu(error) => error.into(),
            TechniqueError::Graph(error) => error.into(),
            TechniqueError::UnknownShader { .. } => Failure::Failed(error.to_string()),
            _ => Failure::Input(error.to_string()),
        }
    }
}

impl From<ImageError> for Failure {
    fn from(error: ImageError) -> Failure {
        match error {
            ImageError::Io { .. } => Failure::Input(error.to_string()),
            other => Failure::Failed(other.to_string()),
        }
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Failure {
        match error {
            FileError::Image(error) => error.into(),
            FileError::Folder { .. } | FileError::Place { .. } => Failure::Input(error.to_string()),
            FileError::Json(_) => Failure::Failed(error.to_string()),
        }
    }
}

impl From<LabError> for Failure {
    fn from(error: LabError) -> Failure {
        match error {
            // The library names settings; the options of those names begin with two dashes.
            LabError::Setting { name, found, expected } => {
                Failure::option(&format!("--{name}"), found, expected)
            }
            LabError::Specification { .. } => Failure::Input(error.to_string()),
            LabError::Scene(error) => error.into(),
            LabError::Gpu(error) => error.into(),
            LabError::Graph(error) => (*error).into(),
            LabError::Technique(error) => (*error).into(),
            LabError::Image(error) => error.into(),
            LabError::Json(_) | LabError::BrokeOff { .. } => Failure::Failed(error.to_string()),
            LabError::Validation(messages) => Failure::Validation(messages),
        }
    }
}
