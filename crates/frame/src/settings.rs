//! What a frame looks like, whatever the technique: size, view, lights, and effects.

use afterlight_scene::{Camera, Environment, Light, Scene};
use glam::Vec3;

use crate::views;

/// What a frame looks like, whatever the technique.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Image width, pixels, at least 1.
    pub width_px: u32,
    /// Image height, pixels, at least 1.
    pub height_px: u32,
    /// Visibility samples a pixel.
    pub samples: u32,
    /// Camera.
    pub camera: Camera,
    /// Lights.
    pub lights: Vec<Light>,
    /// What surrounds the scene.
    pub environment: Environment,
    /// What to show: [`views::FINAL`] or a debug view of the technique.
    pub view: String,
    /// Keeps the linear radiance after a frame, for [`Prepared::hdr_rgba`]; its memory is then not reused.
    pub keep_hdr: bool,
    /// Anti-aliasing after shading.
    pub post: Post,
    /// Tessellates surfaces to edges of that length on screen, pixels.
    pub tessellate_px: Option<f32>,
    /// How far tessellated surfaces are displaced along each axis at most, m; nothing without tessellation.
    pub displacement_m: f32,
    /// Light that surfaces reflect onto each other.
    pub indirect: Indirect,
    /// Width and height of the reflective shadow map, texels, at least 1.
    pub rsm_size_px: u32,
    /// Shadows of one light.
    pub shadows: Shadows,
    /// Width and height of the shadow map, texels, at least 1.
    pub shadow_map_size_px: u32,
    /// Scale of the shadow map's bias: 1 is what its filter needs, less makes surfaces shadow themselves, more takes shadows
    /// off what casts them.
    pub shadow_bias: f32,
    /// How surfaces with alpha blending are drawn.
    pub transparency: Transparency,
}

impl Settings {
    /// One sample, the scene's first camera, its own lights.
    pub fn for_scene(scene: &Scene, width_px: u32, height_px: u32) -> Self {
        let camera = scene.cameras.first().cloned();
        Self {
            width_px,
            height_px,
            samples: 1,
            camera: camera.unwrap_or_else(|| Camera::look_at("default", Vec3::Z, Vec3::ZERO, 1.0, 0.1)),
            lights: scene.lights.clone(),
            environment: scene.environment,
            view: views::FINAL.to_owned(),
            keep_hdr: false,
            post: Post::None,
            tessellate_px: None,
            displacement_m: 0.0,
            indirect: Indirect::None,
            rsm_size_px: DEFAULT_RSM_SIZE_PX,
            shadows: Shadows::None,
            shadow_map_size_px: DEFAULT_SHADOW_MAP_SIZE_PX,
            shadow_bias: 1.0,
            transparency: Transparency::default(),
        }
    }
}

/// Light that surfaces reflect onto each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Indirect {
    /// None but the constant ambient term.
    #[default]
    None,
    /// One bounce of one light, by a reflective shadow map.
    Rsm,
}

impl Indirect {
    /// Name on the command line and in run records.
    pub const fn name(self) -> &'static str {
        match self {
            Indirect::None => "none",
            Indirect::Rsm => "rsm",
        }
    }
}

/// Shadows of direct light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Shadows {
    /// None: light passes through surfaces.
    #[default]
    None,
    /// Of one light, by a shadow map.
    Map,
}

impl Shadows {
    /// Name on the command line and in run records.
    pub const fn name(self) -> &'static str {
        match self {
            Shadows::None => "none",
            Shadows::Map => "map",
        }
    }
}

/// How surfaces with alpha blending are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Transparency {
    /// Not at all.
    None,
    /// From back to front, after the opaque surfaces.
    #[default]
    Sorted,
}

impl Transparency {
    /// Name on the command line and in run records.
    pub const fn name(self) -> &'static str {
        match self {
            Transparency::None => "none",
            Transparency::Sorted => "sorted",
        }
    }
}

/// Anti-aliasing after shading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Post {
    /// None.
    #[default]
    None,
    /// Fast approximate anti-aliasing 3.11, quality (Lottes 2009).
    Fxaa,
    /// Enhanced subpixel morphological anti-aliasing, one sample (Jimenez et al. 2012).
    Smaa,
    /// Subpixel reconstruction anti-aliasing (Chajdas et al. 2011).
    Sraa,
}

impl Post {
    /// All of them.
    pub const ALL: [Post; 4] = [Post::None, Post::Fxaa, Post::Smaa, Post::Sraa];

    /// Name on the command line and in run records.
    pub const fn name(self) -> &'static str {
        match self {
            Post::None => "none",
            Post::Fxaa => "fxaa",
            Post::Smaa => "smaa",
            Post::Sraa => "sraa",
        }
    }
}

/// Width and height of the reflective shadow map where none is given, texels.
pub const DEFAULT_RSM_SIZE_PX: u32 = 512;

/// Width and height of the shadow map where none is given, texels.
pub const DEFAULT_SHADOW_MAP_SIZE_PX: u32 = 2048;

/// Shortest edge that tessellation aims at, pixels.
pub const MIN_TESSELLATE_PX: f32 = 1.0;

/// Longest edge that tessellation aims at, pixels.
pub const MAX_TESSELLATE_PX: f32 = 64.0;

/// Farthest displacement along each axis, m: beyond an eighth of the field's period the surface would fold.
pub const MAX_DISPLACEMENT_M: f32 = 0.1;
