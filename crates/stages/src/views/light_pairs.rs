//! Pairs of a light and a surface that a technique tests, and those of them that are lit.
//!
//! Where they are counted, `light_radiance` and what stands beside it in `include/shading.glsl` give counts in the place of radiance, and
//! nothing else gives any: the image that a technique ends in, whatever way it sums lights, holds two counts a pixel.

use afterlight_frame::{Frame, TechniqueError, views::LIGHT_ERROR};
use afterlight_graph::{BufferRole, Graph, ImageHandle, PassRole, gpu::vk};

/// Declares the pass that turns the counts into colours.
///
/// # Errors
/// A shader that is not compiled in.
pub fn light_pair_colors(
    graph: &mut Graph,
    frame: &Frame<'_>,
    counts: &ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let target = graph.image(
        "view/light pairs",
        BufferRole::Targets,
        frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
    );
    let mut pass =
        frame.compute(graph, "view/light-pairs", PassRole::Upkeep, &frame.shader("views/light_pairs.comp")?);
    pass.constant("LIGHT_ERROR", u32::from(frame.shows(LIGHT_ERROR)));
    pass.read("light_pairs", counts);
    let target = pass.write("hdr", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(target)
}
