//! `depth-prepass`: depth first, then forward shading of what is visible alone.

// ORDER: 30

use afterlight_graph::{
    BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole, RasterPass, StencilFace, StencilTest, gpu::vk,
};

use crate::{
    ANY_SAMPLES, Answers, AppendixA, Exactness, Frame, Info, Params, Source, Technique, TechniqueError,
    cost::{Cost, Workload, depth_prepass},
    forward::shaded_surfaces,
    geometry::Surfaces,
    radiance_target::RadianceTarget,
    view::{INVOCATIONS, InvocationCount},
};

/// The technique.
pub static TECHNIQUE: DepthPrepass = DepthPrepass;

/// See the module.
pub struct DepthPrepass;

static INFO: Info = Info {
    id: "depth-prepass",
    title: "Depth pre-pass",
    summary: "A pass for depth alone, then forward shading where the depth is equal: each pixel is shaded once.",
    sources: &[Source { key: "petrescu-2016", section: "4.2" }],
    answers: Answers {
        surface: "nothing (depth)",
        lights: "loop over all",
        schedule: "fragment shader",
        resolve: "average of the hardware's samples",
    },
    appendix_a: AppendixA {
        id: "DPP",
        intersect: "imp",
        transparency: "n",
        hardware_msaa: "y",
        light_access: "rand",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    params: &[],
    needs: &[],
    samples: ANY_SAMPLES,
    tessellation: true,
    views: &["invocations"],
};

/// Lets the first fragment of a pixel pass and no other: where two surfaces have one depth, the first drawn wins, as in a
/// pass with a `GREATER` depth test.
pub(crate) const FIRST_FRAGMENT: StencilTest = {
    let face = StencilFace {
        compare: vk::CompareOp::NOT_EQUAL,
        fail: vk::StencilOp::KEEP,
        depth_fail: vk::StencilOp::KEEP,
        pass: vk::StencilOp::REPLACE,
    };
    StencilTest { front: face, back: face, compare_mask: 0xff, write_mask: 0xff }
};

/// Declares the pass `technique/depth`: depth, reversed, of the frame's samples, and a stencil of zeros for [`FIRST_FRAGMENT`].
///
/// # Errors
/// A shader that is not compiled in.
pub(crate) fn draw_depth(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
) -> Result<ImageHandle, TechniqueError> {
    let name = format!("{technique}/depth");
    let depth =
        graph.image(&name, BufferRole::Depth, frame.multisampled_info(vk::Format::D32_SFLOAT_S8_UINT));
    Ok(Surfaces::depth_only(frame)?.fill_depth(graph, frame, (&name, PassRole::DepthPrepass), depth))
}

/// Declares the pass `technique/shade`: surfaces where `depth`, of [`draw_depth`], is equal, each shaded by `shader`, which ends in
/// `shade_visible.glsl`, and its variant `#mask`, with these specialization constants. `bind_lights` binds what leads to the lights.
/// Returns radiance, the samples of a pixel averaged.
///
/// # Errors
/// A shader that is not compiled in.
pub(crate) fn shade_visible(
    graph: &mut Graph,
    frame: &Frame<'_>,
    (technique, shader): (&str, &str),
    depth: ImageHandle,
    constants: Vec<(String, u32)>,
    bind_lights: impl FnOnce(&mut RasterPass<'_>),
) -> Result<ImageHandle, TechniqueError> {
    let target = RadianceTarget::new(graph, frame, technique);
    let mut shaded = Surfaces::shaded(frame, shader, &format!("{shader}#mask"))?
        .depth(DepthTest::EQUAL)
        .stencil(FIRST_FRAGMENT, 1);
    shaded.constants = constants;
    let mut pass = graph.raster(&format!("{technique}/shade"), PassRole::Shading);
    frame.bind_scene(&mut pass);
    bind_lights(&mut pass);
    let radiance = target.attach(frame, &mut pass);
    let depth = pass.stencil(depth, Load::Keep);
    shaded.draw(frame, &mut pass);
    pass.finish();
    frame.hand_over_depth(depth);
    Ok(radiance)
}

impl Technique for DepthPrepass {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        depth_prepass(workload)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let target = RadianceTarget::new(graph, frame, "depth-prepass");
        let shaded = shaded_surfaces(frame)?.depth(DepthTest::EQUAL).stencil(FIRST_FRAGMENT, 1);
        let mut count = frame.shows(INVOCATIONS).then(|| InvocationCount::new(graph, frame, "depth-prepass"));

        let depth = draw_depth(graph, frame, INFO.id)?;
        let mut pass = graph.raster("depth-prepass/shade", PassRole::Shading);
        frame.bind_scene(&mut pass);
        count = count.map(|count| count.bind(&mut pass));
        let radiance = target.attach(frame, &mut pass);
        let depth = pass.stencil(depth, Load::Keep);
        shaded.draw(frame, &mut pass);
        pass.finish();
        frame.hand_over_depth(depth);
        count.map_or(Ok(radiance), |count| count.heat(graph, frame, "depth-prepass"))
    }
}
