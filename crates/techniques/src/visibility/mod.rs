//! `visibility`: triangle IDs, then everything else in compute.

// ORDER: 70

pub mod cost;
mod params;

pub use params::VisibilityParams;

use afterlight_graph::{BufferRole, Graph, ImageHandle, Load, PassRole, gpu::vk};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, OpaqueDepth, Params, Source, SourceSlots, Technique,
    TechniqueError, TriangleIds, set_constants,
};
use afterlight_shader::Shader;
use afterlight_stages::{
    lights::{
        cells::VisibleDepths,
        step::{self, LightStep},
    },
    surfaces::{compute_raster, geometry, shade::add_volumes},
};

/// The technique.
pub static TECHNIQUE: Visibility = Visibility;

/// See the module.
pub struct Visibility;

static INFO: Info = Info {
    id: "visibility",
    title: "Visibility buffer",
    summary: "Surfaces leave four bytes, a triangle ID; compute fetches triangles and shades by lists of lights.",
    sources: &[Source { key: "petrescu-2016", section: "4.11" }, Source { key: "burns-2013", section: "3" }],
    answers: Answers {
        surface: "triangle IDs",
        lights: step::ANSWER,
        schedule: "compute, a thread a pixel",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "D++",
        intersect: "dec",
        transparency: "y",
        hardware_msaa: "y",
        light_access: "seq",
        material_access: "seq",
        rates_decoupled: "y, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 45.0 },
    departures: &[
        "one sample a pixel alone, where the paper has several: those come with decoupled shading, which dais and gbuffer-list do",
        "no list of tiles sorted by shader, as all materials share one",
        "a thread a pixel interpolates its triangle: the paper transforms and rasterises the triangles of a tile again in compute",
    ],
    tessellation: false,
    ..Info::USUAL
};

/// What a pixel without a surface holds: `NO_TRIANGLE` in `include/scene.glsl`.
const NO_TRIANGLE: u32 = u32::MAX;

impl Technique for Visibility {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(VisibilityParams::default())
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        cost::visibility_buffer(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let raster = frame.params.typed::<VisibilityParams>().raster;
        if compute_raster::is_chosen(frame, INFO.id, raster.visibility)? {
            return shade_keys(graph, frame, raster.small_px);
        }
        let ids =
            graph.image("visibility/ids", BufferRole::Visibility, frame.image_info(vk::Format::R32_UINT));
        let depth =
            graph.image("visibility/depth", BufferRole::Depth, frame.image_info(vk::Format::D32_SFLOAT));
        let surfaces = geometry::SceneDraws::new(
            frame,
            ("surfaces/geometry/surface.vert#position", Some("surfaces/visible/ids.frag")),
            ("surfaces/geometry/surface.vert#uv", "surfaces/visible/ids.frag#mask"),
        )?;

        let mut pass = graph.raster("visibility/ids", PassRole::Geometry);
        frame.bind_scene(&mut pass);
        let ids = pass.color_uint(ids, Load::Clear([NO_TRIANGLE; 4]));
        let depth = pass.depth(depth, Load::Clear(0.0));
        surfaces.draw(frame, &mut pass);
        pass.finish();
        let radiance = shade(graph, frame, "", &VisibleDepths::of_depth(&depth, 1), &|pass| {
            pass.read_image("ids", &ids);
        })?;
        frame.board.put(OpaqueDepth(depth));
        frame.board.put(TriangleIds(ids));
        Ok(radiance)
    }
}

/// The same from triangles that compute has found.
fn shade_keys(graph: &mut Graph, frame: &Frame<'_>, small_px: u32) -> Result<ImageHandle, TechniqueError> {
    let keys = compute_raster::rasterize(graph, frame, INFO.id, small_px, 1)?;
    shade(graph, frame, "#keys", &VisibleDepths::of_keys(&keys, 1), &|pass| {
        pass.constant("SAMPLES", 1);
        pass.read_buffer("SampleKeys", &keys);
        pass.read_buffer("DrawCommands", &frame.buffers.commands);
    })
}

/// Lists lights as the technique's `lights` asks, and shades what `surfaces` show by the variants `tag` of its shaders.
fn shade(
    graph: &mut Graph,
    frame: &Frame<'_>,
    tag: &str,
    surfaces: &VisibleDepths<'_>,
    bind: &dyn Fn(&mut dyn SourceSlots),
) -> Result<ImageHandle, TechniqueError> {
    let lights = frame.params.typed::<VisibilityParams>().light_step().method(frame);
    let step = LightStep::build(graph, frame, INFO.id, lights, surfaces)?;
    let radiance = graph.image(
        "visibility/radiance",
        BufferRole::Targets,
        frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
    );
    let mut pass = frame.compute(
        graph,
        "visibility/shade",
        PassRole::Shading,
        &frame.shader(&format!("visibility/shade.comp{tag}"))?,
    );
    bind(&mut pass);
    step.bind(frame, &mut pass);
    set_constants(&mut pass, step.constants());
    let radiance = pass.write("hdr", radiance);
    pass.dispatch(frame.groups(8));
    pass.finish();
    let volumes = format!("visibility/volume.frag{tag}");
    match step {
        LightStep::None => add_volumes(graph, frame, (INFO.id, &volumes), radiance, bind),
        _ => Ok(radiance),
    }
}
