//! Surfaces with alpha blending, over the opaque image of any technique: sorted back to front on the CPU, shaded forward.
//! See the README of this folder.

use afterlight_graph::{
    Blend, BlendEquation, BufferHandle, BufferRole, DepthTest, DrawCall, Graph, ImageHandle, Load, PassRole,
    RasterPass,
    gpu::{self, vk},
};

use crate::{
    lights::step::LightStep,
    surfaces::{geometry::SceneDraws, shade},
};
use afterlight_frame::{
    CameraView, Frame, OpaqueDepth, SceneGpu, Settings, TechniqueError, Transparency, VisitsAllLights,
    scene::blended::ViewOrder,
    scene::{Bucket, draw_list::COMMAND_BYTES},
    views,
};

/// Triangles that are sorted at most; where the scene has more, draws are.
pub const SORTED_TRIANGLES_MAX: usize = 100_000;

/// Whether a frame of those settings shows surfaces with alpha blending: debug views are of what the technique did.
fn is_drawn(settings: &Settings, scene: &SceneGpu) -> bool {
    settings.effects.transparency.order == Transparency::Sorted
        && settings.view == views::FINAL
        && scene.blended.triangle_count() > 0
}

/// Why the order is coarser than was asked for.
pub fn warning(settings: &Settings, scene: &SceneGpu) -> Option<String> {
    let found = scene.blended.triangle_count();
    (is_drawn(settings, scene) && found > SORTED_TRIANGLES_MAX).then(|| {
        format!(
            "{found} triangles with alpha blending, expected at most {SORTED_TRIANGLES_MAX}: their {} draws are sorted, not they",
            scene.blended.draw_count()
        )
    })
}

/// The triangles with alpha blending that a view needs, in drawing order.
pub struct BlendedList {
    indices: gpu::Buffer,
    commands: gpu::Buffer,
    /// One word: the number of commands.
    count: gpu::Buffer,
    command_count: u32,
    /// Draws in view.
    pub draw_count: u32,
}

impl BlendedList {
    /// Sorts them for a view; `None` where there are none in it, or the settings ask for none.
    ///
    /// # Errors
    /// The device.
    pub fn of_view(
        device: &gpu::Device,
        scene: &SceneGpu,
        settings: &Settings,
        view: &CameraView,
        cull: bool,
    ) -> Result<Option<Self>, gpu::GpuError> {
        if !is_drawn(settings, scene) {
            return Ok(None);
        }
        let ordered = scene.blended.order(&ViewOrder {
            cull: cull.then_some(view.clip_from_world),
            distance_from_world: view.distance_from_world(),
            displacement_m: settings.effects.tessellation.displacement_m(),
            triangles_max: SORTED_TRIANGLES_MAX,
        });
        if ordered.commands.is_empty() {
            return Ok(None);
        }
        let buffer = |name, usage, bytes: &[u8]| {
            let memory = gpu::MemoryKind::Upload;
            let buffer =
                device.create_buffer(&gpu::BufferDesc { name, bytes: bytes.len() as u64, usage, memory })?;
            buffer.write(0, bytes)?;
            Ok::<_, gpu::GpuError>(buffer)
        };
        Ok(Some(Self {
            indices: buffer(
                "blended indices",
                vk::BufferUsageFlags::INDEX_BUFFER,
                bytemuck::cast_slice(&ordered.indices),
            )?,
            commands: buffer(
                "blended draw commands",
                vk::BufferUsageFlags::INDIRECT_BUFFER,
                bytemuck::cast_slice(&ordered.commands),
            )?,
            count: buffer(
                "blended draw count",
                vk::BufferUsageFlags::INDIRECT_BUFFER,
                bytemuck::bytes_of(&(ordered.commands.len() as u32)),
            )?,
            command_count: ordered.commands.len() as u32,
            draw_count: ordered.draw_count,
        }))
    }
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
        indices: graph.import_buffer("blended indices", BufferRole::Scene, &list.indices),
        commands: graph.import_buffer("blended draw commands", BufferRole::Scene, &list.commands),
        count: graph.import_buffer("blended draw count", BufferRole::Scene, &list.count),
        max: list.command_count,
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
    indices: BufferHandle,
    commands: BufferHandle,
    count: BufferHandle,
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
            buffer: &self.commands,
            offset: 0,
            count_buffer: &self.count,
            count_offset: 0,
            max: self.max,
            stride: COMMAND_BYTES as u32,
        };
        let draw = surfaces.bucket_draw(frame, Bucket::DOUBLE_SIDED, call);
        pass.draw(draw.index_buffer(&self.indices, vk::IndexType::UINT32));
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
