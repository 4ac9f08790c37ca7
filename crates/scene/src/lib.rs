//! Scenes: glTF and OBJ loading, built-in scenes, cameras, camera paths, lights.
//!
//! [`load_source`] takes what the command line takes: a file name or `builtin:NAME?key=value`.
//! Whatever the source, the result is a [`Scene`]: packed vertices, triangle lists, materials,
//! images that are not yet decoded ([`texture::decode`] does that), nodes, cameras and lights.

pub mod animation;
pub mod builtin;
pub mod camera;
mod deform;
mod error;
mod gltf;
pub mod lights;
mod load;
mod memory;
mod model;
mod mtl;
mod obj;
mod origin;
mod path;
pub mod points;
mod pose;
pub mod rng;
mod tangent;
pub mod texture;

pub use deform::{
    Deformation, Influences, JOINTS_PER_SET, JOINTS_PER_VERTEX_MAX, JointBounds, MorphTarget, Shape,
    ShapePose, Skin,
};
pub use error::SceneError;
pub use load::{LoadOptions, load, load_bytes, load_source};
pub use memory::{
    ImageHandle, InstanceHandle, LightHandle, MaterialHandle, MeshHandle, MeshSource, SceneBuilder,
};
pub use model::*;
pub use pose::{Attachment, Moment, Pose};
