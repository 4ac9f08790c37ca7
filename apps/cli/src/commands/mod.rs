//! One module a command.

pub mod bench;
pub mod compare;
pub mod completions;
pub mod devices;
pub mod render;
pub mod scene;
pub mod techniques;
