//! `dais-list`: DAIS with per-pixel lists of references instead of multisampled ones.

// ORDER: 150

pub mod cost;
mod params;

pub use params::DaisListParams;

use afterlight_graph::{BufferHandle, BufferRole, Graph, ImageHandle, ImageInfo, Load, PassRole, RasterPass};

use crate::dais::{self, Asked, Cache, CacheParams, FillPass, LowRate};
use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, DrawCommands, Exactness, Frame, Info, MULTIPLE_SAMPLES, Need, Params, Source, SourceSlots,
    Technique, TechniqueError, capacity::FIRST_GUESS, params::AutoOr, scene::DRAW_TRIANGLES, views,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::{cells, step},
    shared::cull,
    surfaces::shade::SurfaceSource,
    surfaces::{
        claims,
        triangles::{self, RecordParams},
    },
};

/// The technique.
pub static TECHNIQUE: DaisList = DaisList;

/// See the module.
pub struct DaisList;

/// Most triangles that the reference of an entry tells apart; all ones is a triangle without a place.
const fn references_max(samples: u32) -> u32 {
    (1 << if samples > 8 { 27 } else { 28 }) - 1
}

/// Checks that references tell the triangles of so many draws apart.
fn check_draws(draws: u64, most: u32) -> Result<(), TechniqueError> {
    let triangles = u64::from(DRAW_TRIANGLES) * draws;
    if triangles > u64::from(most) {
        let what = "dais-list: triangles that a reference tells apart".to_owned();
        return Err(TechniqueError::TooLarge { what, found: triangles, limit: most.into() });
    }
    Ok(())
}

/// Rows that bands are multiples of: whole quads, and tiles of the raster part.
const BAND_ROWS: u32 = 16;
static INFO: Info = Info {
    id: "dais-list",
    title: "DAIS with per-pixel lists",
    summary: "A head a pixel refers to a triangle, or to a list where several share the pixel: depth alone is stored at every sample.",
    sources: &[Source { key: "schied-2015", section: "4.1" }],
    answers: Answers {
        surface: "per-pixel lists of triangle references, and a triangle buffer",
        lights: step::ANSWER,
        schedule: "compute, a thread a pixel",
        resolve: "once a triangle, weighted by coverage",
    },
    appendix_a: dais::APPENDIX_A,
    exactness: Exactness::Exact { min_psnr_db: 45.0 },
    needs: &[Need { name: "post-depth coverage", test: |features| features.post_depth_coverage }],
    approximations: &[dais::DERIVATIVE_TANGENTS],
    departures: &[
        "entries of lists refer to triangles by their IDs, and the first of a pixel takes no node",
        "the image is drawn in bands, so that depth at the samples is held for one of them; the paper's single one is bands=1",
        dais::KEPT_TANGENTS,
        dais::QUAD_GRADIENTS,
    ],
    samples: MULTIPLE_SAMPLES,
    views: views::TRIANGLES,
    ..Info::USUAL
};

impl Technique for DaisList {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(DaisListParams::default())
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        cost::dais_list(workload, params.typed::<RecordParams>().floats())
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let params = frame.params.typed::<DaisListParams>();
        let mut lists = Lists::new(graph, frame, params.nodes)?;
        let mut triangles = Triangles::new(graph, frame, params.cache, params.record)?;
        let rows = band_rows(frame, params.bands);
        // Held for one band: the next one draws over it.
        let info = ImageInfo::new(frame.depth_stencil_format(), frame.width_px, rows);
        let mut depth = graph.image("dais-list/depth", BufferRole::Depth, info.samples(frame.samples));
        for (first_row, number) in (0..frame.height_px).step_by(rows as usize).zip(1..) {
            let end_row = (first_row + rows).min(frame.height_px);
            let draws =
                cull::in_rows(graph, frame, &format!("dais-list/draws {number}"), first_row..end_row)?;
            let band = Band { number, first_row, draws };
            depth = band.draw_depth(graph, frame, depth)?;
            (depth, lists, triangles) = band.fill(graph, frame, depth, lists, triangles)?;
        }
        frame.watch(graph, "nodes", &lists.node_count, lists.capacity, lists.bounded);
        let rate = LowRate::chosen(frame, INFO.id, params.rate)?;
        let asked = Asked { technique: INFO.id, lights: params.light_step().method(frame), rate };
        let tag = if frame.tessellate_px.is_some() { "places" } else { "" };
        let source = SurfaceSource {
            folder: "dais_list",
            tag,
            shading_tag: None,
            shading_constants: &[],
            samples: frame.samples,
        };
        let stored = triangles.store(graph, frame, params.record)?;
        let bind = |pass: &mut dyn SourceSlots| {
            lists.bind(pass);
            stored.bind(pass);
        };
        let surfaces =
            cells::VisibleDepths::of_source((source.folder, tag), frame.samples, |pass| bind(pass));
        dais::shade(graph, frame, &asked, (source, &surfaces), stored.records(), &bind)
    }
}

/// Heads and nodes of a frame.
struct Lists {
    heads: BufferHandle,
    nodes: BufferHandle,
    node_count: BufferHandle,
    drops: BufferHandle,
    claims: Option<BufferHandle>,
    capacity: u32,
    bounded: bool,
}

impl Lists {
    /// Declares empty lists.
    fn new(graph: &mut Graph, frame: &Frame<'_>, nodes: AutoOr<u32>) -> Result<Self, TechniqueError> {
        let pixels = u64::from(frame.width_px) * u64::from(frame.height_px);
        let fixed = nodes.fixed();
        let capacity = fixed.unwrap_or_else(|| frame.capacity("nodes", FIRST_GUESS));
        frame.check_binding(INFO.id, "nodes", 8 * u64::from(capacity))?;
        let zeroed = |graph: &mut Graph, name: &str, role: BufferRole, bytes: u64| {
            let buffer = graph.buffer(&format!("dais-list/{name}"), role, bytes);
            graph.clear_buffer(&format!("dais-list/clear {name}"), PassRole::Geometry, buffer, 0)
        };
        let node_bytes = 8 * u64::from(capacity.max(1));
        let nodes = match frame.scene.draw_count() {
            // No fragment writes a node, and no head leads to one; what is read must have been written all the same.
            0 => zeroed(graph, "nodes", BufferRole::SurfaceListNodes, node_bytes),
            _ => graph.buffer("dais-list/nodes", BufferRole::SurfaceListNodes, node_bytes),
        };
        Ok(Self {
            heads: zeroed(graph, "heads", BufferRole::SurfaceListHeads, 4 * pixels),
            nodes,
            node_count: zeroed(graph, "node count", BufferRole::SurfaceListNodes, 8),
            // Nobody asks what was dropped where nothing can be.
            drops: zeroed(
                graph,
                "sample drops",
                BufferRole::SurfaceListNodes,
                if fixed.is_some() { pixels.next_multiple_of(4) } else { 4 },
            ),
            claims: claims::claims(graph, frame, INFO.id, frame.samples),
            capacity,
            bounded: fixed.is_some(),
        })
    }

    fn written_by(self, pass: &mut RasterPass<'_>) -> Self {
        Self {
            heads: pass.write("Heads", self.heads),
            nodes: pass.write("Nodes", self.nodes),
            node_count: pass.write("NodeCount", self.node_count),
            drops: pass.write("SampleDrops", self.drops),
            claims: self.claims.map(|claims| pass.write("SampleClaims", claims)),
            ..self
        }
    }

    /// Binds what `source_dais_list.glsl` reads.
    fn bind(&self, pass: &mut dyn SourceSlots) {
        pass.read_buffer("Heads", &self.heads);
        pass.read_buffer("Nodes", &self.nodes);
        pass.read_buffer("SampleDrops", &self.drops);
        pass.constant("BOUNDED", u32::from(self.bounded));
    }
}

/// How triangles that show get into the triangle buffer.
enum Triangles {
    /// Bits that fragments set.
    Marked(BufferHandle),
    /// A list that fragments append to through the cache: tessellated triangles, whose IDs lead nowhere.
    Listed { cache: Cache, list: triangles::List },
}

/// Triangles that are stored.
enum Stored {
    Marked(triangles::TriangleBuffer),
    Listed(triangles::Records),
}

impl Triangles {
    fn new(
        graph: &mut Graph,
        frame: &Frame<'_>,
        cache: CacheParams,
        records: RecordParams,
    ) -> Result<Self, TechniqueError> {
        let most = references_max(frame.samples);
        if frame.tessellate_px.is_some() {
            let list = triangles::List::new(graph, frame, INFO.id, records, most)?;
            return Ok(Self::Listed { cache: Cache::new(graph, INFO.id, cache, &list), list });
        }
        check_draws(frame.scene.draw_count() as u64, most)?;
        Ok(Self::Marked(triangles::bits(graph, frame, INFO.id, 0)))
    }

    /// Specialization constants of the fragments that write it.
    fn constants(&self) -> Vec<(String, u32)> {
        match self {
            Self::Marked(_) => Vec::new(),
            Self::Listed { cache, list } => cache.constants(list),
        }
    }

    fn written_by(self, pass: &mut RasterPass<'_>) -> Self {
        match self {
            Self::Marked(bits) => Self::Marked(pass.write("MarkedBits", bits)),
            Self::Listed { cache, list } => {
                Self::Listed { cache: cache.written_by(pass), list: list.written_by(pass) }
            }
        }
    }

    fn store(
        self,
        graph: &mut Graph,
        frame: &Frame<'_>,
        records: RecordParams,
    ) -> Result<Stored, TechniqueError> {
        Ok(match self {
            Self::Marked(bits) => {
                Stored::Marked(triangles::store_marked(graph, frame, (INFO.id, records), bits, false)?)
            }
            Self::Listed { list, .. } => Stored::Listed(list.derivatives(graph, frame, INFO.id)?),
        })
    }
}

impl Stored {
    fn records(&self) -> &triangles::Records {
        match self {
            Self::Marked(buffer) => &buffer.records,
            Self::Listed(records) => records,
        }
    }

    fn bind(&self, pass: &mut dyn SourceSlots) {
        match self {
            Self::Marked(buffer) => buffer.bind(pass),
            Self::Listed(records) => records.bind(pass),
        }
    }
}

/// Rows of a band. Tessellated triangles are numbered anew in each pass, which a cache cannot tell apart: one band.
fn band_rows(frame: &Frame<'_>, bands: u32) -> u32 {
    let bands = match frame.tessellate_px {
        Some(_) => 1,
        None => bands,
    };
    frame.height_px.div_ceil(bands).next_multiple_of(BAND_ROWS).min(frame.height_px)
}

/// Rows of the image that are drawn at once.
struct Band {
    number: u32,
    first_row: u32,
    /// Draws that reach the rows: a vertex of another band costs as much as one of this.
    draws: DrawCommands,
}

impl Band {
    /// Name of a pass over the band.
    fn pass_name(&self, pass: &str) -> String {
        match self.number {
            1 => format!("dais-list/{pass}"),
            number => format!("dais-list/{pass} {number}"),
        }
    }

    /// The whole image, of which attachments hold the band.
    fn viewport(&self, frame: &Frame<'_>) -> [f32; 4] {
        [0.0, -(self.first_row as f32), frame.width_px as f32, frame.height_px as f32]
    }

    fn draw_depth(
        &self,
        graph: &mut Graph,
        frame: &Frame<'_>,
        depth: ImageHandle,
    ) -> Result<ImageHandle, TechniqueError> {
        let surfaces = dais::depth_surfaces(frame)?;
        let mut pass = graph.raster(&self.pass_name("depth"), PassRole::DepthPrepass);
        frame.bind_scene(&mut pass);
        let depth = pass.depth(depth, Load::Clear(0.0));
        pass.stencil_clear(0).viewport(self.viewport(frame));
        surfaces.draw_listed(frame, &mut pass, &self.draws);
        pass.finish();
        Ok(depth)
    }

    fn fill(
        &self,
        graph: &mut Graph,
        frame: &Frame<'_>,
        depth: ImageHandle,
        lists: Lists,
        triangles: Triangles,
    ) -> Result<(ImageHandle, Lists, Triangles), TechniqueError> {
        let mut fill = FillPass::new(graph, frame, INFO.id, "dais_list/fill.frag", &[])?;
        let surfaces = &mut fill.surfaces;
        surfaces.constants = triangles.constants();
        let bounded = u32::from(lists.bounded);
        for (name, value) in
            [("SAMPLES", frame.samples), ("NODE_CAPACITY", lists.capacity), ("BOUNDED", bounded)]
        {
            surfaces.constants.push((name.to_owned(), value));
        }
        surfaces.push = self.first_row.to_le_bytes().to_vec();

        let mut pass = graph.raster(&self.pass_name("fill"), PassRole::Geometry);
        frame.bind_scene(&mut pass);
        let depth = pass.stencil(depth, Load::Keep);
        pass.viewport(self.viewport(frame));
        let lists = lists.written_by(&mut pass);
        let triangles = triangles.written_by(&mut pass);
        fill.draw_listed(frame, &mut pass, &self.draws);
        pass.finish();
        Ok((depth, lists, triangles))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_tell_the_triangles_of_262143_draws_apart() {
        for (samples, draws) in [(8, 262_143), (16, 131_071)] {
            assert!(check_draws(draws, references_max(samples)).is_ok());
            let error = check_draws(draws + 1, references_max(samples)).expect_err("one more").to_string();
            assert!(
                error.contains("dais-list") && error.contains(&(1024 * (draws + 1) - 1).to_string()),
                "{error}"
            );
        }
    }
}
