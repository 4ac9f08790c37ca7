//! Compiles the triangle's shaders.

use afterlight_shader::build::Builder;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    Builder::new()
        .folder("triangle", "src/triangle")
        .emit(std::path::Path::new(&std::env::var("OUT_DIR")?))?;
    Ok(())
}
