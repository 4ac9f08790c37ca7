//! What a technique is given and what it is: the frame to record, its settings and parameters, the board on which parts of a frame hand
//! things on, and the scene on the device.
//!
//! Nothing here knows a stage or a technique. Stages (`afterlight-stages`) are built on it, techniques on both.

pub use afterlight_cost as cost;
pub use afterlight_graph as graph;
pub use afterlight_scene as scene_model;
pub use afterlight_shader as shader;

pub mod board;
pub mod camera_view;
pub mod capacity;
mod error;
mod frame;
pub mod params;
pub mod scene;
mod settings;
mod slots;
mod technique;
pub mod upload;
pub mod views;

pub use board::{Board, OpaqueDepth, SceneInput, SurfaceNormals, TriangleIds, VisitsAllLights};
pub use camera_view::CameraView;
pub use capacity::Counter;
pub use error::TechniqueError;
pub use frame::{Frame, SceneBuffers};
pub use params::{ParamInfo, ParamKind, Params};
pub use scene::{
    SceneGpu,
    draw_list::{DrawOptions, DrawOrder},
    lights::{SceneLights, device_order},
};
pub use settings::{
    DEFAULT_RSM_SIZE_PX, DEFAULT_SHADOW_MAP_SIZE_PX, Indirect, MAX_DISPLACEMENT_M, MAX_TESSELLATE_PX,
    MIN_TESSELLATE_PX, Post, Settings, Shadows, Transparency,
};
pub use slots::{Slots, SourceSlots};
pub use technique::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Info, MULTIPLE_SAMPLES, Need, Source, Technique,
};
pub use views::LightPairs;
