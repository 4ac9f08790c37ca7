//! `dais`: deferred attribute interpolation shading: triangle IDs at every sample, visible triangles stored once.

// ORDER: 140

use afterlight_graph::{Graph, ImageHandle, Load, gpu::vk};

use crate::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
    compute_raster,
    cost::{self, Cost, Workload},
    geometry::Surfaces,
    multisample::{self, NO_TRIANGLE_RGBA8},
    triangle_buffer::{self, Visible},
};

/// The technique.
pub static TECHNIQUE: Dais = Dais;

/// See the module.
pub struct Dais;

static INFO: Info = Info {
    id: "dais",
    title: "Deferred attribute interpolation shading",
    summary: "Samples hold triangle IDs; triangles that show are stored once, by screen-space derivatives, and shaded once a pixel.",
    sources: &[Source { key: "schied-2015", section: "3, 4" }],
    answers: Answers {
        surface: "triangle IDs and a triangle buffer",
        lights: "loop over all, or tiles",
        schedule: "compute, a thread a pixel",
        resolve: "once a triangle",
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
    // Texture gradients are analytic.
    exactness: Exactness::Exact { min_psnr_db: 45.0 },
    params: &[multisample::LIGHTS, compute_raster::VISIBILITY, compute_raster::SMALL],
    needs: &[],
    samples: ANY_SAMPLES,
    views: multisample::VIEWS,
};

impl Technique for Dais {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::dais(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let visible = match compute_raster::is_chosen(frame, &INFO)? {
            true => {
                let keys = compute_raster::rasterize(graph, frame, &INFO, frame.samples)?;
                Visible::Keys { keys, samples: frame.samples }
            }
            false => raster_ids(graph, frame)?,
        };
        let triangles = triangle_buffer::fill(graph, frame, INFO.id, &visible)?;
        let source = format!("dais{}", visible.tag('-'));
        let lights = frame.params.text(&INFO, multisample::LIGHTS.key);
        multisample::shade(graph, frame, INFO.id, (&source, frame.samples), lights, |pass| {
            visible.bind(pass, true);
            triangles.bind(pass);
        })
    }
}

/// Declares the pass `dais/ids`: a triangle ID and depth at every sample.
fn raster_ids(graph: &mut Graph, frame: &Frame<'_>) -> Result<Visible, TechniqueError> {
    let ids = graph.image("dais/ids", frame.multisampled_info(vk::Format::R8G8B8A8_UNORM));
    let depth = graph.image("dais/depth", frame.multisampled_info(vk::Format::D32_SFLOAT));
    let surfaces = Surfaces::new(
        frame,
        ("geometry/surface.vert#position", Some("visibility/ids.frag#rgba8")),
        ("geometry/surface.vert#uv", "visibility/ids.frag#rgba8-mask"),
    )?;
    let mut pass = graph.raster("dais/ids");
    frame.bind_scene(&mut pass);
    let ids = pass.color(ids, Load::Clear(NO_TRIANGLE_RGBA8));
    let depth = pass.depth(depth, Load::Clear(0.0));
    surfaces.draw(frame, &mut pass);
    pass.finish();
    Ok(Visible::Ids { ids, depth, samples: frame.samples })
}
