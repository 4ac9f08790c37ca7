//! Stages: the parts that techniques are put together from, each with its shaders beside it.
//!
//! | room | question that it answers |
//! | --- | --- |
//! | [`surfaces`] | what geometry leaves behind, and how a surface that was kept is shaded |
//! | [`lights`] | how surfaces find their lights |
//! | [`views`] | debug views: what a technique did in each pixel |
//! | [`shared`] | work that a frame does once for every technique: a light's view, its shadows, the indirect light that it gives; a sort |
//! | [`compose`] | what a frame ends in: transparent surfaces, tone map, filters |
//!
//! Arrows run one way: `compose` → `views`, `surfaces` → `lights` → `shared`'s maps by the board alone; [`shared::sort`] lies below all. No stage knows a technique.

pub mod compose;
pub mod lights;
pub mod shared;
pub mod surfaces;
pub mod views;

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
