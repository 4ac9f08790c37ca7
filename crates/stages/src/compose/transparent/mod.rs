//! Surfaces with alpha blending, over the opaque image of any technique: sorted back to front on the CPU, shaded forward.
//! See the README of this folder.

use std::sync::Arc;

use afterlight_graph::{
    Blend, BlendEquation, BufferHandle, BufferRole, DepthTest, DrawCall, Graph, ImageHandle, Load, PassRole,
    RasterPass, gpu::vk,
};

use crate::{
    lights::step::LightStep,
    surfaces::{geometry::SceneDraws, shade},
};
use afterlight_frame::{
    ChangesWith, Frame, OpaqueDepth, SceneGpu, Settings, TechniqueError, Transparency, View, VisitsAllLights,
    put,
    scene::blended::{Ordered, ViewOrder},
    scene::{Bucket, draw_list::COMMAND_BYTES},
    views,
};

/// Triangles that are sorted at most; where the scene has more, draws are.
pub const SORTED_TRIANGLES_MAX: usize = 100_000;

/// Whether a frame of those settings shows surfaces with alpha blending: debug views are of what the technique did.
fn is_drawn(settings: &Settings, scene: &SceneGpu) -> bool {
    settings.effects.transparency.order == Transparency::Sorted
        && settings.view == views::FINAL
        && scene.rest.blended.triangle_count() > 0
}

/// Why the order is coarser than was asked for.
pub fn warning(settings: &Settings, scene: &SceneGpu) -> Option<String> {
    let found = scene.rest.blended.triangle_count();
    (is_drawn(settings, scene) && found > SORTED_TRIANGLES_MAX).then(|| {
        format!(
            "{found} triangles with alpha blending, expected at most {SORTED_TRIANGLES_MAX}: their {} draws are sorted, not they",
            scene.rest.blended.draw_count()
        )
    })
}

/// The triangles with alpha blending that a view needs, or all that there are where views change.
pub struct BlendedList {
    index_count: usize,
    command_count: usize,
    /// Draws in view.
    pub draw_count: u32,
    /// Whether draws outside of the view are left out.
    cull: bool,
    /// The order of the only view; `None` where views change.
    order: Option<Arc<Ordered>>,
}

impl BlendedList {
    /// Those of a view; `None` where there are none in it, or the settings ask for none. If the frame `moves`, there is room for every
    /// triangle of the scene.
    pub fn of_view(view: &View<'_>, cull: bool, moves: bool) -> Option<Self> {
        if !is_drawn(view.settings, view.scene) {
            return None;
        }
        let found = ordered(view, cull);
        let draw_count = found.draw_count;
        if moves {
            let triangles = view.placed.blended.triangle_count();
            // A run of triangles of one draw is a command.
            let runs =
                if triangles > SORTED_TRIANGLES_MAX { view.placed.blended.draw_count() } else { triangles };
            let index_count = 3 * triangles;
            return Some(Self { index_count, command_count: runs, draw_count, cull, order: None });
        }
        let (index_count, command_count) = (found.indices.len(), found.commands.len());
        let order = Some(Arc::new(found));
        (command_count > 0).then_some(Self { index_count, command_count, draw_count, cull, order })
    }

    /// Where the commands begin, and their count, in the one buffer that holds indices, commands and count, bytes.
    fn offsets(&self) -> [u64; 2] {
        let commands = 4 * self.index_count as u64;
        [commands, commands + COMMAND_BYTES * self.command_count as u64]
    }

    /// The buffer, filled for each view.
    fn declare(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<BufferHandle, TechniqueError> {
        let usage = vk::BufferUsageFlags::INDEX_BUFFER | vk::BufferUsageFlags::INDIRECT_BUFFER;
        let ([commands_at, count_at], cull, order) = (self.offsets(), self.cull, self.order.clone());
        let how = (count_at + 4, usage, ChangesWith::Camera);
        frame.input(graph, ("blended triangles", BufferRole::Scene), how, move |view, bytes| {
            let of_view;
            let Ordered { indices, commands, .. } = match &order {
                Some(order) => &**order,
                None => {
                    of_view = ordered(view, cull);
                    &of_view
                }
            };
            put(bytes, 0, indices);
            put(bytes, commands_at as usize, commands);
            put(bytes, count_at as usize, &[commands.len() as u32]);
        })
    }
}

/// Sorts the triangles for a view.
fn ordered(view: &View<'_>, cull: bool) -> Ordered {
    view.placed.blended.order(&ViewOrder {
        cull: cull.then_some(view.camera.clip_from_world),
        distance_from_world: view.camera.distance_from_world(),
        displacement_m: view.displacement_m(),
        triangles_max: SORTED_TRIANGLES_MAX,
    })
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
    let drawn = BlendedDraws {
        lights,
        triangles: list.declare(graph, frame)?,
        offsets: list.offsets(),
        max: list.command_count as u32,
    };
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
    /// Indices, then commands, then their count.
    triangles: BufferHandle,
    /// Where commands and count begin, bytes.
    offsets: [u64; 2],
    max: u32,
}

impl BlendedDraws {
    /// Adds all of them to a pass in one call, so that their order is that of the list. The state is one for all: the shader drops
    /// what culling would.
    fn draw(&self, frame: &Frame<'_>, pass: &mut RasterPass<'_>, blend: Blend) -> Result<(), TechniqueError> {
        let shader = "compose/transparent/blend.frag";
        let mut surfaces = SceneDraws::shaded(frame, shader, shader)?.depth(NEARER).blend(vec![blend]);
        surfaces.constants = self.lights.constants();
        self.lights.bind(frame, pass);
        // With a count on the device, as all draws of a frame: after such calls, one without drew nothing on lavapipe.
        let call = DrawCall::IndexedIndirectCount {
            buffer: &self.triangles,
            offset: self.offsets[0],
            count_buffer: &self.triangles,
            count_offset: self.offsets[1],
            max: self.max,
            stride: COMMAND_BYTES as u32,
        };
        let draw = surfaces.bucket_draw(frame, Bucket::DOUBLE_SIDED, call);
        pass.draw(draw.index_buffer(&self.triangles, vk::IndexType::UINT32));
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
