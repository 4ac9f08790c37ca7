//! Depth alone first, then forward shading of what is visible: by a loop over all lights, or by the lists of lights of a light step.

mod by_cells;

pub use by_cells::ForwardByCells;

use afterlight_frame::{Frame, OpaqueDepth, TechniqueError, views::INVOCATIONS};
use afterlight_graph::{
    BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole, RasterPass, StencilFace, StencilTest, gpu::vk,
};

use crate::{
    lights::step::LightStep,
    surfaces::{RadianceTarget, geometry::SceneDraws},
};

/// Lets the first fragment of a pixel pass and no other: where two surfaces have one depth, the first drawn wins, as in a
/// pass with a `GREATER` depth test.
pub const FIRST_FRAGMENT: StencilTest = {
    let face = StencilFace {
        compare: vk::CompareOp::NOT_EQUAL,
        fail: vk::StencilOp::KEEP,
        depth_fail: vk::StencilOp::KEEP,
        pass: vk::StencilOp::REPLACE,
    };
    StencilTest { front: face, back: face, compare_mask: 0xff, write_mask: 0xff }
};

/// Declares the pass `technique/depth`: depth, reversed, of the frame's samples, and a stencil of zeros for [`FIRST_FRAGMENT`].
///
/// # Errors
/// A shader that is not compiled in.
pub fn draw_depth(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
) -> Result<ImageHandle, TechniqueError> {
    let name = format!("{technique}/depth");
    let depth = graph.image(&name, BufferRole::Depth, frame.multisampled_info(frame.depth_stencil_format()));
    Ok(SceneDraws::depth_only(frame)?.fill_depth(graph, frame, (&name, PassRole::DepthPrepass), depth))
}

/// Declares the pass `technique/shade`: surfaces where `depth`, of [`draw_depth`], is equal, each shaded by `shader`, which ends in
/// `shade_visible.glsl`, and its variant `#mask`, with these specialization constants. `bind_lights` binds what leads to the lights.
/// Returns radiance, the samples of a pixel averaged.
///
/// # Errors
/// A shader that is not compiled in.
pub fn shade_visible(
    graph: &mut Graph,
    frame: &Frame<'_>,
    (technique, shader): (&str, &str),
    depth: ImageHandle,
    constants: Vec<(String, u32)>,
    bind_lights: impl FnOnce(&mut RasterPass<'_>),
) -> Result<ImageHandle, TechniqueError> {
    let target = RadianceTarget::new(graph, frame, technique);
    let mut shaded = SceneDraws::shaded(frame, shader, &format!("{shader}#mask"))?
        .depth(DepthTest::EQUAL)
        .stencil(FIRST_FRAGMENT, 1);
    shaded.constants = constants;
    let mut pass = graph.raster(&format!("{technique}/shade"), PassRole::Shading);
    frame.bind_scene(&mut pass);
    bind_lights(&mut pass);
    let radiance = target.attach(frame, &mut pass);
    let depth = pass.stencil(depth, Load::Keep);
    shaded.draw(frame, &mut pass);
    pass.finish();
    frame.board.put(OpaqueDepth(depth));
    Ok(radiance)
}

/// SceneDraws shaded by a loop over all lights; they count their fragments where that is to be shown.
pub fn shaded_surfaces(frame: &Frame<'_>) -> Result<SceneDraws, TechniqueError> {
    match frame.shows(INVOCATIONS) {
        true => SceneDraws::shaded(
            frame,
            "surfaces/depth_first/forward.frag#count",
            "surfaces/depth_first/forward.frag#mask-count",
        ),
        false => SceneDraws::shaded(
            frame,
            "surfaces/depth_first/forward.frag",
            "surfaces/depth_first/forward.frag#mask",
        ),
    }
}

/// Declares the pass `technique/shade`: forward shading where depth, which [`draw_depth`] has drawn, is equal. Returns
/// radiance, the samples of a pixel averaged.
///
/// # Errors
/// A shader that is not compiled in.
pub fn shade_forward(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    depth: ImageHandle,
    step: &LightStep,
) -> Result<ImageHandle, TechniqueError> {
    let shader = (technique, "surfaces/depth_first/by_lights.frag");
    shade_visible(graph, frame, shader, depth, step.constants(), |pass| step.bind(frame, pass))
}
