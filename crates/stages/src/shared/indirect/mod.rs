//! Light that surfaces reflect onto each other, for every technique: a reflective shadow map (Dachsbacher and Stamminger 2005).
//!
//! One light sees the scene once a frame, in `shared/rsm`; every texel that it sees is a small light. Whatever shades gathers
//! 64 of them a surface, in `unlit_radiance` of `include/shading.glsl`. See the README of this folder.

use std::f32::consts::{PI, TAU};

use afterlight_graph::{
    BufferHandle, BufferRole, Graph, ImageHandle, ImageInfo, Load, PassRole, Step, gpu::vk,
};
use afterlight_shader::structs::RsmConstants;

use crate::{shared::light_view, surfaces::geometry::SceneDraws};
use afterlight_frame::{Frame, Indirect, SceneGpu, SceneInput, Settings, Slots, TechniqueError};

/// Texels that a surface gathers from.
pub const SAMPLES: usize = 64;

/// Radius of the disc of the map that they are taken from, as a share of its width.
pub const RADIUS: f32 = 0.3;

/// What indirect light is gathered from, as the graph knows it.
struct Rsm {
    constants: BufferHandle,
    /// None where there is no indirect light.
    images: Option<RsmImages>,
}

/// The light's view.
struct RsmImages {
    surface: ImageHandle,
    flux: ImageHandle,
}

/// Says that surfaces of this frame gather indirect light.
pub struct IndirectLight {
    /// Texels that each gathers from.
    pub sample_count: u32,
}

impl SceneInput for Rsm {
    fn bind(&self, frame: &Frame<'_>, pass: &mut dyn Slots) {
        pass.read_buffer("RsmBlock", &self.constants);
        // Without indirect light the compiler removes the code that reads the images but keeps their bindings: images of the same
        // kinds fill them.
        let b = &frame.buffers;
        pass.read_image("rsm_surface", self.images.as_ref().map_or(&b.materials, |i| &i.surface));
        pass.read_image("rsm_flux", self.images.as_ref().map_or(&b.light_spheres, |i| &i.flux));
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        vec![("INDIRECT_SAMPLES", self.images.as_ref().map_or(0, |_| SAMPLES as u32))]
    }
}

/// Why there is no indirect light though it was asked for.
pub fn warning(settings: &Settings, scene: &SceneGpu) -> Option<String> {
    (settings.effects.indirect.method == Indirect::Rsm
        && light_view::source_at_rest(scene, settings).is_none())
    .then(|| "no indirect light: the scene has no light, or no surface, to take it from".to_owned())
}

/// The pattern of all pixels (section 4.1): Hammersley points (ξ1, ξ2) at radius ξ1 and angle 2π ξ2, weighted by ξ1², the weights
/// normalised so that the samples stand for the disc. Offset in shares of the map, area in shares of the map's.
pub fn pattern() -> [[f32; 3]; SAMPLES] {
    let points: [[f32; 2]; SAMPLES] = std::array::from_fn(|i| {
        // ξ1 in the middle of its stratum: a sample at the very centre would have no weight.
        let xi1 = (i as f32 + 0.5) / SAMPLES as f32;
        [xi1, (i as u32).reverse_bits() as f32 / 2f32.powi(32)]
    });
    let weights: f32 = points.iter().map(|[xi1, _]| xi1 * xi1).sum();
    points.map(|[xi1, xi2]| {
        let (sine, cosine) = (TAU * xi2).sin_cos();
        [RADIUS * xi1 * sine, RADIUS * xi1 * cosine, PI * RADIUS * RADIUS * xi1 * xi1 / weights]
    })
}

/// Declares `shared/rsm` where indirect light is asked for and there is a light, and gives the frame what its passes bind.
///
/// # Errors
/// A shader that is not compiled in, the device.
pub fn record(graph: &mut Graph, frame: &mut Frame<'_>, settings: &Settings) -> Result<(), TechniqueError> {
    let source = match settings.effects.indirect.method {
        Indirect::None => None,
        Indirect::Rsm => light_view::source_at_rest(frame.scene, settings),
    };
    let size_px = settings.effects.indirect.map_size_px;
    let images = match &source {
        None => None,
        Some(source) => {
            // The strongest light stays that, wherever surfaces stand.
            let light_index = frame.lights.index_of(&source.light);
            Some(light_view::look_through(graph, frame, ("shared/rsm", size_px), |graph, frame| {
                raster(graph, frame, size_px, light_index)
            })?)
        }
    };
    let is_there = images.is_some();
    let constants = light_view::constants_of_pose(graph, frame, "shared/rsm constants", move |view| {
        let source = light_view::source(view).filter(|_| is_there);
        source.map_or_else(RsmConstants::default, |source| {
            let area_m2 = (2.0 * source.half_height()).powi(2);
            RsmConstants {
                clip_from_world: source.clip_from_world().to_cols_array_2d(),
                samples: pattern().map(|[x, y, share]| [x, y, share * area_m2, 0.0]),
            }
        })
    })?;
    if images.is_some() {
        frame.board.put(IndirectLight { sample_count: SAMPLES as u32 });
    }
    frame.board.add_input(Rsm { constants, images });
    Ok(())
}

/// Rasterises the scene as the light sees it.
fn raster(
    graph: &mut Graph,
    frame: &Frame<'_>,
    size_px: u32,
    light_index: u32,
) -> Result<RsmImages, TechniqueError> {
    let image = |graph: &mut Graph, name: &str, format| {
        graph.image(
            &format!("shared/rsm {name}"),
            BufferRole::Shared,
            ImageInfo::new(format, size_px, size_px),
        )
    };
    let surface = image(graph, "surface", vk::Format::R32G32B32A32_UINT);
    let flux = image(graph, "flux", vk::Format::R16G16B16A16_SFLOAT);
    let depth = image(graph, "depth", vk::Format::D32_SFLOAT);
    let mut surfaces =
        SceneDraws::shaded(frame, "shared/indirect/rsm.frag", "shared/indirect/rsm.frag#mask")?;
    surfaces.push = light_index.to_le_bytes().to_vec();
    let mut pass = graph.raster("shared/rsm", PassRole::Shared);
    frame.bind_scene(&mut pass);
    // A texel without flux gives nothing, wherever it is.
    let images = RsmImages {
        surface: pass.color_uint(surface, Load::Clear([0; 4])),
        flux: pass.color(flux, Load::Clear([0.0; 4])),
    };
    let _depth = pass.depth(depth, Load::Clear(0.0));
    surfaces.draw(frame, &mut pass);
    if frame.scene_moves {
        // Lights that move have other numbers from frame to frame.
        let draws = surfaces.draw_count(frame);
        frame.script_of_view(&mut pass, move |view| {
            let light_index = light_view::source(view).map(|source| view.lights.index_of(&source.light));
            let push = light_index.or(Some(0));
            let again =
                |draw| Step::Draw { draw, scissor: None, stencil_reference: None, push, commands: None };
            (0..draws).map(again).collect()
        });
    }
    pass.finish();
    Ok(images)
}
