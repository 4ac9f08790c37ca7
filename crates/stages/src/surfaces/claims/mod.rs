//! Claims: how fragments that come in any order share the samples of a pixel among surfaces of one depth.

use afterlight_frame::Frame;
use afterlight_graph::{BufferHandle, BufferRole, Graph, PassRole, StencilFace, StencilTest, gpu::vk};

/// Passes where no fragment before has set the stencil bit, and leaves it.
pub const NOT_TAKEN: StencilTest = {
    let face = StencilFace { compare: vk::CompareOp::NOT_EQUAL, ..StencilFace::KEEP };
    StencilTest { front: face, back: face, compare_mask: 0xff, write_mask: 0 }
};

/// Declares the claims by which masked surfaces of one depth share the samples of a pixel (`claims.glsl`); none where the scene
/// has no masked surfaces.
pub fn claims(graph: &mut Graph, frame: &Frame<'_>, technique: &str, samples: u32) -> Option<BufferHandle> {
    frame.scene.has_masked().then(|| {
        let bits = if samples > 8 { 16 } else { 8 };
        let pixels = u64::from(frame.width_px) * u64::from(frame.height_px);
        let claims = graph.buffer(
            &format!("{technique}/claims"),
            BufferRole::Claims,
            4 * (pixels * bits).div_ceil(32),
        );
        graph.clear_buffer(&format!("{technique}/clear claims"), PassRole::Geometry, claims, 0)
    })
}
