//! `deferred-stencil`: light volumes bounded by stencil, as shadow volumes are.

// ORDER: 50

use afterlight_graph::{
    Blend, DepthTest, Graph, ImageHandle, Load, PassRole, StencilFace, StencilTest, gpu::vk,
};

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, OpaqueDepth, Params, Source, Technique, TechniqueError,
};
use afterlight_shader::Shader;
use afterlight_stages::{lights::volumes, surfaces::gbuffer};

/// The technique.
pub static TECHNIQUE: DeferredStencil = DeferredStencil;

/// See the module.
pub struct DeferredStencil;

static INFO: Info = Info {
    id: "deferred-stencil",
    title: "Deferred shading, stencil-bounded volumes",
    summary: "Each light's volume first marks in stencil the pixels whose surface lies inside, then only those are lit.",
    sources: &[
        Source { key: "petrescu-2016", section: "2.1" },
        Source { key: "petrescu-2016", section: "4.3" },
    ],
    answers: Answers {
        surface: "G-buffer, 1 sample",
        lights: "light volumes, with stencil",
        schedule: "fragment shader",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "D",
        intersect: "imp",
        transparency: "n",
        hardware_msaa: "n",
        light_access: "seq",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    departures: &[
        "no composition pass: lights are added with the albedo applied, so that the sum of a pixel is its radiance; the paper adds light alone and applies the albedo last",
    ],
    ..Info::USUAL
};

/// Marks surfaces inside a closed volume, the eye inside or outside: faces behind the surface count, back faces up and
/// front faces down.
const MARK: StencilTest = StencilTest {
    front: StencilFace { depth_fail: vk::StencilOp::DECREMENT_AND_WRAP, ..StencilFace::KEEP },
    back: StencilFace { depth_fail: vk::StencilOp::INCREMENT_AND_WRAP, ..StencilFace::KEEP },
    compare_mask: 0xff,
    write_mask: 0xff,
};

/// Passes where marked and takes the mark away, ready for the next light.
const MARKED: StencilTest = {
    let face = StencilFace {
        compare: vk::CompareOp::NOT_EQUAL,
        fail: vk::StencilOp::KEEP,
        depth_fail: vk::StencilOp::ZERO,
        pass: vk::StencilOp::ZERO,
    };
    StencilTest { front: face, back: face, compare_mask: 0xff, write_mask: 0xff }
};

/// A face fails where it lies behind the surface (reversed depth).
const IN_FRONT: DepthTest = DepthTest { compare: vk::CompareOp::GREATER_OR_EQUAL, write: false };

impl Technique for DeferredStencil {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    /// As deferred, with two draws a light, the volumes' vertices processed twice.
    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        let twice = Workload {
            light_command: 2.0 * workload.light_command,
            light_vertices: 2.0 * workload.light_vertices,
            ..*workload
        };
        let mut cost = crate::deferred::cost::deferred(&twice);
        // one byte of stencil a pixel
        cost.mem += 0.25 * workload.pixels;
        cost
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = gbuffer::fill(graph, frame, "deferred-stencil", frame.depth_stencil_format())?;
        let mark = volumes::volume_state(frame, None, vk::CullModeFlags::NONE, vec![Blend::NONE])?
            .depth(IN_FRONT)
            .stencil(MARK);
        let light = volumes::volume_state(
            frame,
            Some("lights/volumes/light.frag"),
            vk::CullModeFlags::FRONT,
            vec![Blend::ADD],
        )?
        .stencil(MARKED);

        let mut pass = graph.raster("deferred-stencil/lights", PassRole::Shading);
        frame.bind_scene(&mut pass);
        gbuffer::bind(&mut pass, &filled);
        let accumulation = pass.color(filled.accumulation, Load::Keep);
        let depth = pass.stencil(filled.depth, Load::Clear(0));
        volumes::draw_unbounded(frame, &mut pass, "lights/volumes/light.frag", 1)?;
        for index in frame.lights.unbounded_count..frame.lights.count {
            pass.draw(volumes::volume_draw(frame, mark.clone(), index, 1));
            pass.draw(volumes::volume_draw(frame, light.clone(), index, 1));
        }
        pass.finish();
        frame.board.put(OpaqueDepth(depth));
        Ok(accumulation)
    }
}
