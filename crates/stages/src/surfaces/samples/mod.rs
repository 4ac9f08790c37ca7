//! Multisampled G-buffers: attributes of the surface that every sample shows.
//!
//! [`fill_samples`] fills 16 bytes a sample, depth included: base colour and metalness, normal, roughness, occlusion, an edge mark, the depth at
//! the pixel's centre (Fridvalszky and Tóth 2020, section 3). [`fill`] fills any other layout. Scenes with emissive surfaces take four bytes more.

mod params;

pub use params::{EdgeParams, Edges, Position, PositionParams};

use afterlight_frame::{Approximation, Condition, Frame, Need, Slots, TechniqueError};
use afterlight_graph::{BufferHandle, BufferRole, Graph, ImageHandle, Load, PassRole, gpu::vk};

use crate::{lights::cells, surfaces::geometry::SceneDraws};

/// Positions are reconstructed where the samples stand.
pub const STANDARD_LOCATIONS: Need =
    Need { name: "standard sample locations", test: |features| features.standard_sample_locations };

/// What lighting surfaces at their samples comes to, for [`afterlight_frame::Info::approximations`] of techniques with [`PositionParams`].
pub const AT_SAMPLES: Approximation = Approximation {
    when: &[Condition::Param("position", "sample")],
    bound: "light that changes within a pixel is averaged, where forward takes it at the pixel's centre",
    min_psnr_db: 25.0,
};

/// A multisampled G-buffer: the depth, and other images with the names of their slots.
pub struct SampleBuffer {
    /// Depth, reversed.
    pub depth: ImageHandle,
    /// Other images by slot.
    pub images: Vec<(&'static str, ImageHandle)>,
}

/// An image of a multisampled G-buffer.
#[derive(Clone, Copy)]
pub struct SampleImage {
    /// Slot by which shaders read it; its name is made from it.
    pub slot: &'static str,
    /// What it holds.
    pub role: BufferRole,
    /// Format.
    pub format: vk::Format,
    /// What it holds where no surface is drawn.
    pub load: Load<[f32; 4]>,
}

impl SampleImage {
    /// An image of attributes of surfaces that nobody reads where there is no surface.
    pub const fn attributes(slot: &'static str, format: vk::Format) -> Self {
        Self { slot, role: BufferRole::Surfaces, format, load: Load::DontCare }
    }
}

impl SampleBuffer {
    /// Where its surfaces stand.
    pub fn surfaces(&self, frame: &Frame<'_>) -> cells::VisibleDepths<'_> {
        cells::VisibleDepths::of_depth(&self.depth, frame.samples)
    }

    /// Binds what a source of surfaces reads.
    pub fn bind(&self, pass: &mut (impl Slots + ?Sized)) {
        pass.read_image("gbuffer_depth", &self.depth);
        for (slot, image) in &self.images {
            pass.read_image(slot, image);
        }
    }
}

/// Name of a shader's variant for the scene: with emission where a surface emits.
pub fn emission_variant(frame: &Frame<'_>, name: &str) -> String {
    let tag = if name.contains('#') { "-emission" } else { "#emission" };
    if frame.scene.has_emission { format!("{name}{tag}") } else { name.to_owned() }
}

/// Declares the pass `technique/gbuffer` that fills 16 bytes a sample, depth included.
///
/// # Errors
/// A shader that is not compiled in.
pub fn fill_samples(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
) -> Result<SampleBuffer, TechniqueError> {
    let surfaces = SceneDraws::new(
        frame,
        (
            "surfaces/geometry/surface.vert#centroid",
            Some(&emission_variant(frame, "surfaces/samples/samples.frag")),
        ),
        (
            "surfaces/geometry/surface.vert#centroid",
            &emission_variant(frame, "surfaces/samples/samples.frag#mask"),
        ),
    )?;
    let images = [
        SampleImage::attributes("gbuffer_base_color", vk::Format::R8G8B8A8_SRGB),
        SampleImage::attributes("gbuffer_normal", vk::Format::R16G16_UNORM),
        SampleImage {
            // Samples without a surface are no edge.
            load: Load::Clear([0.0; 4]),
            ..SampleImage::attributes("gbuffer_roughness", vk::Format::R8G8B8A8_UNORM)
        },
    ];
    fill(graph, frame, technique, &surfaces, &images, None)
}

/// Declares the pass `technique/gbuffer` that draws `surfaces` into the images, an image of emission beside them where a surface emits, and
/// a depth buffer. `triangle_count` is bound where a geometry shader numbers triangles.
///
/// # Errors
/// A shader that is not compiled in.
pub fn fill(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    surfaces: &SceneDraws,
    images: &[SampleImage],
    triangle_count: Option<BufferHandle>,
) -> Result<SampleBuffer, TechniqueError> {
    let mut images = images.to_vec();
    if frame.scene.has_emission {
        images.push(SampleImage::attributes("gbuffer_emission", vk::Format::B10G11R11_UFLOAT_PACK32));
    }
    let mut declared = Vec::new();
    for SampleImage { slot, role, format, load } in images {
        let name = format!("{technique}/{}", slot.trim_start_matches("gbuffer_").replace('_', " "));
        declared.push((slot, graph.image(&name, role, frame.multisampled_info(format)), load));
    }
    let depth = graph.image(
        &format!("{technique}/depth"),
        BufferRole::Depth,
        frame.multisampled_info(vk::Format::D32_SFLOAT),
    );

    let mut pass = graph.raster(&format!("{technique}/gbuffer"), PassRole::Geometry);
    frame.bind_scene(&mut pass);
    if let Some(count) = triangle_count {
        let _count = pass.write("TriangleNumbers", count);
    }
    let images = declared.into_iter().map(|(slot, image, load)| (slot, pass.color(image, load))).collect();
    let depth = pass.depth(depth, Load::Clear(0.0));
    surfaces.draw(frame, &mut pass);
    pass.finish();
    Ok(SampleBuffer { depth, images })
}

/// Tag of variants with emission, for [`super::shade::SurfaceSource`]; `None` where no surface emits.
pub fn emission_tag(frame: &Frame<'_>) -> Option<&'static str> {
    frame.scene.has_emission.then_some("emission")
}
