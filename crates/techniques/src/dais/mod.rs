//! `dais`: deferred attribute interpolation shading: triangle IDs at every sample, visible triangles stored once.

// ORDER: 140

mod low_rate;
mod params;
mod passes;

pub(crate) use low_rate::LowRate;
pub use low_rate::{Rate, RateParams, Share};
pub use params::{CacheParams, DaisParams, Fill, FillParams};
pub(crate) use passes::{FillPass, depth_surfaces};

pub mod cost;

use afterlight_graph::{BufferHandle, BufferRole, Graph, ImageHandle, Load, PassRole, RasterPass, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    ANY_SAMPLES, Answers, AppendixA, Approximation, Condition, Exactness, Frame, Info, OpaqueDepth, Params,
    Source, SourceSlots, Technique, TechniqueError, TriangleIds, views,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::{
        cells,
        step::{self, LightMethod},
    },
    surfaces::shade::SurfaceSource,
    surfaces::{
        claims,
        compute_raster::{ComputeRasterParams, Visibility},
        shade,
        triangles::{self, RecordParams, Records},
        visible::NO_TRIANGLE_RGBA8,
        visible::Visible,
    },
    views::RecordSource,
};

/// The technique.
pub static TECHNIQUE: Dais = Dais;

/// See the module.
pub struct Dais;

/// Most triangles that the cache and a visibility sample's 32 bits tell apart: the highest bit marks entries without a place.
const REFERENCES_MAX: u32 = (1 << 31) - 1;
/// Most samples of a visibility sample's coverage mask.
const COVERAGE_SAMPLES_MAX: u32 = 8;
/// Polls of a locked bucket before a triangle is stored once more. The lock is held for some tens of instructions.
const POLLS: u32 = 32;

/// The memoization cache of a frame (section 4.1).
pub(crate) struct Cache {
    entries: BufferHandle,
    locks: BufferHandle,
    stored_ids: BufferHandle,
    buckets: u32,
}

impl Cache {
    /// Declares an empty cache for triangles that are stored in a list.
    pub fn new(
        graph: &mut Graph,
        technique: &str,
        CacheParams { buckets }: CacheParams,
        list: &triangles::List,
    ) -> Self {
        let mut buffer = |part: &str, words: u64| {
            graph.buffer(&format!("{technique}/{part}"), BufferRole::MemoizationCache, 4 * words)
        };
        let entries = buffer("cache entries", 2 * u64::from(buckets));
        let locks = buffer("cache locks", u64::from(buckets));
        let stored_ids = buffer("stored ids", u64::from(list.capacity.max(1)));
        Self {
            entries: graph.clear_buffer(&format!("{technique}/clear cache"), PassRole::Geometry, entries, 0),
            locks: graph.clear_buffer(&format!("{technique}/clear locks"), PassRole::Geometry, locks, 0),
            stored_ids,
            buckets,
        }
    }

    /// Specialization constants of `dais/memoize.glsl`.
    pub fn constants(&self, list: &triangles::List) -> Vec<(String, u32)> {
        let mut constants = list.constants();
        let own = [("CACHE_BUCKETS", self.buckets), ("POLLS", POLLS)];
        constants.extend(own.map(|(name, value)| (name.to_owned(), value)));
        constants
    }

    /// Binds it to the pass whose fragments store triangles.
    pub fn written_by(self, pass: &mut RasterPass<'_>) -> Self {
        let entries = pass.write("CacheEntries", self.entries);
        let locks = pass.write("CacheLocks", self.locks);
        Self { entries, locks, stored_ids: pass.write("StoredIds", self.stored_ids), ..self }
    }
}

/// The row of the visibility buffer, which is nearest.
pub(crate) const APPENDIX_A: AppendixA = AppendixA {
    id: "D++",
    intersect: "dec",
    transparency: "n",
    hardware_msaa: "y",
    light_access: "seq",
    material_access: "seq",
    rates_decoupled: "y, n",
};

static INFO: Info = Info {
    id: "dais",
    title: "Deferred attribute interpolation shading",
    summary: "Samples hold triangle IDs; triangles that show are stored once, by screen-space derivatives, and shaded once a pixel.",
    sources: &[
        Source { key: "schied-2015", section: "3, 4" },
        Source { key: "liktor-2012", section: "4" },
        Source { key: "schueler-2007", section: "all" },
    ],
    answers: Answers {
        surface: "triangle IDs and a triangle buffer",
        lights: step::ANSWER,
        schedule: "compute, a thread a pixel",
        resolve: "once a triangle",
    },
    appendix_a: APPENDIX_A,
    exactness: Exactness::Exact { min_psnr_db: 45.0 },
    approximations: &[DERIVATIVE_TANGENTS],
    departures: &[
        "the triangle buffer is filled once the visibility buffer is finished, each triangle once; the paper's memoization cache is fill=cache",
        KEPT_TANGENTS,
        QUAD_GRADIENTS,
        "derivatives are homogeneous, so that triangles behind the eye need no clip",
    ],
    samples: ANY_SAMPLES,
    views: views::TRIANGLES,
    ..Info::USUAL
};

impl Technique for Dais {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(DaisParams::default())
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        match params.typed::<FillParams>().fill {
            Fill::Cache => cost::dais_cached(workload, params.typed::<RecordParams>().floats()),
            Fill::Auto | Fill::Resolve => cost::dais(workload, params.typed::<RecordParams>().floats()),
        }
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let params = frame.params.typed::<DaisParams>();
        let lights = params.light_step().method(frame);
        let asked = Asked { technique: INFO.id, lights, rate: None };
        record(graph, frame, &asked, (params.fill, params.record, params.raster))
    }
}

/// The paper's tangents, of every technique of this family.
pub(crate) const DERIVATIVE_TANGENTS: Approximation = Approximation {
    when: &[Condition::Param("tangents", "derivatives")],
    bound: "normal maps are turned where texture coordinates bend, have no area or are not those of the file's tangents",
    min_psnr_db: 10.0,
};

/// What records hold beyond the paper's, of every technique of this family.
pub(crate) const KEPT_TANGENTS: &str = "records keep the vertices' tangents in scenes with normal maps; the paper's, found from derivatives, are tangents=derivatives";

/// How techniques of this family choose mip levels.
pub(crate) const QUAD_GRADIENTS: &str = "mip levels follow the differences of texture coordinates within a quad of pixels, as in a raster pass; the paper's follow derivatives at the pixel";

/// How a technique of this family shades what it has found.
pub(crate) struct Asked {
    /// The technique, whose name passes have.
    pub technique: &'static str,
    /// How surfaces find their lights.
    pub lights: LightMethod,
    /// Indirect light at a low rate, where that is asked for.
    pub rate: Option<LowRate>,
}

/// Declares the passes of `dais` for a technique, the triangle buffer filled and triangles found as the parameters say.
///
/// # Errors
/// What the device lacks, parameters that do not go together, more triangles than one binding holds.
pub(crate) fn record(
    graph: &mut Graph,
    frame: &Frame<'_>,
    asked: &Asked,
    (fill, records, raster): (FillParams, RecordParams, ComputeRasterParams),
) -> Result<ImageHandle, TechniqueError> {
    if is_cached(frame, asked.technique, fill.fill, raster.visibility)? {
        return record_cached(graph, frame, asked, (fill, records));
    }
    let visible = Visible::find(graph, frame, asked.technique, raster, frame.samples)?;
    let triangles = triangles::fill(graph, frame, asked.technique, records, &visible)?;
    let tag = visible.tag_after("");
    let bind = |pass: &mut dyn SourceSlots| {
        visible.bind(frame, pass);
        triangles.bind(pass);
    };
    let source = source_of(frame, &tag);
    let radiance = shade(graph, frame, asked, (source, &visible.surfaces()), &triangles.records, &bind)?;
    if let Visible::Ids { ids, depth, .. } = visible {
        frame.board.put(OpaqueDepth(depth));
        frame.board.put(TriangleIds(ids));
    }
    Ok(radiance)
}

/// The source of surfaces of `source_dais.glsl` in the variants with a tag.
fn source_of<'a>(frame: &Frame<'_>, tag: &'a str) -> SurfaceSource<'a> {
    SurfaceSource { folder: "dais", tag, shading_tag: None, shading_constants: &[], samples: frame.samples }
}

/// Declares the shading pass or, where the frame shows a view of `records`, its passes; `bind` binds what `source`, whose surfaces
/// stand where it says, reads.
pub(crate) fn shade(
    graph: &mut Graph,
    frame: &Frame<'_>,
    asked: &Asked,
    (source, surfaces): (SurfaceSource<'_>, &cells::VisibleDepths<'_>),
    records: &Records,
    bind: &dyn Fn(&mut dyn SourceSlots),
) -> Result<ImageHandle, TechniqueError> {
    let Asked { technique, lights, ref rate } = *asked;
    if views::is_of_triangles(frame.view) {
        return RecordSource { technique, source, records, bind }.record(graph, frame);
    }
    let constants = rate.as_ref().map_or(Vec::new(), LowRate::constants);
    let source = SurfaceSource {
        shading_tag: rate.as_ref().map(LowRate::tag),
        shading_constants: &constants,
        ..source
    };
    shade::shade(graph, frame, (technique, lights), source, surfaces, bind)
}

/// Whether fragments store their triangles through the cache: as asked for, and of tessellated surfaces, whose triangles no index
/// leads back to, always.
fn is_cached(
    frame: &Frame<'_>,
    technique: &'static str,
    fill: Fill,
    visibility: Visibility,
) -> Result<bool, TechniqueError> {
    let conflict = |found: &str, expected: &str| {
        Err(TechniqueError::Conflict { technique, found: found.to_owned(), expected: expected.to_owned() })
    };
    let cached = match (fill, frame.tessellate_px.is_some()) {
        (Fill::Resolve, true) => {
            return conflict("fill=resolve with --tessellate", "fill=cache, or auto");
        }
        (Fill::Auto | Fill::Resolve, false) => false,
        (Fill::Auto, true) | (Fill::Cache, _) => true,
    };
    if cached && visibility == Visibility::Compute {
        let found = "visibility=compute where fragments fill the triangle buffer (fill=cache, --tessellate)";
        return conflict(found, "visibility=raster, or auto");
    }
    Ok(cached)
}

/// Whether samples hold 32 bits of reference and no coverage: where there are more triangles than fewer bits tell apart, more
/// samples than a mask has bits, or a device without post-depth coverage.
fn is_wide(frame: &Frame<'_>, reference_bits: u32) -> bool {
    // All ones with full coverage is the background; what finds no place is the one before.
    let narrow_max = (1_u32 << reference_bits).saturating_sub(2);
    triangles::capacity(frame) > narrow_max
        || frame.samples > COVERAGE_SAMPLES_MAX
        || !frame.features().post_depth_coverage
}

/// The paper's pipeline (Figure 3): depth, then fragments that store their triangles through the memoization cache and write
/// references, then derivatives, then Listing 1.
fn record_cached(
    graph: &mut Graph,
    frame: &Frame<'_>,
    asked: &Asked,
    (params, records): (FillParams, RecordParams),
) -> Result<ImageHandle, TechniqueError> {
    let technique = asked.technique;
    let wide = is_wide(frame, params.reference_bits);
    let name = |part: &str| format!("{technique}/{part}");
    let references = name(if wide { "wide references" } else { "references" });
    let references =
        graph.image(&references, BufferRole::Visibility, frame.multisampled_info(vk::Format::R8G8B8A8_UNORM));
    let depth =
        graph.image(&name("depth"), BufferRole::Depth, frame.multisampled_info(frame.depth_stencil_format()));
    let list = triangles::List::new(graph, frame, technique, records, REFERENCES_MAX)?;
    let cache = Cache::new(graph, technique, params.cache, &list);
    let tags = if wide { &["wide"][..] } else { &[] };
    let depth_only = depth_surfaces(frame)?;
    let mut fill = FillPass::new(graph, frame, technique, "dais/fill.frag", tags)?;
    fill.surfaces.constants = cache.constants(&list);
    // Wide references are also for devices that do not tell what a fragment covers after the depth test: there it can claim nothing.
    let mut claims = None;
    if !wide {
        fill.surfaces.constants.push(("SAMPLES".to_owned(), frame.samples));
        claims = claims::claims(graph, frame, technique, frame.samples);
    }

    let depth = depth_only.fill_depth(graph, frame, (&name("depth"), PassRole::DepthPrepass), depth);

    let mut pass = graph.raster(&name("fill"), PassRole::Geometry);
    frame.bind_scene(&mut pass);
    let references = pass.color(references, Load::Clear(NO_TRIANGLE_RGBA8));
    let depth = pass.stencil(depth, Load::Keep);
    let _claims = claims.map(|claims| pass.write("SampleClaims", claims));
    let _cache = cache.written_by(&mut pass);
    let list = list.written_by(&mut pass);
    fill.draw(frame, &mut pass);
    pass.finish();

    let triangles = list.derivatives(graph, frame, technique)?;
    let visible = Visible::Ids { ids: references, depth, samples: frame.samples };
    let tag = visible.tag_after(if wide { "wide" } else { "refs" });
    let source = (source_of(frame, &tag), &visible.surfaces());
    shade(graph, frame, asked, source, &triangles, &|pass| {
        visible.bind(frame, pass);
        triangles.bind(pass);
    })
}
