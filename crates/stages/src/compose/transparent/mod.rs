//! Surfaces with alpha blending, over the opaque image of any technique: sorted back to front, shaded forward.
//! See the README of this folder.

use afterlight_graph::{
    Blend, BlendEquation, BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole, RasterPass, gpu::vk,
};

use crate::{
    lights::step::LightStep,
    surfaces::{geometry::SceneDraws, shade},
};
use afterlight_frame::{
    Frame, OpaqueDepth, SceneGpu, Settings, TechniqueError, Transparency, VisitsAllLights, scene::Bucket,
    views,
};

mod device;
mod list;

pub use list::BlendedList;
use list::OrderedTriangles;

/// Whether a frame of those settings shows surfaces with alpha blending: debug views are of what the technique did.
fn is_drawn(settings: &Settings, scene: &SceneGpu) -> bool {
    settings.effects.transparency.order == Transparency::Sorted
        && settings.view == views::FINAL
        && scene.rest.blended.triangle_count() > 0
}

/// Declares the passes that draw blended surfaces over the opaque radiance `hdr` of a technique; returns its next version. Where the board
/// says so ([`VisitsAllLights`]) every fragment visits every light.
///
/// # Errors
/// A shader that is not compiled in.
pub fn draw(
    graph: &mut Graph,
    frame: &Frame<'_>,
    list: &BlendedList,
    hdr: ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let depth = opaque_depth(graph, frame)?;
    let lights = match frame.board.has::<VisitsAllLights>() {
        true => LightStep::All,
        false => LightStep::anywhere(
            graph,
            frame,
            "shared/transparent",
            (PassRole::Transparency, BufferRole::Transparency),
        )?,
    };
    let drawn = BlendedDraws { lights, triangles: list.declare(graph, frame)? };
    if frame.samples == 1 {
        let mut pass = graph.raster("shared/transparent", PassRole::Transparency);
        frame.bind_scene(&mut pass);
        let hdr = pass.color(hdr, Load::Keep);
        pass.depth_read_only(&depth);
        drawn.draw(frame, &mut pass, OVER_RADIANCE)?;
        pass.finish();
        return Ok(hdr);
    }
    let format = vk::Format::R16G16B16A16_SFLOAT;
    let samples =
        graph.image("shared/transparent samples", BufferRole::Transparency, frame.multisampled_info(format));
    let layers = graph.image("shared/transparent layers", BufferRole::Transparency, frame.image_info(format));
    let mut pass = graph.raster("shared/transparent", PassRole::Transparency);
    frame.bind_scene(&mut pass);
    let _samples = pass.color(samples, Load::Clear([0.0, 0.0, 0.0, 1.0]));
    let layers = pass.resolve(layers);
    pass.depth_read_only(&depth);
    drawn.draw(frame, &mut pass, OVER_LAYERS)?;
    pass.finish();

    let composite = shade::full_screen(frame, "compose/transparent/composite.frag", &[])?
        .blend(vec![LAYERS_OVER_RADIANCE]);
    let mut pass = graph.raster("shared/transparent composite", PassRole::Transparency);
    pass.read("layers", &layers);
    let hdr = pass.color(hdr, Load::Keep);
    shade::draw_full_screen(&mut pass, composite, 0);
    pass.finish();
    Ok(hdr)
}

/// The depth that the technique handed over, or a pass that draws it: where no technique's does, or it is not that of the frame.
fn opaque_depth(graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
    let image = frame.multisampled_info(vk::Format::D32_SFLOAT);
    let fits = |depth: &ImageHandle| {
        let found = depth.info();
        (found.width, found.height, found.samples) == (image.width, image.height, image.samples)
    };
    if let Some(OpaqueDepth(depth)) = frame.board.take().filter(|OpaqueDepth(depth)| fits(depth)) {
        return Ok(depth);
    }
    let depth = graph.image("shared/transparent depth", BufferRole::Transparency, image);
    Ok(SceneDraws::depth_only(frame)?.fill_depth(
        graph,
        frame,
        ("shared/transparent depth", PassRole::Transparency),
        depth,
    ))
}

/// A sorted list as the graph knows it, and how its surfaces find their lights.
struct BlendedDraws {
    lights: LightStep,
    triangles: OrderedTriangles,
}

impl BlendedDraws {
    /// Adds all of them to a pass in one call, so that their order is that of the list. The state is one for all: the shader drops
    /// what culling would.
    fn draw(&self, frame: &Frame<'_>, pass: &mut RasterPass<'_>, blend: Blend) -> Result<(), TechniqueError> {
        let shader = "compose/transparent/blend.frag";
        let mut surfaces = SceneDraws::shaded(frame, shader, shader)?.depth(NEARER).blend(vec![blend]);
        surfaces.constants = self.lights.constants();
        self.lights.bind(frame, pass);
        let draw = surfaces.bucket_draw(frame, Bucket::DOUBLE_SIDED, self.triangles.call());
        pass.draw(draw.index_buffer(&self.triangles.indices, vk::IndexType::UINT32));
        Ok(())
    }
}

/// In front of the opaque surfaces; where both have one depth, the opaque one is drawn first and stays.
const NEARER: DepthTest = DepthTest { compare: vk::CompareOp::GREATER, write: false };

const RGB: vk::ColorComponentFlags = vk::ColorComponentFlags::from_raw(
    vk::ColorComponentFlags::R.as_raw()
        | vk::ColorComponentFlags::G.as_raw()
        | vk::ColorComponentFlags::B.as_raw(),
);

/// A surface of alpha a and radiance L over what is there: C' = a L + (1 - a) C. Of layers, the alpha is their transmittance: the
/// product of all 1 - a.
const OVER: BlendEquation = BlendEquation {
    src_color: vk::BlendFactor::SRC_ALPHA,
    dst_color: vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
    color_op: vk::BlendOp::ADD,
    src_alpha: vk::BlendFactor::ZERO,
    dst_alpha: vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
    alpha_op: vk::BlendOp::ADD,
};
const OVER_RADIANCE: Blend = Blend { equation: Some(OVER), write_mask: RGB };
const OVER_LAYERS: Blend = Blend { equation: Some(OVER), write_mask: vk::ColorComponentFlags::RGBA };

/// All layers over opaque radiance C: C' = their sum + transmittance C.
const LAYERS_OVER_RADIANCE: Blend = Blend {
    equation: Some(BlendEquation {
        src_color: vk::BlendFactor::ONE,
        dst_color: vk::BlendFactor::SRC_ALPHA,
        ..OVER
    }),
    write_mask: RGB,
};
