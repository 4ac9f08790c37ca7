//! What frames are drawn of, on which device and how: a specification that a command line, a file or another language fills.

use afterlight_techniques::{Effects, Indirect, ParamError, ParamSet as _, Post, Shadows, view};
use serde::{Deserialize, Serialize};

use crate::{LabError, effects};

/// Most seeded lights.
pub const LIGHTS_MAX: u32 = 1_000_000;

/// Most frames that are measured of a technique.
pub const FRAMES_MAX: u32 = 10_000;

/// Numbers of samples a pixel.
pub const SAMPLES: [u32; 5] = [1, 2, 4, 8, 16];

/// The scene where none is named.
pub const DEFAULT_SCENE: &str = "builtin:colonnade";

/// What frames look like, and the device that draws them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FrameSpec {
    /// Image width, pixels, at least 1.
    pub width: u32,
    /// Image height, pixels, at least 1.
    pub height: u32,
    /// Samples a pixel, one of [`SAMPLES`].
    pub samples: u32,
    /// Number of seeded point lights, at most [`LIGHTS_MAX`]; 0 keeps the scene's own lights.
    pub lights: u32,
    /// Seed of the lights.
    pub light_seed: u64,
    /// Camera in the words of [`camera::select`](afterlight_scene::camera::select); none for the scene's first.
    pub camera: Option<String>,
    /// Parameters of techniques, `KEY=VALUE` or `ID.KEY=VALUE`.
    pub set: Vec<String>,
    /// Device, by a part of its name or its index; none for the best.
    pub device: Option<String>,
    /// Time at which animated nodes are posed, seconds; none for the pose of the file.
    pub time_s: Option<f64>,
    /// Effects, by the names that the command line has for them; what is not said has its default.
    #[serde(with = "effects")]
    pub effects: Effects,
    /// What to show: `final`, or a debug view.
    pub view: String,
    /// Turns on Vulkan validation; any message is an error when the session ends.
    pub validate: bool,
}

impl Default for FrameSpec {
    fn default() -> FrameSpec {
        FrameSpec {
            width: 1280,
            height: 720,
            samples: 1,
            lights: 0,
            light_seed: 1,
            camera: None,
            set: Vec::new(),
            device: None,
            time_s: None,
            effects: Effects::default(),
            view: view::FINAL.to_owned(),
            validate: false,
        }
    }
}

impl FrameSpec {
    /// Checks ranges, and what does not go together.
    ///
    /// # Errors
    /// The first setting that is out of its range, with the range.
    pub fn check(&self) -> Result<(), LabError> {
        for (name, px) in [("width", self.width), ("height", self.height)] {
            check(name, px, px >= 1, "a whole number of pixels, at least 1")?;
        }
        check_samples(self.samples)?;
        check("lights", self.lights, self.lights <= LIGHTS_MAX, format!("at most {LIGHTS_MAX}"))?;
        if let Some(time_s) = self.time_s {
            check("time", time_s, time_s.is_finite(), "a finite number of seconds")?;
        }
        check_effects(&self.effects)?;
        let post = self.effects.post.filter;
        let filters_a_view = post != Post::None && self.view != view::FINAL;
        let expected = "none with a debug view (its colours are values, which no filter may mix)";
        check("post", post.name(), !filters_a_view, expected)?;
        Ok(())
    }
}

/// Refuses effects out of their ranges, and what does nothing without another effect.
fn check_effects(effects: &Effects) -> Result<(), LabError> {
    for info in effects.described() {
        if let Err(ParamError::Value { found, expected, .. }) =
            Effects::default().set(info.key, &info.default)
        {
            return Err(LabError::setting(info.key, found, expected));
        }
    }
    let Effects { tessellation, shadows, indirect, .. } = effects;
    let mm = tessellation.displacement_mm;
    let is_tessellated = tessellation.edge_px.is_some() || mm == 0.0;
    check("displacement", mm, is_tessellated, "0 without tessellation (--tessellate)")?;
    let usual = Effects::default();
    let has_map = shadows.method != Shadows::None || indirect.method != Indirect::None;
    for (size_px, usual_px) in
        [(shadows.map_size_px, usual.shadows.map_size_px), (indirect.map_size_px, usual.indirect.map_size_px)]
    {
        let expected = "no such option without --shadows map or --indirect rsm";
        check("shadow-map-size", size_px, has_map || size_px == usual_px, expected)?;
    }
    Ok(())
}

/// Refuses a setting's value unless it `is_taken`.
///
/// # Errors
/// [`LabError::Setting`] with what was found and what is expected.
pub fn check(
    name: &'static str,
    found: impl std::fmt::Display,
    is_taken: bool,
    expected: impl std::fmt::Display,
) -> Result<(), LabError> {
    if is_taken { Ok(()) } else { Err(LabError::setting(name, found, expected)) }
}

/// Refuses what is no number of samples a pixel.
///
/// # Errors
/// [`LabError::Setting`] that lists [`SAMPLES`].
pub fn check_samples(samples: u32) -> Result<(), LabError> {
    check("samples", samples, SAMPLES.contains(&samples), "1, 2, 4, 8 or 16")
}

/// Refuses a number of frames that are measured of a technique.
///
/// # Errors
/// [`LabError::Setting`] with the range.
pub fn check_frames(frames: u32) -> Result<(), LabError> {
    let expected = format!("a whole number from 1 to {FRAMES_MAX}");
    check("frames", frames, (1..=FRAMES_MAX).contains(&frames), expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_specification_is_json_and_back() {
        let mut effects = Effects::default();
        for (key, text) in
            [("post", "smaa"), ("shadow-map-size", "512"), ("transparency", "none"), ("tessellate", "4")]
        {
            effects.set(key, text).expect("a value");
        }
        let spec = FrameSpec { width: 64, effects, ..FrameSpec::default() };
        let text = serde_json::to_string(&spec).expect("is JSON");
        let expected =
            r#""effects":{"post":"smaa","shadow-map-size":512,"tessellate":4,"transparency":"none"}"#;
        assert!(text.contains(expected), "{text}");
        assert_eq!(serde_json::from_str::<FrameSpec>(&text).expect("reads"), spec);
        assert_eq!(serde_json::from_str::<FrameSpec>("{}").expect("reads"), FrameSpec::default());
    }

    #[test]
    fn what_is_unknown_is_told_with_what_is_known() {
        let told = |text: &str| serde_json::from_str::<FrameSpec>(text).expect_err("is refused").to_string();
        let line = told(r#"{"widht": 3}"#);
        assert!(line.contains("widht") && line.contains("`width`"), "{line}");
        let line = told(r#"{"effects": {"shadows": "pcss"}}"#);
        assert!(line.contains("pcss") && line.contains("none, map"), "{line}");
        let line = told(r#"{"effects": {"fog": true}}"#);
        assert!(line.contains("fog") && line.contains("shadow-map-size"), "{line}");
    }

    #[test]
    fn ranges_are_checked() {
        let refused = |change: fn(&mut FrameSpec)| {
            let mut spec = FrameSpec::default();
            change(&mut spec);
            spec.check().expect_err("is refused").to_string()
        };
        assert!(FrameSpec::default().check().is_ok());
        assert!(refused(|spec| spec.width = 0).starts_with("width: found 0"));
        assert!(refused(|spec| spec.samples = 3).contains("1, 2, 4, 8 or 16"));
        assert!(refused(|spec| spec.lights = LIGHTS_MAX + 1).starts_with("lights"));
        assert!(refused(|spec| spec.time_s = Some(f64::NAN)).starts_with("time"));
        assert!(refused(|spec| spec.effects.tessellation.edge_px = Some(0.5)).contains("from 1 to 64"));
        assert!(
            refused(|spec| spec.effects.tessellation.displacement_mm = 20.0).contains("without tessellation")
        );
        assert!(refused(|spec| spec.effects.shadows.map_size_px = 64).contains("--shadows map"));
        let filtered =
            refused(|spec| (spec.effects.post.filter, spec.view) = (Post::Fxaa, "edges".to_owned()));
        assert!(filtered.starts_with("post: found fxaa, expected none"), "{filtered}");
    }
}
