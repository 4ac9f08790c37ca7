//! The techniques of deferred shading: recipes, stages, shaders, and the renderer that runs them.
//!
//! A technique answers four questions (what a surface leaves behind, how lights find it, where shading runs, how samples
//! become pixels) and is one folder: `mod.rs` with its `TECHNIQUE`, its shaders, `variants.txt` that lists their variants,
//! a README. The build collects the folders into [`registry`]. Stages that several techniques share stand beside them:
//! [`geometry`], [`gbuffer`], [`light_step`], [`clusters`], [`light_view`], [`indirect`], [`shadow`], [`volumes`], [`transparent`], [`present`], [`post`].
//!
//! ```no_run
//! use afterlight_techniques::{Params, Renderer, Settings, find, graph::gpu};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let device = gpu::Device::open(&gpu::DeviceOptions::default())?;
//! let scene = afterlight_scene::load_source("builtin:colonnade", &Default::default())?;
//! let renderer = Renderer::new(&device, &scene, &Settings::for_scene(&scene, 640, 360))?;
//! let mut frame = renderer.prepare(find("tiled").unwrap(), &Params::default())?;
//! frame.run()?;
//! let rgba8_srgb = frame.final_rgba8()?;
//! # Ok(()) }
//! ```

pub use afterlight_graph as graph;
pub use afterlight_scene as scene;
pub use afterlight_shader as shader;

mod capacity;
pub mod clusters;
pub mod compute_raster;
pub mod cost;
mod draw_list;
mod error;
mod frame;
pub mod gbuffer;
pub mod geometry;
pub mod indirect;
pub mod light_bvh;
pub mod light_indices;
pub mod light_lists;
pub mod light_step;
pub mod light_view;
mod lights;
pub mod multisample;
mod params;
pub mod post;
pub mod present;
mod radiance_target;
mod renderer;
mod scene_gpu;
pub mod shadow;
pub mod supersample;
mod technique;
mod textures;
pub mod transparent;
pub mod triangle_buffer;
pub mod view;
pub mod volumes;

pub use capacity::Counter;
pub use draw_list::{DrawOptions, DrawOrder};
pub use error::TechniqueError;
pub use frame::Frame;
pub use indirect::Indirect;
pub use lights::{LightList, device_order};
pub use params::{ParamInfo, ParamKind, Params};
pub use post::Post;
pub use renderer::{Prepared, Renderer, Settings};
pub use scene_gpu::SceneGpu;
pub use shadow::Shadows;
pub use technique::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Info, MULTIPLE_SAMPLES, Need, Source, Technique,
};
pub use transparent::Transparency;
pub use view::LightPairs;

include!(concat!(env!("OUT_DIR"), "/registry.rs"));
include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// Every technique of this crate.
pub fn registry() -> &'static [&'static dyn Technique] {
    TECHNIQUES
}

/// The technique with that id.
pub fn find(id: &str) -> Option<&'static dyn Technique> {
    registry().iter().copied().find(|t| t.info().id == id)
}
