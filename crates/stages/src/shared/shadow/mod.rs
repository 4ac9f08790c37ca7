//! Shadows of one light, for every technique: a shadow map (Williams 1978).
//!
//! The light sees the scene once a frame, in `shared/shadow`; whatever shades asks its depths, in `light_radiance` of
//! `include/shading.glsl`. See the README of this folder.

use afterlight_graph::{BufferHandle, BufferRole, Graph, ImageHandle, ImageInfo, PassRole, gpu::vk};
use afterlight_scene::Projection;
use afterlight_shader::structs::ShadowConstants;
use glam::{Mat4, Vec3};

use crate::{
    shared::light_view::{self, SourceView},
    surfaces::geometry::SceneDraws,
};
use afterlight_frame::{Frame, SceneGpu, SceneInput, Settings, ShadowEffect, Shadows, Slots, TechniqueError};

/// How far from a point the filter reads along each axis, at most, texels: it covers a texel to each side of the point, and the
/// centre of a texel is half a texel from where it begins.
pub const FILTER_REACH_TEXELS: f32 = 1.5;

/// How much nearer to the light a point is taken to be, texels. Depths that slope cannot tell apart differ by rounding alone,
/// which is far less.
const NEARER_TEXELS: f32 = 0.5;

/// What tells whether a light reaches a point, as the graph knows it.
struct Shadow {
    constants: BufferHandle,
    /// None where there are no shadows.
    map: Option<ImageHandle>,
}

impl SceneInput for Shadow {
    fn bind(&self, frame: &Frame<'_>, pass: &mut dyn Slots) {
        pass.read_buffer("ShadowBlock", &self.constants);
        // Not read without shadows; bound because the layout requires it.
        pass.read_image("shadow_map", self.map.as_ref().unwrap_or(&frame.buffers.light_spheres));
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        vec![("SHADOWS", u32::from(self.map.is_some()))]
    }
}

/// Why there are no shadows though they were asked for.
pub fn warning(settings: &Settings, scene: &SceneGpu) -> Option<String> {
    (settings.effects.shadows.method == Shadows::Map && light_view::source_at_rest(scene, settings).is_none())
        .then(|| "no shadows: the scene has no light, or no surface, to cast them".to_owned())
}

/// Declares `shared/shadow` where shadows are asked for and there is a light, and gives the frame what its passes bind.
///
/// # Errors
/// A shader that is not compiled in, the device.
pub fn record(graph: &mut Graph, frame: &mut Frame<'_>, settings: &Settings) -> Result<(), TechniqueError> {
    let ShadowEffect { method, map_size_px: size_px, bias } = settings.effects.shadows;
    let is_cast = method == Shadows::Map && light_view::source_at_rest(frame.scene, settings).is_some();
    let map = match is_cast {
        false => None,
        true => Some(light_view::look_through(graph, frame, ("shared/shadow", size_px), |graph, frame| {
            raster(graph, frame, size_px, bias)
        })?),
    };
    let nearer_texels = NEARER_TEXELS * bias;
    let constants = light_view::constants_of_pose(graph, frame, "shared/shadow constants", move |view| {
        let source = light_view::source(view).filter(|_| is_cast);
        source.map_or_else(ShadowConstants::default, |source| ShadowConstants {
            texel_from_world: texel_from_world(&source, size_px, nearer_texels).to_cols_array_2d(),
            light_index: view.lights.index_of(&source.light),
            size_px,
        })
    })?;
    frame.board.add_input(Shadow { constants, map });
    Ok(())
}

/// World to texels of the map and the depth of a point that many texels nearer to the light, homogeneous.
fn texel_from_world(source: &SourceView, size_px: u32, nearer_texels: f32) -> Mat4 {
    let half_px = 0.5 * size_px as f32;
    let texel_from_clip = Mat4::from_translation(Vec3::new(half_px, half_px, 0.0))
        * Mat4::from_scale(Vec3::new(half_px, half_px, 1.0));
    // Half a texel's width, m; under perspective at distance 1, and as a share of any distance.
    let half_texel = source.half_height() / size_px as f32;
    let nearer = 2.0 * half_texel * nearer_texels;
    let bias = match source.camera.projection {
        Projection::Orthographic { near_m, far_m, .. } => {
            Mat4::from_translation(Vec3::Z * nearer / (far_m - near_m))
        }
        // Depth is near over distance.
        Projection::Perspective { .. } => Mat4::from_scale(Vec3::new(1.0, 1.0, 1.0 + nearer)),
    };
    bias * texel_from_clip * source.clip_from_world()
}

/// Rasterises the scene as the light sees it, every surface pushed away from it by as much as it recedes within the filter's
/// reach along both axes.
fn raster(
    graph: &mut Graph,
    frame: &Frame<'_>,
    size_px: u32,
    bias: f32,
) -> Result<ImageHandle, TechniqueError> {
    let info = ImageInfo::new(vk::Format::D32_SFLOAT, size_px, size_px);
    let map = graph.image("shared/shadow depth", BufferRole::Shared, info);
    let mut surfaces = SceneDraws::depth_only(frame)?;
    // Less is farther.
    surfaces.depth_bias_slope = -2.0 * FILTER_REACH_TEXELS * bias;
    Ok(surfaces.fill_depth(graph, frame, ("shared/shadow", PassRole::Shared), map))
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_scene::{Aabb, Light, LightKind};

    fn sources() -> [SourceView; 2] {
        let bounds = Aabb { min: Vec3::new(-3.0, 0.0, -2.0), max: Vec3::new(4.0, 5.0, 6.0) };
        let light = |kind| Light {
            kind,
            position_ws: Vec3::new(7.0, 9.0, 4.0),
            direction_ws: Vec3::new(-1.0, -1.1, -0.3).normalize(),
            intensity: Vec3::ONE,
            range_m: 50.0,
        };
        [LightKind::Directional, LightKind::Spot { inner_angle_rad: 0.3, outer_angle_rad: 0.6 }]
            .map(|kind| SourceView::choose(&[light(kind)], &bounds).expect("a light"))
    }

    /// Place and depth of a point are those of a point that many texels, as wide as they are there, nearer to the light's plane.
    #[test]
    fn points_are_taken_nearer_by_shares_of_a_texel() {
        let size_px = 256;
        let point_ws = Vec3::new(0.5, 1.0, 2.0);
        for source in sources() {
            let view_from_world = source.camera.view_from_world();
            let point_vs = view_from_world.transform_point3(point_ws);
            // A step of the width of a texel along the view's axis, on the light's ray.
            let texel_m = |scale: f32| 2.0 * source.half_height() * scale / size_px as f32;
            let nearer_vs = point_vs
                + match source.camera.projection {
                    Projection::Orthographic { .. } => Vec3::Z * texel_m(1.0),
                    Projection::Perspective { .. } => point_vs / point_vs.z * texel_m(-point_vs.z),
                };
            let nearer_ws = view_from_world.inverse().transform_point3(nearer_vs);
            let expected = texel_from_world(&source, size_px, 0.0).project_point3(nearer_ws);
            let found = texel_from_world(&source, size_px, 1.0).project_point3(point_ws);
            assert!((found - expected).truncate().abs().max_element() < 0.01, "{found} for {expected}");
            // Under perspective to the first order: a texel is 0.5% of the distance.
            let here = texel_from_world(&source, size_px, 0.0).project_point3(point_ws);
            let [found, expected] = [found, expected].map(|p| p.z - here.z);
            assert!(found > 0.0 && (found / expected - 1.0).abs() < 0.01, "{found} for {expected}");
        }
    }
}
