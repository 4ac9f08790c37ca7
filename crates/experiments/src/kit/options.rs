//! Options that a command line has for all experiments, and how specifications take them.

use std::path::PathBuf;

use afterlight_lab::spec::{DEFAULT_SCENE, check, check_frames};
use afterlight_lab::{FrameSpec, LabError};
use afterlight_techniques::{Post, view};

/// Frames measured of each technique where nothing else is said.
pub(crate) const DEFAULT_FRAMES: u32 = 5;

/// Options for any experiment. What is none was not said: the experiment has a value of its own.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Share of the experiment's width and height, above 0, at most 1.
    pub scale: Option<f64>,
    /// Scenes.
    pub scenes: Option<Vec<String>>,
    /// Numbers of seeded lights.
    pub light_counts: Option<Vec<u32>>,
    /// Techniques, by their ids, or `all`.
    pub techniques: Option<Vec<String>>,
    /// Frames measured of each technique, after a warm-up frame.
    pub frames: Option<u32>,
    /// Predicted pairs of a light and a surface a frame beyond which a technique is left out.
    pub max_pairs: Option<u64>,
    /// Predicted draws a frame beyond which a technique is left out.
    pub max_commands: Option<u64>,
    /// Views along the camera path.
    pub views: Option<u32>,
    /// Camera path, a JSON file.
    pub path: Option<PathBuf>,
    /// Image width, pixels.
    pub width: Option<u32>,
    /// Image height, pixels.
    pub height: Option<u32>,
    /// Samples a pixel.
    pub samples: Option<u32>,
    /// All else about frames; its width, height and samples do not count.
    pub frame: FrameSpec,
}

impl Options {
    /// The frames' settings at an experiment's own size, pixels, unless width or height was given.
    pub(crate) fn frame_at(&self, own_px: (u32, u32)) -> FrameSpec {
        let usual = FrameSpec::default();
        let (width, height) = match (self.width, self.height) {
            (None, None) => own_px,
            (width, height) => (width.unwrap_or(usual.width), height.unwrap_or(usual.height)),
        };
        FrameSpec { width, height, samples: usual.samples, ..self.frame.clone() }
    }
}

/// All techniques.
pub(crate) fn all_techniques() -> Vec<String> {
    vec!["all".to_owned()]
}

/// The scene where none is named.
pub(crate) fn default_scenes() -> Vec<String> {
    vec![DEFAULT_SCENE.to_owned()]
}

/// Checks what all specifications have.
pub(crate) fn check_run(scale: f64, frames: u32, frame: &FrameSpec) -> Result<(), LabError> {
    check("scale", scale, scale > 0.0 && scale <= 1.0, "a number above 0, at most 1")?;
    check_frames(frames)?;
    frame.check()
}

/// The frames' settings at a share of their width and height; one sample, the final image without a filter.
pub(crate) fn at_size(frame: &FrameSpec, scale: f64) -> FrameSpec {
    let scaled = |px: u32| ((f64::from(px) * scale).round() as u32).max(1);
    let mut frame = FrameSpec {
        width: scaled(frame.width),
        height: scaled(frame.height),
        samples: 1,
        view: view::FINAL.to_owned(),
        ..frame.clone()
    };
    frame.effects.post.filter = Post::None;
    frame
}

/// Numbers of samples of an experiment: those up to the number that was given, or it alone where it is below them all.
pub(crate) fn sample_counts_up_to(most: Option<u32>, own: &[u32]) -> Vec<u32> {
    let Some(most) = most else { return own.to_vec() };
    let up_to: Vec<u32> = own.iter().copied().filter(|count| *count <= most).collect();
    if up_to.is_empty() { vec![most] } else { up_to }
}

#[cfg(test)]
mod tests {
    use super::super::FULL_HD_PX;
    use super::*;

    #[test]
    fn sizes_are_the_experiments_own_unless_given() {
        let size = |options: Options, scale: f64| {
            let frame = at_size(&options.frame_at(FULL_HD_PX), scale);
            (frame.width, frame.height)
        };
        let given = |width: u32, height: u32| Options {
            width: Some(width),
            height: Some(height),
            ..Options::default()
        };
        assert_eq!(size(Options::default(), 1.0), (1920, 1080));
        assert_eq!(size(Options::default(), 0.1), (192, 108));
        assert_eq!(size(given(1280, 720), 1.0), (1280, 720));
        assert_eq!(size(given(100, 50), 0.5), (50, 25));
        assert_eq!(size(Options::default(), 0.0001), (1, 1));
        assert_eq!(size(Options { width: Some(100), ..Options::default() }, 1.0), (100, 720));
    }

    #[test]
    fn samples_limit_columns() {
        let counts = |most: Option<u32>| sample_counts_up_to(most, &[4, 8]);
        assert_eq!(counts(None), [4, 8]);
        assert_eq!(counts(Some(4)), [4]);
        assert_eq!(counts(Some(16)), [4, 8]);
        assert_eq!(counts(Some(2)), [2]);
    }

    #[test]
    fn scale_is_a_share() {
        for scale in [0.0, -1.0, 1.5, f64::NAN] {
            assert!(check_run(scale, 1, &FrameSpec::default()).is_err(), "{scale}");
        }
        assert!(check_run(1.0, 1, &FrameSpec::default()).is_ok());
        assert!(check_run(1.0, 0, &FrameSpec::default()).is_err());
    }
}
