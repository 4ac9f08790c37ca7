//! What a frame ends in: transparent surfaces over the opaque image, the tone map, and filters after it.

pub mod post;
pub mod present;
pub mod transparent;
