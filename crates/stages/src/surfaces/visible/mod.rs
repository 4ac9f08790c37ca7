//! What every sample shows: the pass over the scene, or its rasterisation in compute, that techniques begin with which
//! fetch triangles by their IDs.

use afterlight_graph::{BufferHandle, BufferRole, Graph, ImageHandle, Load, PassRole, gpu::vk};

use crate::{
    lights::cells,
    surfaces::{
        compute_raster::{self, ComputeRasterParams},
        geometry::SceneDraws,
    },
};
use afterlight_frame::{Frame, Slots, TechniqueError};

/// What a pixel without a surface holds in an image of triangle IDs: `NO_TRIANGLE`, all ones.
pub const NO_TRIANGLE_RGBA8: [f32; 4] = [1.0; 4];

/// What samples show, as `surfaces/visible/triangles.glsl` reads it: triangle IDs, or keys of [`compute_raster`].
pub enum Visible {
    /// Triangle IDs, four bytes as RGBA8, and depth, of `samples` samples a pixel.
    Ids {
        /// `draw << 10 | triangle`.
        ids: ImageHandle,
        /// Reversed.
        depth: ImageHandle,
        /// Samples a pixel.
        samples: u32,
    },
    /// Depth and place in the order of draws.
    Keys {
        /// A key a sample.
        keys: BufferHandle,
        /// Samples a pixel.
        samples: u32,
    },
}

impl Visible {
    /// Declares what finds the triangles at `samples` samples a pixel: the passes of [`compute_raster`] where the
    /// parameters say so, else the pass `technique/ids`.
    ///
    /// # Errors
    /// Those of [`compute_raster::is_chosen`] and [`compute_raster::rasterize`].
    pub fn find(
        graph: &mut Graph,
        frame: &Frame<'_>,
        technique: &'static str,
        raster: ComputeRasterParams,
        samples: u32,
    ) -> Result<Self, TechniqueError> {
        if compute_raster::is_chosen(frame, technique, raster.visibility)? {
            let keys = compute_raster::rasterize(graph, frame, technique, raster.small_px, samples)?;
            return Ok(Self::Keys { keys, samples });
        }
        let name = |part: &str| format!("{technique}/{part}");
        let image = |format| frame.image_info(format).samples(samples);
        let ids = graph.image(&name("ids"), BufferRole::Visibility, image(vk::Format::R8G8B8A8_UNORM));
        let depth = graph.image(&name("depth"), BufferRole::Depth, image(vk::Format::D32_SFLOAT));
        let surfaces = SceneDraws::new(
            frame,
            ("surfaces/geometry/surface.vert#position", Some("surfaces/visible/ids.frag#rgba8")),
            ("surfaces/geometry/surface.vert#uv", "surfaces/visible/ids.frag#rgba8-mask"),
        )?;
        let mut pass = graph.raster(&name("ids"), PassRole::Geometry);
        frame.bind_scene(&mut pass);
        let ids = pass.color(ids, Load::Clear(NO_TRIANGLE_RGBA8));
        let depth = pass.depth(depth, Load::Clear(0.0));
        surfaces.draw(frame, &mut pass);
        pass.finish();
        Ok(Self::Ids { ids, depth, samples })
    }

    /// Where the surfaces stand.
    pub fn surfaces(&self) -> cells::VisibleDepths<'_> {
        match self {
            Self::Ids { depth, samples, .. } => cells::VisibleDepths::of_depth(depth, *samples),
            Self::Keys { keys, samples } => cells::VisibleDepths::of_keys(keys, *samples),
        }
    }

    /// Samples a pixel.
    pub fn samples(&self) -> u32 {
        match self {
            Self::Ids { samples, .. } | Self::Keys { samples, .. } => *samples,
        }
    }

    /// Tag of shader variants that read it, with a separator before it; empty for the plain one.
    pub fn tag(&self, separator: char) -> String {
        match self {
            Self::Ids { samples: 1, .. } => format!("{separator}one"),
            Self::Ids { .. } => String::new(),
            Self::Keys { .. } => format!("{separator}keys"),
        }
    }

    /// Tag of a variant that reads it, after another tag that may be empty: `refs-one`.
    pub fn tag_after(&self, before: &str) -> String {
        match before {
            "" => self.tag('-').trim_start_matches('-').to_owned(),
            _ => format!("{before}{}", self.tag('-')),
        }
    }

    /// Binds what shaders read of it. Slots that no shader of the pass has stay unused.
    pub fn bind(&self, frame: &Frame<'_>, pass: &mut (impl Slots + ?Sized)) {
        match self {
            Self::Ids { ids, depth, .. } => {
                pass.read_image("ids", ids);
                pass.read_image("gbuffer_depth", depth);
            }
            Self::Keys { keys, .. } => {
                pass.read_buffer("SampleKeys", keys);
                pass.read_buffer("DrawCommands", &frame.buffers.commands);
            }
        }
    }
}
