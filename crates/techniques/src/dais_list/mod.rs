//! `dais-list`: DAIS with per-pixel lists of references instead of multisampled ones.

// ORDER: 150

use afterlight_graph::{Graph, ImageHandle, Load};

use crate::{
    Answers, AppendixA, Exactness, Frame, Info, MULTIPLE_SAMPLES, Need, ParamInfo, ParamKind, Params, Source,
    Technique, TechniqueError,
    cost::{self, Cost, Workload},
    dais::{self, Cache, ScenePasses},
    dais_multirate::{FULL_RATE, LowRate, SHARE},
    depth_prepass::FIRST_FRAGMENT,
    gbuffer_list::{self, NOT_TAKEN},
    multisample, triangle_buffer, view,
};

/// The technique.
pub static TECHNIQUE: DaisList = DaisList;

/// See the module.
pub struct DaisList;

const NODES: ParamInfo = ParamInfo {
    key: "nodes",
    summary: "nodes of the lists; auto: as many as the view needs, counted; fixed: what finds none is dropped and told",
    kind: ParamKind::AutoOrInteger { min: 0, max: 1 << 30 },
    default: "auto",
};

/// Most triangles that a node's 28 bits tell apart.
const REFERENCES_MAX: u32 = 1 << 28;
/// Pixels for each node that the first frame of a view has room for: it is run to count what the view needs.
const FIRST_GUESS_PIXELS: u64 = 64;

static INFO: Info = Info {
    id: "dais-list",
    title: "DAIS with per-pixel lists",
    summary: "A head a pixel refers to a triangle, or to a list where several share the pixel: depth alone is stored at every sample.",
    sources: &[Source { key: "schied-2015", section: "4.1" }],
    answers: Answers {
        surface: "per-pixel lists of triangle references, and a triangle buffer",
        lights: "loop over all, or tiles",
        schedule: "compute, a thread a pixel",
        resolve: "once a triangle, weighted by coverage",
    },
    appendix_a: AppendixA {
        id: "D++",
        intersect: "dec",
        transparency: "n",
        hardware_msaa: "y",
        light_access: "seq",
        material_access: "seq",
        rates_decoupled: "y, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 45.0 },
    params: &[multisample::LIGHTS, NODES, dais::CACHE_BUCKETS, FULL_RATE, SHARE],
    needs: &[Need { name: "post-depth coverage", test: |features| features.post_depth_coverage }],
    samples: MULTIPLE_SAMPLES,
    tessellation: true,
    views: view::TRIANGLES,
};

impl Technique for DaisList {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::dais_list(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let pixels = u64::from(frame.width_px) * u64::from(frame.height_px);
        let fixed: Option<u32> = frame.params.text(&INFO, NODES.key).parse().ok();
        let first_guess = u32::try_from(pixels / FIRST_GUESS_PIXELS).unwrap_or(u32::MAX);
        let capacity = fixed.unwrap_or_else(|| frame.capacity("nodes", first_guess));
        let limit = frame.features().max_storage_buffer_range;
        if 8 * u64::from(capacity) > limit {
            let what = "dais-list: bytes of nodes".to_owned();
            return Err(TechniqueError::TooLarge { what, found: 8 * u64::from(capacity), limit });
        }
        let depth =
            graph.image("dais-list/depth", frame.multisampled_info(frame.small_depth_stencil_format()));
        let heads = graph.buffer("dais-list/heads", 4 * pixels);
        let nodes = graph.buffer("dais-list/nodes", 8 * u64::from(capacity.max(1)));
        let node_count = graph.buffer("dais-list/node count", 8);
        let heads = graph.clear_buffer("dais-list/clear heads", heads, 0);
        let node_count = graph.clear_buffer("dais-list/clear node count", node_count, 0);
        let claims = gbuffer_list::claims(graph, frame, INFO.id, frame.samples);
        let cache = Cache::new(graph, frame, &INFO);
        let list = triangle_buffer::List::new(graph, frame, INFO.id, REFERENCES_MAX)?;
        let mut passes = ScenePasses::new(graph, frame, &INFO, "dais_list/fill.frag", &[])?;
        let fill = &mut passes.fill;
        (fill.stencil, fill.stencil_reference) = (Some(FIRST_FRAGMENT), 1);
        fill.masked_stencil = Some(NOT_TAKEN);
        fill.constants = cache.constants(&list);
        fill.constants.push(("SAMPLES".to_owned(), frame.samples));
        fill.constants.push(("NODE_CAPACITY".to_owned(), capacity));

        let mut pass = graph.raster("dais-list/depth");
        frame.bind_scene(&mut pass);
        let depth = pass.depth(depth, Load::Clear(0.0));
        pass.stencil_clear(0);
        passes.depth.draw(frame, &mut pass);
        pass.finish();

        let mut pass = graph.raster("dais-list/fill");
        frame.bind_scene(&mut pass);
        let depth = pass.stencil(depth, Load::Keep);
        let heads = pass.write("Heads", heads);
        let nodes = pass.write("Nodes", nodes);
        let node_count = pass.write("NodeCount", node_count);
        let _claims = claims.map(|claims| pass.write("SampleClaims", claims));
        cache.bind(&mut pass);
        let list = list.written_by(&mut pass);
        passes.draw_fill(frame, &mut pass);
        pass.finish();

        let triangles = list.derivatives(graph, frame, INFO.id)?;
        frame.watch(graph, "nodes", &node_count, capacity, fixed.is_some());
        let rate = LowRate::chosen(frame, &INFO)?;
        dais::shade(graph, frame, &INFO, rate.as_ref(), "dais-nodes", &triangles, |pass| {
            pass.read("gbuffer_depth", &depth).read("Heads", &heads).read("Nodes", &nodes);
            triangles.bind(pass);
        })
    }
}
