//! The last stage of every frame: linear radiance to the image that is shown.

use afterlight_graph::{Graph, ImageHandle, gpu::vk};

use crate::{error::TechniqueError, frame::Frame, view};

/// Declares the pass `present/tonemap`: Khronos PBR Neutral, sRGB, 8 bits; debug views, which are colours already, keep
/// theirs. Compute, since a full-screen fragment pass
/// would cost more on devices whose raster part is small.
///
/// # Errors
/// A shader that is not compiled in.
pub fn present(
    graph: &mut Graph,
    frame: &Frame<'_>,
    hdr: &ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let target = graph.image("final color", frame.image_info(vk::Format::R8G8B8A8_UNORM));
    graph.mark_output(&target);
    let shader = match frame.shows(view::FINAL) {
        true => frame.shader("present/tonemap.comp")?,
        false => frame.shader("present/tonemap.comp#colors")?,
    };
    let mut pass = frame.compute(graph, "present/tonemap", &shader);
    pass.read("hdr", hdr);
    let target = pass.write("final_color", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(target)
}
