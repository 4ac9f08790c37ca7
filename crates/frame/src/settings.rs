//! What a frame looks like, whatever the technique: size, view, lights, and effects.

use afterlight_scene::{Camera, Environment, Light, Scene};
use glam::Vec3;

use crate::{Effects, views};

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
    /// Keeps the linear radiance after a frame, for `Prepared::hdr_rgba`; its memory is then not reused.
    pub keep_hdr: bool,
    /// Keeps the depth of opaque surfaces after a frame of one sample, for `Prepared::depth`, where the technique puts it on the
    /// board; its memory is then not reused.
    pub keep_depth: bool,
    /// Effects.
    pub effects: Effects,
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
            keep_depth: false,
            effects: Effects::default(),
        }
    }

    /// The same with other effects.
    #[must_use]
    pub fn with_effects(mut self, change: impl FnOnce(&mut Effects)) -> Self {
        change(&mut self.effects);
        self
    }
}
