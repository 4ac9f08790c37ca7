//! The stage that fills the G-buffer and what reads it.
//!
//! | image | format | content |
//! | --- | --- | --- |
//! | accumulation | RGBA16F | radiance that needs no light; lights are added |
//! | base colour | RGBA8 sRGB | base colour; alpha: metalness |
//! | normal | RG16 | world space, octahedral |
//! | roughness | R8 | 0 where no light is taken |
//! | depth | D32F | reversed |
//!
//! 21 bytes a pixel, 8 of them the accumulation (Petrescu et al. 2016, Figure 1).

use afterlight_graph::{BufferRole, ComputePass, Graph, ImageHandle, Load, PassRole, RasterPass, gpu::vk};

use crate::{lights::step::LightStep, surfaces::geometry::SceneDraws};
use afterlight_frame::{Frame, OpaqueDepth, Slots, SurfaceNormals, TechniqueError, set_constants};

/// Handles of a filled G-buffer.
pub struct GBuffer {
    /// Linear radiance so far, RGBA16F.
    pub accumulation: ImageHandle,
    /// Base colour and metalness.
    pub base_color: ImageHandle,
    /// Octahedral normal.
    pub normal: ImageHandle,
    /// Roughness.
    pub roughness: ImageHandle,
    /// Depth, perhaps with stencil.
    pub depth: ImageHandle,
}

/// Declares the pass `technique/gbuffer`.
///
/// # Errors
/// A shader that is not compiled in.
pub fn fill(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    depth_format: vk::Format,
) -> Result<GBuffer, TechniqueError> {
    let surfaces =
        SceneDraws::shaded(frame, "surfaces/gbuffer/gbuffer.frag", "surfaces/gbuffer/gbuffer.frag#mask")?;
    Ok(fill_by(graph, frame, technique, depth_format, |pass| surfaces.draw(frame, pass)))
}

/// Declares the pass `technique/gbuffer` with other draws than those of all surfaces.
pub fn fill_by(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    depth_format: vk::Format,
    draw: impl FnOnce(&mut RasterPass<'_>),
) -> GBuffer {
    let image = |graph: &mut Graph, name: &str, role, format| {
        graph.image(&format!("{technique}/{name}"), role, frame.image_info(format))
    };
    let accumulation = image(graph, "accumulation", BufferRole::Targets, vk::Format::R16G16B16A16_SFLOAT);
    let base_color = image(graph, "base color", BufferRole::Surfaces, vk::Format::R8G8B8A8_SRGB);
    let normal = image(graph, "normal", BufferRole::Surfaces, vk::Format::R16G16_UNORM);
    let roughness = image(graph, "roughness", BufferRole::Surfaces, vk::Format::R8_UNORM);
    let depth = image(graph, "depth", BufferRole::Depth, depth_format);

    let mut pass = graph.raster(&format!("{technique}/gbuffer"), PassRole::Geometry);
    frame.bind_scene(&mut pass);
    let filled = GBuffer {
        accumulation: pass.color(accumulation, Load::Clear(frame.background())),
        // Depth 0 tells what holds nothing: the others need no clear.
        base_color: pass.color(base_color, Load::DontCare),
        normal: pass.color(normal, Load::DontCare),
        roughness: pass.color(roughness, Load::DontCare),
        depth: pass.depth(depth, Load::Clear(0.0)),
    };
    draw(&mut pass);
    pass.finish();
    filled
}

/// Binds what `include/gbuffer.glsl` reads.
pub fn bind(pass: &mut impl Slots, gbuffer: &GBuffer) {
    pass.read_image("gbuffer_depth", &gbuffer.depth);
    pass.read_image("gbuffer_base_color", &gbuffer.base_color);
    pass.read_image("gbuffer_normal", &gbuffer.normal);
    pass.read_image("gbuffer_roughness", &gbuffer.roughness);
}

/// Declares the pass `technique/shade`: adds the lights that every pixel's surface visits to the accumulation, which is returned.
///
/// # Errors
/// A shader that is not compiled in.
pub fn shade(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    filled: GBuffer,
    step: &LightStep,
) -> Result<ImageHandle, TechniqueError> {
    shade_by(graph, frame, (technique, "surfaces/gbuffer/shade.comp"), filled, |pass| {
        step.bind(frame, pass);
        set_constants(pass, step.constants());
    })
}

/// The same by a compute shader that ends in `shade_pixels.glsl`; `bind_lights` binds what leads to the lights.
///
/// # Errors
/// A shader that is not compiled in.
pub fn shade_by(
    graph: &mut Graph,
    frame: &Frame<'_>,
    (technique, shader): (&str, &str),
    filled: GBuffer,
    bind_lights: impl FnOnce(&mut ComputePass<'_>),
) -> Result<ImageHandle, TechniqueError> {
    let mut pass =
        frame.compute(graph, &format!("{technique}/shade"), PassRole::Shading, &frame.shader(shader)?);
    bind(&mut pass, &filled);
    bind_lights(&mut pass);
    let radiance = pass.write("hdr", filled.accumulation);
    pass.dispatch(frame.groups(8));
    pass.finish();
    frame.board.put(OpaqueDepth(filled.depth));
    frame.board.put(SurfaceNormals(filled.normal));
    Ok(radiance)
}
