//! The last stage of every frame: linear radiance to the image that is shown.

use afterlight_graph::{Graph, ImageHandle, gpu::vk};

use crate::{error::TechniqueError, frame::Frame};

/// Declares the pass `present/tonemap`: Khronos PBR Neutral, sRGB, 8 bits. Compute, since a full-screen fragment pass
/// would cost more on devices whose raster part is small.
///
/// # Errors
/// A shader that is not compiled in.
pub fn tonemap(
    graph: &mut Graph,
    frame: &Frame<'_>,
    hdr: &ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let target = graph.image("final color", frame.image_info(vk::Format::R8G8B8A8_UNORM));
    graph.mark_output(&target);
    let shader = frame.shader("present/tonemap.comp")?;
    let mut pass = frame.compute(graph, "present/tonemap", &shader);
    pass.read("hdr", hdr);
    let target = pass.write("final_color", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(target)
}
