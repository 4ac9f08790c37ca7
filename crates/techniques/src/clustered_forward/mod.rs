//! `clustered-forward`: depth first, lists of lights of the clusters that hold a surface, then forward shading.

// ORDER: 64

use afterlight_graph::{DepthTest, Graph, ImageHandle, Load, gpu::vk};

use crate::{
    Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
    clusters::{self, Grid},
    cost::{Cost, Workload, clustered_forward},
    depth_prepass::{FIRST_FRAGMENT, draw_depth},
    geometry::Surfaces,
};

/// The technique.
pub static TECHNIQUE: ClusteredForward = ClusteredForward;

/// See the module.
pub struct ClusteredForward;

static INFO: Info = Info {
    id: "clustered-forward",
    title: "Clustered forward shading",
    summary: "A pass for depth alone; each part of the view that holds a surface lists its lights; then forward shading by the lists.",
    sources: &[Source { key: "petrescu-2016", section: "4.10" }, Source { key: "olsson-2012", section: "3" }],
    answers: Answers {
        surface: "nothing (depth)",
        lights: "clusters",
        schedule: "fragment shader",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "CF",
        intersect: "exp",
        transparency: "y",
        hardware_msaa: "y",
        light_access: "rand",
        material_access: "seq",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    params: clusters::PARAMS,
    needs: &[],
    samples: &[1],
    tessellation: true,
    views: &[],
};

impl Technique for ClusteredForward {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        clustered_forward(workload, Grid::of_params(params, &INFO).most_pixels())
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        record(graph, frame, INFO.id, Grid::of_params(frame.params, &INFO))
    }
}

/// Declares depth, lists and forward shading of the technique of that name.
///
/// # Errors
/// As [`clusters::build`].
pub(crate) fn record(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    grid: Grid,
) -> Result<ImageHandle, TechniqueError> {
    let name = |what: &str| format!("{technique}/{what}");
    let depth = draw_depth(graph, frame, technique)?;
    let radiance = graph.image(&name("radiance"), frame.image_info(vk::Format::R16G16B16A16_SFLOAT));
    let lists = clusters::build(graph, frame, technique, grid, &depth)?;
    let mut shaded =
        Surfaces::shaded(frame, "clustered_forward/shade.frag", "clustered_forward/shade.frag#mask")?
            .depth(DepthTest::EQUAL)
            .stencil(FIRST_FRAGMENT, 1);
    shaded.constants.extend(lists.constants().map(|(constant, value)| (constant.to_owned(), value)));
    let mut pass = graph.raster(&name("shade"));
    frame.bind_scene(&mut pass);
    lists.bind(&mut pass);
    let radiance = pass.color(radiance, Load::Clear(frame.background()));
    let _depth = pass.stencil(depth, Load::Keep);
    shaded.draw(frame, &mut pass);
    pass.finish();
    Ok(radiance)
}
