//! `forward-multipass`: one additive pass over the surfaces for every light.

// ORDER: 20

mod params;

pub use params::{ForwardMultipassParams, Scissor};

use afterlight_graph::{
    Blend, BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole, RasterPass, Rect, gpu::vk,
};
use afterlight_scene::Aabb;
use glam::Vec3;

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, OpaqueDepth, Params, Source, Technique, TechniqueError,
    camera_view::screen_rect,
};
use afterlight_shader::Shader;
use afterlight_stages::surfaces::{depth_first::FIRST_FRAGMENT, geometry::SceneDraws};

/// The technique.
pub static TECHNIQUE: ForwardMultipass = ForwardMultipass;

/// See the module.
pub struct ForwardMultipass;

static INFO: Info = Info {
    id: "forward-multipass",
    title: "Forward shading, one pass a light",
    summary: "A pass for depth and what needs no light, then all surfaces once more for each light, added.",
    sources: &[Source { key: "petrescu-2016", section: "4.1" }],
    answers: Answers {
        surface: "nothing",
        lights: "one pass a light",
        schedule: "fragment shader",
        resolve: "one sample",
    },
    appendix_a: AppendixA {
        id: "F",
        intersect: "imp",
        transparency: "y",
        hardware_msaa: "y",
        light_access: "rand",
        material_access: "rand",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Exact { min_psnr_db: 50.0 },
    departures: &["one sample a pixel alone, where the hardware could average several"],
    ..Info::USUAL
};

/// Passes between two clears of the stencil: each has a reference of its own, from 1 to 255.
const STENCIL_REFERENCES: u32 = 255;

impl Technique for ForwardMultipass {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &crate::SHADERS
    }

    fn params(&self) -> Params {
        Params::of(ForwardMultipassParams::default())
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        crate::forward::cost::forward(workload, 1.0 + workload.lights)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let radiance = graph.image(
            "forward-multipass/radiance",
            BufferRole::Targets,
            frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
        );
        let depth = graph.image(
            "forward-multipass/depth",
            BufferRole::Depth,
            frame.image_info(frame.depth_stencil_format()),
        );
        let ambient = SceneDraws::shaded(
            frame,
            "forward_multipass/light.frag#ambient",
            "forward_multipass/light.frag#ambient-mask",
        )?;

        let mut pass = graph.raster("forward-multipass/ambient", PassRole::Shading);
        frame.bind_scene(&mut pass);
        let radiance = pass.color(radiance, Load::Clear(frame.background()));
        let depth = pass.depth(depth, Load::Clear(0.0));
        pass.stencil_clear(0);
        ambient.draw(frame, &mut pass);
        pass.finish();

        let mut pass = graph.raster("forward-multipass/lights", PassRole::Shading);
        frame.bind_scene(&mut pass);
        let radiance = pass.color(radiance, Load::Keep);
        let depth = pass.stencil(depth, Load::Keep);
        draw_lights(frame, &mut pass)?;
        pass.finish();
        frame.board.put(OpaqueDepth(depth));
        Ok(radiance)
    }
}

/// Draws all surfaces once a light. Surfaces of one depth must not both add: the stencil lets the first of a pixel pass.
fn draw_lights(frame: &Frame<'_>, pass: &mut RasterPass<'_>) -> Result<(), TechniqueError> {
    let mut surfaces =
        SceneDraws::shaded(frame, "forward_multipass/light.frag", "forward_multipass/light.frag#mask")?
            .depth(DepthTest::EQUAL)
            .stencil(FIRST_FRAGMENT, 1)
            .blend(vec![Blend::ADD]);
    let whole = Rect { x_px: 0, y_px: 0, width_px: frame.width_px, height_px: frame.height_px };
    let by_light = frame.params.typed::<ForwardMultipassParams>().scissor == Scissor::Light;
    if by_light {
        frame.holds_for_this_view();
    }
    for index in 0..frame.lights.count {
        if index > 0 && index % STENCIL_REFERENCES == 0 {
            pass.clear_stencil(0, None);
        }
        surfaces.stencil_reference = index % STENCIL_REFERENCES + 1;
        surfaces.push = bytemuck::bytes_of(&index).to_vec();
        let light = &frame.lights.lights[index as usize];
        let bounded = by_light && index >= frame.lights.unbounded_count;
        let scissor = if bounded {
            let range = Vec3::splat(light.range_m);
            let bounds = Aabb { min: light.position_ws - range, max: light.position_ws + range };
            screen_rect(frame.clip_from_world, &bounds, whole)
        } else {
            Some(whole)
        };
        if let Some(scissor) = scissor {
            surfaces.scissor = Some(scissor);
            surfaces.draw(frame, pass);
        }
    }
    Ok(())
}
