//! `forward-multipass`: one additive pass over the surfaces for every light.

// ORDER: 20

use afterlight_graph::{
    Blend, BufferRole, DepthTest, Graph, ImageHandle, Load, PassRole, RasterPass, Rect, gpu::vk,
};
use afterlight_scene::Aabb;
use glam::{Mat4, Vec3};

use crate::{
    Answers, AppendixA, Exactness, Frame, Info, ParamInfo, ParamKind, Params, Source, Technique,
    TechniqueError,
    cost::{Cost, Workload, forward},
    depth_prepass::FIRST_FRAGMENT,
    geometry::Surfaces,
};

/// The technique.
pub static TECHNIQUE: ForwardMultipass = ForwardMultipass;

/// See the module.
pub struct ForwardMultipass;

static SCISSOR: ParamInfo = ParamInfo {
    key: "scissor",
    summary: "a light's pass covers the light's bounds on the image, or all of it",
    kind: ParamKind::Choice { values: &["light", "none"] },
    default: "light",
};

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
    params: &[SCISSOR],
    needs: &[],
    samples: &[1],
    tessellation: true,
    views: &[],
};

/// Passes between two clears of the stencil: each has a reference of its own, from 1 to 255.
const STENCIL_REFERENCES: u32 = 255;

impl Technique for ForwardMultipass {
    fn info(&self) -> &Info {
        &INFO
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        forward(workload, 1.0 + workload.lights)
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
            frame.image_info(vk::Format::D32_SFLOAT_S8_UINT),
        );
        let ambient = Surfaces::shaded(
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
        frame.hand_over_depth(depth);
        Ok(radiance)
    }
}

/// Draws all surfaces once a light. Surfaces of one depth must not both add: the stencil lets the first of a pixel pass.
fn draw_lights(frame: &Frame<'_>, pass: &mut RasterPass<'_>) -> Result<(), TechniqueError> {
    let mut surfaces =
        Surfaces::shaded(frame, "forward_multipass/light.frag", "forward_multipass/light.frag#mask")?
            .depth(DepthTest::EQUAL)
            .stencil(FIRST_FRAGMENT, 1)
            .blend(vec![Blend::ADD]);
    let whole = Rect { x_px: 0, y_px: 0, width_px: frame.width_px, height_px: frame.height_px };
    let by_light = frame.params.get(&SCISSOR) == "light";
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

/// Pixels that a box may cover: all where it reaches behind the eye's plane, none where it lies outside the image.
pub(crate) fn screen_rect(clip_from_world: Mat4, bounds: &Aabb, whole: Rect) -> Option<Rect> {
    let corners = (0..8).map(|i| {
        let pick = glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0);
        clip_from_world * Vec3::select(pick, bounds.max, bounds.min).extend(1.0)
    });
    let (mut low, mut high) = (glam::Vec2::INFINITY, glam::Vec2::NEG_INFINITY);
    for c in corners {
        if c.w <= 1e-6 {
            return Some(whole);
        }
        let ndc = c.truncate().truncate() / c.w;
        (low, high) = (low.min(ndc), high.max(ndc));
    }
    let size = glam::Vec2::new(whole.width_px as f32, whole.height_px as f32);
    // A pixel more on each side than rounding can move a bound.
    let low = ((low * 0.5 + 0.5) * size - 1.0).floor().max(glam::Vec2::ZERO);
    let high = ((high * 0.5 + 0.5) * size + 1.0).ceil().min(size);
    low.cmplt(high).all().then_some(Rect {
        x_px: low.x as u32,
        y_px: low.y as u32,
        width_px: (high.x - low.x) as u32,
        height_px: (high.y - low.y) as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_scene::Camera;
    use proptest::prelude::*;

    const WHOLE: Rect = Rect { x_px: 0, y_px: 0, width_px: 100, height_px: 60 };

    proptest! {
        /// Every pixel whose ray meets the box lies in the rectangle.
        #[test]
        fn the_rectangle_covers_the_box(c in prop::array::uniform3(-8f32..8.0), r in 0.1f32..3.0, p in prop::array::uniform3(-1f32..1.0)) {
            let clip = Camera::look_at("c", Vec3::new(0.0, 1.0, 9.0), Vec3::ZERO, 1.0, 0.1);
            let clip = clip.clip_from_view(100.0 / 60.0) * clip.view_from_world();
            let bounds = Aabb { min: Vec3::from(c) - r, max: Vec3::from(c) + r };
            let q = clip * (Vec3::from(c) + Vec3::from(p) * r).extend(1.0);
            prop_assume!(q.w > 0.0 && q.x.abs() <= q.w && q.y.abs() <= q.w);
            let (x, y) = ((q.x / q.w * 0.5 + 0.5) * 100.0, (q.y / q.w * 0.5 + 0.5) * 60.0);
            let rect = screen_rect(clip, &bounds, WHOLE).expect("a point of the box is on the image");
            prop_assert!(x >= rect.x_px as f32 && x <= (rect.x_px + rect.width_px) as f32);
            prop_assert!(y >= rect.y_px as f32 && y <= (rect.y_px + rect.height_px) as f32);
        }
    }
}
