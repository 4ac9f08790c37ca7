//! `gbuffer-list`: a G-buffer of per-pixel lists that holds each visible surface of a pixel once (Fridvalszky and Tóth 2020).

// ORDER: 130

mod filter;
mod params;

pub use params::{DepthEdges, Fill, Filter, FilterParams, GbufferListParams, Pointer, Position, Region};

pub mod cost;

use afterlight_graph::{BufferHandle, BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    ANY_SAMPLES, Answers, AppendixA, Approximation, Condition, Exactness, Frame, Info, OpaqueDepth, Params,
    Source, Technique, TechniqueError, params::Words, set_constants,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::{cells, step},
    surfaces::claims::{NOT_TAKEN, claims},
    surfaces::{depth_first::FIRST_FRAGMENT, geometry::SceneDraws, shade, visible::Visible},
    surfaces::{samples, shade::SurfaceSource},
};

/// The technique.
pub static TECHNIQUE: GbufferList = GbufferList;

/// See the module.
pub struct GbufferList;

static INFO: Info = Info {
    id: "gbuffer-list",
    title: "G-buffer of per-pixel lists",
    summary: "Each visible surface of a pixel stands once, in a block of 144 bits, or the paper's 112; blocks beyond the first are linked on demand.",
    sources: &[Source { key: "fridvalszky-2020", section: "3 to 5" }],
    answers: Answers {
        surface: "G-buffer, per-pixel lists",
        lights: step::ANSWER,
        schedule: "compute, a thread a pixel",
        resolve: "once a triangle, weighted by coverage",
    },
    appendix_a: AppendixA {
        id: "DAA",
        intersect: "imp",
        transparency: "n",
        hardware_msaa: "y",
        light_access: "seq",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 45.0 },
    approximations: &[Approximation {
        when: &[Condition::SeveralSamples, Condition::Param("position", "depth")],
        bound: "light that changes within a pixel differs, where forward takes it at the pixel's centre",
        min_psnr_db: 25.0,
    }],
    departures: &[
        "lists are filled in compute; the paper's second raster pass is fill=raster",
        "blocks hold the view distance at the pixel's centre; the paper's depth at a sample is position=depth",
        "surfaces visit the lights of their cluster where there are more than 16; the paper's loop over all is lights=all",
        "the filter depth-edges takes distances over the nearest; the paper's range of depths is depth-edges=range",
    ],
    needs: &[samples::STANDARD_LOCATIONS],
    samples: ANY_SAMPLES,
    tessellation: false,
    views: shade::VIEWS,
};

/// Most blocks that a narrow pointer tells apart: 26 bits of index.
const NARROW_BLOCKS_MAX: u64 = 1 << 26;
/// Most samples that a narrow pointer tells apart: 3 bits.
const NARROW_SAMPLES_MAX: u32 = 8;
/// Samples a pixel that the first frame of a view is given room for: a quarter of the pixels lie on edges.
const FIRST_GUESS_PIXELS: u32 = 4;

/// Whether pointers of 32 bits name so many blocks, of so many samples.
fn fits_narrow(blocks: u64, samples: u32) -> bool {
    blocks <= NARROW_BLOCKS_MAX && samples <= NARROW_SAMPLES_MAX
}

/// How the blocks of a frame are laid out.
struct Layout {
    /// Samples a pixel. One where no pixel may hold more than its own block and compute fills: then more have no use.
    samples: u32,
    /// Dynamic blocks.
    capacity: u32,
    /// The capacity is the user's: what finds no block is dropped.
    is_fixed: bool,
    /// 32-bit words of a pointer: 1 or 2.
    pointer_words: u32,
    distance_words: u32,
    emission_words: u32,
    /// No filter and no bound drops samples.
    keeps_all: bool,
    blocks: u64,
}

impl Layout {
    fn new(frame: &Frame<'_>, params: &GbufferListParams) -> Result<Self, TechniqueError> {
        let pixels = u64::from(frame.width_px) * u64::from(frame.height_px);
        let fixed = params.blocks.fixed();
        let first_guess = u32::try_from(pixels / u64::from(FIRST_GUESS_PIXELS)).unwrap_or(u32::MAX);
        let capacity = fixed.unwrap_or_else(|| frame.capacity("blocks", first_guess));
        let blocks = pixels + u64::from(capacity);
        let by_compute = params.fill == Fill::Compute;
        let samples = if capacity == 0 && fixed.is_some() && by_compute { 1 } else { frame.samples };
        let narrow = fits_narrow(blocks, samples);
        let pointer_words = match (params.pointer, narrow) {
            (Pointer::Narrow, false) => {
                return Err(TechniqueError::Conflict {
                    technique: INFO.id,
                    found: format!("pointer=narrow with {samples} samples and {blocks} blocks"),
                    expected: format!(
                        "at most {NARROW_SAMPLES_MAX} samples and {NARROW_BLOCKS_MAX} blocks, or pointer=wide"
                    ),
                });
            }
            (Pointer::Wide, _) | (Pointer::Auto, false) => 2,
            (Pointer::Auto | Pointer::Narrow, true) => 1,
        };
        let in_block = params.position == Position::Distance;
        Ok(Self {
            samples,
            capacity,
            is_fixed: fixed.is_some(),
            pointer_words,
            distance_words: u32::from(in_block),
            emission_words: u32::from(frame.scene.has_emission),
            keeps_all: fixed.is_none() && params.filter.filters == Words::NONE,
            blocks,
        })
    }

    /// Words of two interleaved blocks: seven in the paper (Figure 3).
    fn pair_words(&self) -> u32 {
        5 + 2 * (self.pointer_words + self.distance_words + self.emission_words)
    }

    /// Bytes of all blocks. An error where a shader cannot reach them through one binding.
    fn bytes(&self, frame: &Frame<'_>) -> Result<u64, TechniqueError> {
        let words = self.blocks.div_ceil(2) * u64::from(self.pair_words());
        let limit = frame.features().max_storage_buffer_range.min(4 * u64::from(u32::MAX));
        if 4 * words > limit {
            return Err(TechniqueError::TooLarge {
                what: format!(
                    "gbuffer-list: bytes of {} blocks of {} bits",
                    self.blocks,
                    16 * self.pair_words()
                ),
                found: 4 * words,
                limit,
            });
        }
        Ok(4 * words)
    }

    fn constants(&self) -> [(&'static str, u32); 3] {
        [
            ("POINTER_WORDS", self.pointer_words),
            ("DISTANCE_WORDS", self.distance_words),
            ("EMISSION_WORDS", self.emission_words),
        ]
    }
}

/// The lists of a frame: blocks, and the counter of dynamic ones.
struct Lists {
    blocks: BufferHandle,
    count: BufferHandle,
    samples: Samples,
}

/// Where the samples' depths are.
enum Samples {
    Depth(ImageHandle),
    Keys(BufferHandle),
}

impl Samples {
    /// Where the surfaces stand.
    fn surfaces(&self, samples: u32) -> cells::VisibleDepths<'_> {
        match self {
            Self::Keys(keys) => cells::VisibleDepths::of_keys(keys, samples),
            Self::Depth(depth) => cells::VisibleDepths::of_depth(depth, samples),
        }
    }
}

impl Technique for GbufferList {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(GbufferListParams::default())
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        cost::gbuffer_list(workload, params.typed::<GbufferListParams>().fill == Fill::Compute)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let params = frame.params.typed::<GbufferListParams>();
        let layout = Layout::new(frame, params)?;
        let lists = match params.fill {
            Fill::Raster => fill_by_raster(graph, frame, &layout, &params.filter)?,
            Fill::Compute => fill_by_compute(graph, frame, &layout, params)?,
        };
        frame.watch(graph, "blocks", &lists.count, layout.capacity, layout.is_fixed);
        let tag = match &lists.samples {
            Samples::Keys(_) => "keys",
            Samples::Depth(_) if layout.samples == 1 => "one",
            Samples::Depth(_) => "",
        };
        let radiance = shade::shade(
            graph,
            frame,
            (INFO.id, params.light_step().method(frame)),
            SurfaceSource {
                folder: "gbuffer_list",
                tag,
                shading_tag: None,
                shading_constants: &[],
                samples: layout.samples,
            },
            &lists.samples.surfaces(layout.samples),
            &|pass| {
                set_constants(pass, layout.constants());
                pass.constant("KEEPS_ALL", u32::from(layout.keeps_all));
                pass.read_buffer("Blocks", &lists.blocks);
                match &lists.samples {
                    Samples::Depth(depth) => pass.read_image("gbuffer_depth", depth),
                    Samples::Keys(keys) => pass.read_buffer("SampleKeys", keys),
                }
            },
        )?;
        if let Samples::Depth(depth) = lists.samples {
            frame.board.put(OpaqueDepth(depth));
        }
        Ok(radiance)
    }
}

/// Blocks and counter, cleared.
fn empty_lists(
    graph: &mut Graph,
    frame: &Frame<'_>,
    layout: &Layout,
    objects: &str,
) -> Result<(BufferHandle, BufferHandle, BufferHandle), TechniqueError> {
    let blocks = graph.buffer("gbuffer-list/blocks", BufferRole::SurfaceListNodes, layout.bytes(frame)?);
    let count = graph.buffer("gbuffer-list/block count", BufferRole::SurfaceListNodes, 8);
    let flagged = frame.table(
        graph,
        "gbuffer-list/flagged draws",
        BufferRole::Scene,
        &filter::flagged_draws(frame.scene, objects),
    )?;
    let blocks = graph.clear_buffer("gbuffer-list/clear blocks", PassRole::Geometry, blocks, 0);
    let count = graph.clear_buffer("gbuffer-list/clear count", PassRole::Geometry, count, 0);
    Ok((blocks, count, flagged))
}

/// Specialization constants of shaders that build the lists.
fn build_constants(frame: &Frame<'_>, layout: &Layout, filter: &FilterParams) -> Vec<(String, u32)> {
    if frame.eye_moved_m != 0.0 {
        frame.holds_for_this_view();
    }
    let mut all = filter::constants(filter, frame.eye_moved_m);
    all.extend(layout.constants().map(|(name, value)| (name.to_owned(), value)));
    all.push(("SAMPLES".to_owned(), layout.samples));
    all.push(("BLOCK_CAPACITY".to_owned(), layout.capacity));
    all
}

/// The triangle of every sample, then a thread a pixel that writes its list.
fn fill_by_compute(
    graph: &mut Graph,
    frame: &Frame<'_>,
    layout: &Layout,
    params: &GbufferListParams,
) -> Result<Lists, TechniqueError> {
    let visible = Visible::find(graph, frame, INFO.id, params.raster, layout.samples)?;
    let (blocks, count, flagged) = empty_lists(graph, frame, layout, &params.filter.objects)?;
    let shader = frame.shader(&format!("gbuffer_list/fill.comp{}", visible.tag('#')))?;
    let mut pass = frame.compute(graph, "gbuffer-list/fill", PassRole::Geometry, &shader);
    set_constants(&mut pass, build_constants(frame, layout, &params.filter));
    visible.bind(frame, &mut pass);
    pass.read("SingleSampleDraws", &flagged);
    let blocks = pass.write("Blocks", blocks);
    let count = pass.write("BlockCount", count);
    pass.dispatch(frame.groups(8));
    pass.finish();
    let samples = match visible {
        Visible::Ids { depth, .. } => Samples::Depth(depth),
        Visible::Keys { keys, .. } => Samples::Keys(keys),
    };
    Ok(Lists { blocks, count, samples })
}

/// A depth pre-pass, then fragments that write themselves where they show (the paper's section 3).
fn fill_by_raster(
    graph: &mut Graph,
    frame: &Frame<'_>,
    layout: &Layout,
    filter: &FilterParams,
) -> Result<Lists, TechniqueError> {
    if !frame.features().post_depth_coverage {
        return Err(TechniqueError::Unavailable {
            technique: INFO.id,
            missing: "post-depth coverage for fill=raster (fill=compute does without)".to_owned(),
        });
    }
    if filter.filters.contains(Filter::Edges) {
        return Err(TechniqueError::Conflict {
            technique: INFO.id,
            found: "filter=edges with fill=raster, where a fragment does not know the other surfaces of its pixel".to_owned(),
            expected: "filter=depth-edges, or fill=compute".to_owned(),
        });
    }
    let depth = graph.image(
        "gbuffer-list/depth",
        BufferRole::Depth,
        frame.multisampled_info(frame.depth_stencil_format()),
    );
    let depth_only = SceneDraws::depth_only(frame)?;
    let (opaque, masked) = match layout.samples {
        1 => ("gbuffer_list/fill.frag#one", "gbuffer_list/fill.frag#one-mask"),
        _ => ("gbuffer_list/fill.frag", "gbuffer_list/fill.frag#mask"),
    };
    let mut fill = SceneDraws::shaded(frame, opaque, masked)?
        .depth(DepthTest::EQUAL)
        // Section 4.3: one bit of stencil against double writes of intersecting triangles.
        .stencil(FIRST_FRAGMENT, 1);
    // Masked surfaces keep off what opaque ones have, and share the rest by claims.
    fill.masked_stencil = Some(NOT_TAKEN);
    fill.constants = build_constants(frame, layout, filter);
    let (blocks, count, flagged) = empty_lists(graph, frame, layout, &filter.objects)?;
    let claims = claims(graph, frame, INFO.id, layout.samples);

    let depth = depth_only.fill_depth(graph, frame, ("gbuffer-list/depth", PassRole::DepthPrepass), depth);

    let mut pass = graph.raster("gbuffer-list/fill", PassRole::Geometry);
    frame.bind_scene(&mut pass);
    pass.read("gbuffer_depth", &depth).read("SingleSampleDraws", &flagged);
    let blocks = pass.write("Blocks", blocks);
    let count = pass.write("BlockCount", count);
    let _claims = claims.map(|claims| pass.write("SampleClaims", claims));
    let depth = pass.stencil(depth, Load::Keep);
    fill.draw(frame, &mut pass);
    pass.finish();
    Ok(Lists { blocks, count, samples: Samples::Depth(depth) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_pointers_name_2_to_the_26_blocks_of_8_samples() {
        assert!(fits_narrow(1 << 26, 8));
        assert!(!fits_narrow((1 << 26) + 1, 8) && !fits_narrow(1, 16));
    }
}
