//! What a technique is given and what it is: the frame to record, its settings and parameters, the board on which parts of a frame hand
//! things on, and the scene on the device.
//!
//! Nothing here knows a stage or a technique. Stages (`afterlight-stages`) are built on it, techniques on both.

pub use afterlight_cost as cost;
pub use afterlight_graph as graph;
pub use afterlight_params as params;
pub use afterlight_scene as scene_model;
pub use afterlight_shader as shader;

pub mod board;
pub mod camera_view;
pub mod capacity;
mod draws;
mod effects;
mod error;
mod frame;
mod inputs;
pub mod scene;
mod settings;
mod slots;
pub mod sort_words;
mod technique;
mod time;
pub mod upload;
pub mod views;

pub use board::{Board, OpaqueDepth, SceneInput, SurfaceNormals, TriangleIds, Velocity, VisitsAllLights};
pub use camera_view::CameraView;
pub use capacity::Counter;
pub use draws::{Cull, CullOn, DrawOrder, DrawParams};
pub use effects::{
    Effects, Indirect, IndirectEffect, MAX_DISPLACEMENT_MM, MAX_TESSELLATE_PX, MIN_TESSELLATE_PX, Post,
    PostEffect, ShadowEffect, Shadows, TessellationEffect, Transparency, TransparencyEffect,
};
pub use error::TechniqueError;
pub use frame::{DrawCommands, Frame, SceneBuffers, check_range, find_shader, in_rows};
pub use inputs::{ChangesWith, View, ViewChoice, ViewInput, ViewInputs, ViewScript};
pub use params::{ParamError, ParamInfo, ParamKind, ParamSet, Params};
pub use scene::{
    SceneGpu,
    lights::{SceneLights, device_order},
};
pub use settings::Settings;
pub use slots::{Slots, SourceSlots, set_constants};
pub use technique::{
    ANY_SAMPLES, Answers, AppendixA, Approximation, Condition, Exactness, Info, MULTIPLE_SAMPLES, Need,
    Source, Technique, completed, exactness_of, params_of, set_param,
};
pub use time::{BEFORE_HISTORY, BEFORE_VIEW, FrameTime, ViewBefore};
pub use upload::put;
pub use views::LightPairs;
