//! How far the surface of each pixel has moved on screen since the frame before.

use afterlight_frame::{Frame, TechniqueError, Velocity};
use afterlight_graph::{BufferRole, Graph, ImageHandle, PassRole, gpu::vk};

use crate::surfaces::velocity;

/// Declares the passes that find velocities, which are kept as [`velocity::VELOCITY`], and turn them into colours.
///
/// # Errors
/// A shader that is not compiled in, the device.
pub fn velocity_colors(graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
    velocity::record(graph, frame)?;
    let info = frame.image_info(vk::Format::R16G16B16A16_SFLOAT);
    let target = graph.image("view/velocity", BufferRole::Targets, info);
    let Some(Velocity(velocity)) = frame.board.take() else { return Ok(target) };
    let mut pass =
        frame.compute(graph, "view/velocity", PassRole::Upkeep, &frame.shader("views/velocity.comp")?);
    pass.read("velocity", &velocity);
    let target = pass.write("hdr", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    graph.keep(&velocity);
    frame.board.put(Velocity(velocity));
    Ok(target)
}
