//! The techniques of deferred shading, a folder each, and their registry.
//!
//! A technique answers four questions (what a surface leaves behind, how lights find it, where shading runs, how samples
//! become pixels) and is one folder: `mod.rs` with its `TECHNIQUE`, its shaders, `variants.txt` that lists their variants,
//! a README. The build collects the folders into [`registry`]. Stages that they are put together from are `afterlight-stages`.
//!
//! ```no_run
//! use afterlight_renderer::Renderer;
//! use afterlight_techniques::{Params, Settings, find, graph::gpu};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let device = gpu::Device::open(&gpu::DeviceOptions::default())?;
//! let scene = afterlight_scene::load_source("builtin:colonnade", &Default::default())?;
//! let renderer = Renderer::new(&device, &scene, &Settings::for_scene(&scene, 640, 360))?;
//! let mut frame = renderer.prepare(find("tiled").unwrap(), &Params::default())?;
//! frame.run()?;
//! let rgba8_srgb = frame.final_rgba8()?;
//! # Ok(()) }
//! ```

pub use afterlight_cost as cost;
pub use afterlight_frame::{
    ANY_SAMPLES, Answers, AppendixA, Approximation, Board, Condition, Counter, Cull, CullOn, DrawOrder,
    DrawParams, Effects, Exactness, Frame, Indirect, Info, LightPairs, MULTIPLE_SAMPLES, Need, ParamError,
    ParamInfo, ParamKind, ParamSet, Params, Post, SceneGpu, SceneLights, Settings, Shadows, Source,
    Technique, TechniqueError, Transparency, completed, device_order, exactness_of, params, params_of,
    set_param, views,
};
pub use afterlight_graph as graph;
pub use afterlight_scene as scene;
pub use afterlight_shader as shader;
pub use afterlight_stages as stages;

// Names of before the rooms, until the programs use the new ones.
/// Debug views.
pub mod view {
    pub use afterlight_frame::views::*;
    pub use afterlight_stages::views::{ATTRIBUTE_ERRORS, RECORD_SAMPLES, of};
}
pub use afterlight_stages::{
    compose::post,
    shared::{indirect, light_view, shadow},
    surfaces::gbuffer,
};
/// Limits of tessellation.
pub mod geometry {
    pub use afterlight_frame::{MAX_DISPLACEMENT_MM, MAX_TESSELLATE_PX, MIN_TESSELLATE_PX};
}

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
