//! What frames are drawn of, on which device and how: a specification that a command line, a file or another language fills.

use afterlight_techniques::geometry::{MAX_DISPLACEMENT_M, MAX_TESSELLATE_PX, MIN_TESSELLATE_PX};
use afterlight_techniques::{Indirect, Post, Shadows, Transparency, view};
use serde::{Deserialize, Serialize};

use crate::{LabError, names};

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
    /// Camera of the scene by name or index, or `x,y,z,tx,ty,tz,fov_deg`: eye and target in metres, vertical angle of view in
    /// degrees. None for the scene's first.
    pub camera: Option<String>,
    /// Parameters of techniques, `KEY=VALUE` or `ID.KEY=VALUE`.
    pub set: Vec<String>,
    /// Device, by a part of its name or its index; none for the best.
    pub device: Option<String>,
    /// Time at which animated nodes are posed, seconds; none for the pose of the file.
    pub time_s: Option<f64>,
    /// Anti-aliasing after shading.
    #[serde(with = "names::post")]
    pub post: Post,
    /// Tessellates surfaces to edges of about so many pixels, [`MIN_TESSELLATE_PX`] to [`MAX_TESSELLATE_PX`]; none for the
    /// scene's own triangles.
    pub tessellate_px: Option<f32>,
    /// Displaces tessellated surfaces by up to so many millimetres along each axis, 0 to 1000 × [`MAX_DISPLACEMENT_M`].
    pub displacement_mm: f32,
    /// Shadows of one light: the first directional or spot light, else the strongest point light.
    #[serde(with = "names::shadows")]
    pub shadows: Shadows,
    /// Width and height of a light's view, texels, at least 1; none for 2048 for shadows, 512 for indirect light.
    pub shadow_map_size: Option<u32>,
    /// Indirect light.
    #[serde(with = "names::indirect")]
    pub indirect: Indirect,
    /// Surfaces with alpha blending.
    #[serde(with = "names::transparency")]
    pub transparency: Transparency,
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
            post: Post::None,
            tessellate_px: None,
            displacement_mm: 0.0,
            shadows: Shadows::None,
            shadow_map_size: None,
            indirect: Indirect::None,
            transparency: Transparency::Sorted,
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
        if let Some(px) = self.tessellate_px {
            let expected = format!("a number of pixels from {MIN_TESSELLATE_PX} to {MAX_TESSELLATE_PX}");
            check("tessellate", px, (MIN_TESSELLATE_PX..=MAX_TESSELLATE_PX).contains(&px), expected)?;
        }
        let (mm, max_mm) = (self.displacement_mm, MAX_DISPLACEMENT_M * 1e3);
        let expected = format!("a number of millimetres from 0 to {max_mm}");
        check("displacement", mm, (0.0..=max_mm).contains(&mm), expected)?;
        let is_tessellated = self.tessellate_px.is_some() || mm == 0.0;
        check("displacement", mm, is_tessellated, "0 without tessellation")?;
        let filters_a_view = self.post != Post::None && self.view != view::FINAL;
        let expected = "none with a debug view (its colours are values, which no filter may mix)";
        check("post", self.post.name(), !filters_a_view, expected)?;
        if let Some(size) = self.shadow_map_size {
            let has_map = self.shadows != Shadows::None || self.indirect != Indirect::None;
            let expected = "no such option without --shadows map or --indirect rsm";
            check("shadow-map-size", size, has_map, expected)?;
            check("shadow-map-size", size, size >= 1, "a whole number of texels, at least 1")?;
        }
        Ok(())
    }
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
        let spec = FrameSpec {
            width: 64,
            post: Post::Smaa,
            shadows: Shadows::Map,
            transparency: Transparency::None,
            tessellate_px: Some(4.0),
            ..FrameSpec::default()
        };
        let text = serde_json::to_string(&spec).expect("is JSON");
        assert!(text.contains(r#""post":"smaa""#) && text.contains(r#""transparency":"none""#), "{text}");
        assert_eq!(serde_json::from_str::<FrameSpec>(&text).expect("reads"), spec);
        assert_eq!(serde_json::from_str::<FrameSpec>("{}").expect("reads"), FrameSpec::default());
    }

    #[test]
    fn what_is_unknown_is_told_with_what_is_known() {
        let told = |text: &str| serde_json::from_str::<FrameSpec>(text).expect_err("is refused").to_string();
        let line = told(r#"{"widht": 3}"#);
        assert!(line.contains("widht") && line.contains("`width`"), "{line}");
        let line = told(r#"{"shadows": "pcss"}"#);
        assert!(line.contains("pcss") && line.contains("none, map"), "{line}");
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
        assert!(refused(|spec| spec.tessellate_px = Some(0.5)).contains("from 1 to 64"));
        assert!(refused(|spec| spec.displacement_mm = 20.0).contains("without tessellation"));
        assert!(refused(|spec| spec.shadow_map_size = Some(64)).contains("--shadows map"));
        let filtered = refused(|spec| (spec.post, spec.view) = (Post::Fxaa, "edges".to_owned()));
        assert!(filtered.starts_with("post: found fxaa, expected none"), "{filtered}");
    }
}
