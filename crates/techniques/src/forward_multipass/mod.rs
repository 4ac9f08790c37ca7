//! `forward-multipass`: one additive pass over the surfaces for every light.

// ORDER: 20

mod params;

pub use params::{ForwardMultipassParams, Scissor};

use afterlight_graph::{
    Blend, BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole, RasterPass, Rect, Step, gpu::vk,
};
use afterlight_scene::Aabb;
use glam::Vec3;

use afterlight_cost::{Cost, Workload};
use afterlight_frame::{
    Answers, AppendixA, Exactness, Frame, Info, OpaqueDepth, Params, Source, Technique, TechniqueError, View,
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
    surfaces.push = bytemuck::bytes_of(&0u32).to_vec();
    surfaces.draw(frame, pass);
    let buckets = surfaces.draw_count(frame);
    let by_light = frame.params.typed::<ForwardMultipassParams>().scissor == Scissor::Light;
    frame.script_of_view(pass, move |view| {
        let mut steps = Vec::new();
        for index in 0..view.lights.count {
            if index > 0 && index % STENCIL_REFERENCES == 0 {
                steps.push(Step::ClearStencil(0));
            }
            if let Some(scissor) = reached(view, index, by_light) {
                steps.extend((0..buckets).map(|draw| Step::Draw {
                    draw,
                    scissor: Some(scissor),
                    stencil_reference: Some(index % STENCIL_REFERENCES + 1),
                    push: Some(index),
                    commands: None,
                }));
            }
        }
        steps
    });
    Ok(())
}

/// Pixels that a light may reach: all of them unless `by_light`; `None` where it reaches none.
fn reached(view: &View<'_>, index: u32, by_light: bool) -> Option<Rect> {
    let whole =
        Rect { x_px: 0, y_px: 0, width_px: view.settings.width_px, height_px: view.settings.height_px };
    if !by_light || index < view.lights.unbounded_count {
        return Some(whole);
    }
    let light = &view.lights.lights[index as usize];
    let range = Vec3::splat(light.range_m);
    let bounds = Aabb { min: light.position_ws - range, max: light.position_ws + range };
    screen_rect(view.camera.clip_from_world, &bounds, whole)
}
