//! Compiles the technique's shaders; shared GLSL (`#include "gbuffer.glsl"`) comes with the crate.

use afterlight_shader::{build::Builder, structs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    Builder::new()
        .layouts(structs::LAYOUTS)
        .folder("toon", "src/toon")
        .emit(std::path::Path::new(&std::env::var("OUT_DIR")?))?;
    Ok(())
}
