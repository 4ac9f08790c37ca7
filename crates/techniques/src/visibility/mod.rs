//! `visibility`: triangle IDs, then everything else in compute.

// ORDER: 70

use afterlight_graph::{Graph, ImageHandle, Load, gpu::vk};

use crate::{
    Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError, compute_raster,
    cost::{Cost, Workload, visibility_buffer},
    geometry::Surfaces,
};

/// The technique.
pub static TECHNIQUE: Visibility = Visibility;

/// See the module.
pub struct Visibility;

static INFO: Info = Info {
    id: "visibility",
    title: "Visibility buffer",
    summary: "Surfaces leave four bytes, a triangle ID; a compute group a tile fetches triangles, culls lights and shades.",
    sources: &[Source { key: "petrescu-2016", section: "4.11" }, Source { key: "burns-2013", section: "3" }],
    answers: Answers {
        surface: "triangle IDs",
        lights: "tiles",
        schedule: "compute, a group a tile",
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
    params: &[compute_raster::VISIBILITY, compute_raster::SMALL],
    needs: &[],
    samples: &[1],
    tessellation: false,
    views: &[],
};

/// What a pixel without a surface holds: `NO_TRIANGLE` in `include/scene.glsl`.
const NO_TRIANGLE: u32 = u32::MAX;

impl Technique for Visibility {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        visibility_buffer(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        if compute_raster::is_chosen(frame, &INFO)? {
            return shade_keys(graph, frame);
        }
        let ids = graph.image("visibility/ids", frame.image_info(vk::Format::R32_UINT));
        let depth = graph.image("visibility/depth", frame.image_info(vk::Format::D32_SFLOAT));
        let radiance = graph.image("visibility/radiance", frame.image_info(vk::Format::R16G16B16A16_SFLOAT));
        let surfaces = Surfaces::new(
            frame,
            ("geometry/surface.vert#position", Some("visibility/ids.frag")),
            ("geometry/surface.vert#uv", "visibility/ids.frag#mask"),
        )?;

        let mut pass = graph.raster("visibility/ids");
        frame.bind_scene(&mut pass);
        let ids = pass.color_uint(ids, Load::Clear([NO_TRIANGLE; 4]));
        let _depth = pass.depth(depth, Load::Clear(0.0));
        surfaces.draw(frame, &mut pass);
        pass.finish();

        let mut pass = frame.compute(graph, "visibility/shade", &frame.shader("visibility/shade.comp")?);
        pass.read("ids", &ids);
        let radiance = pass.write("hdr", radiance);
        pass.dispatch(frame.groups(16));
        pass.finish();
        Ok(radiance)
    }
}

/// The same from triangles that compute has found.
fn shade_keys(graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
    let keys = compute_raster::rasterize(graph, frame, &INFO, 1)?;
    let radiance = graph.image("visibility/radiance", frame.image_info(vk::Format::R16G16B16A16_SFLOAT));
    let mut pass = frame.compute(graph, "visibility/shade", &frame.shader("visibility/shade.comp#keys")?);
    pass.constant("SAMPLES", 1u32);
    pass.read("SampleKeys", &keys).read("DrawCommands", &frame.buffers.commands);
    let radiance = pass.write("hdr", radiance);
    pass.dispatch(frame.groups(16));
    pass.finish();
    Ok(radiance)
}
