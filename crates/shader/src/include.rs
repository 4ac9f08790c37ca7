//! The GLSL headers of this crate, part of the library so that build scripts elsewhere can include them.

include!(concat!(env!("OUT_DIR"), "/includes.rs"));
