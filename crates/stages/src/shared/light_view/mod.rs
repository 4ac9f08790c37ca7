//! A light's view of the scene: which light it is, and how a frame looks through it. What indirect light is gathered from
//! (`shared/indirect/`) and shadows (`shared/shadow/`) are passes through it.

use std::{f32::consts::PI, sync::Arc};

use afterlight_graph::{BufferHandle, BufferRole, Graph, gpu::vk};
use afterlight_scene::{Aabb, Camera, Light, LightKind, Projection};
use afterlight_shader::structs::FrameConstants;
use bytemuck::Zeroable as _;
use glam::{Mat4, Vec3};

use afterlight_frame::{
    CameraView, ChangesWith, DrawParams, Frame, SceneGpu, Settings, TechniqueError, View, put,
    scene::draw_list::DrawQuery,
};

use crate::shared::cull::SceneOfDraws;

/// Widest angle of a light's perspective view, radians: further out a texel has hardly any solid angle.
const WIDEST_RAD: f32 = 150.0 / 180.0 * PI;

/// Angle of the view of a point light inside the scene, radians.
const POINT_RAD: f32 = 120.0 / 180.0 * PI;

/// The light that casts shadows and that indirect light comes from, and its view of the scene, as wide as high.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceView {
    /// The light.
    pub light: Light,
    /// Its view.
    pub camera: Camera,
}

impl SourceView {
    /// The first directional or spot light; else the strongest point light, which looks towards the centre of the scene; `None`
    /// without a light or a surface.
    ///
    /// A directional light's view holds the scene's bounds, a spot light's its cone up to 150°, a point light's the bounds' sphere
    /// up to 120°.
    pub fn choose(lights: &[Light], bounds_ws: &Aabb) -> Option<Self> {
        let strength = |light: &Light| light.intensity.element_sum();
        let light = *lights.iter().find(|l| l.kind != LightKind::Point).or_else(|| {
            // The first of equals, whatever their order after it.
            lights.iter().reduce(|a, b| if strength(b) > strength(a) { b } else { a })
        })?;
        if bounds_ws.is_empty() || !bounds_ws.size().is_finite() {
            return None;
        }
        let camera = match light.kind {
            LightKind::Directional => directional_view(&light, bounds_ws),
            LightKind::Spot { outer_angle_rad, .. } => {
                let target_ws = light.position_ws + light.direction_ws;
                perspective_view(&light, target_ws, (2.0 * outer_angle_rad).min(WIDEST_RAD), bounds_ws)
            }
            LightKind::Point => {
                let to_center = bounds_ws.center() - light.position_ws;
                let sine = 0.5 * bounds_ws.size().length() / to_center.length();
                let angle_rad = if sine < 1.0 { (2.0 * sine.asin()).min(POINT_RAD) } else { POINT_RAD };
                perspective_view(&light, bounds_ws.center(), angle_rad, bounds_ws)
            }
        };
        Some(Self { light, camera })
    }

    /// World to clip.
    pub fn clip_from_world(&self) -> Mat4 {
        self.camera.clip_from_world(1.0)
    }

    /// Half the height of the view's plane, m; under perspective of the plane at distance 1.
    pub fn half_height(&self) -> f32 {
        match self.camera.projection {
            Projection::Perspective { fov_y_rad, .. } => (0.5 * fov_y_rad).tan(),
            Projection::Orthographic { half_height_m, .. } => half_height_m,
        }
    }
}

/// Along the light, around all corners of the bounds.
fn directional_view(light: &Light, bounds_ws: &Aabb) -> Camera {
    let center_ws = bounds_ws.center();
    let mut camera = Camera::look_at(Arc::default(), center_ws, center_ws + light.direction_ws, 1.0, 0.1);
    let axes = camera.world_from_view.matrix3;
    let half_size = 0.5 * bounds_ws.size();
    // Half the extent of a box along an axis, a little more so that what lies in its sides is not clipped.
    let half_extent = |axis: glam::Vec3A| (Vec3::from(axis).abs().dot(half_size) * 1.01).max(1e-3);
    let half_depth_m = half_extent(axes.z_axis);
    camera.world_from_view.translation += axes.z_axis * half_depth_m;
    camera.projection = Projection::Orthographic {
        half_height_m: half_extent(axes.x_axis).max(half_extent(axes.y_axis)),
        near_m: 0.0,
        far_m: 2.0 * half_depth_m,
    };
    camera
}

/// Views of lights are made for every frame: they have no name, which would be memory.
fn perspective_view(light: &Light, target_ws: Vec3, angle_rad: f32, bounds_ws: &Aabb) -> Camera {
    let near_m = (1e-4 * bounds_ws.size().length()).max(1e-4);
    Camera::look_at(Arc::default(), light.position_ws, target_ws, angle_rad.max(1e-3), near_m)
}

/// The light of a view's settings, and what it sees; `None` without a light or a surface. Displaced surfaces are in view too.
pub fn source(view: &View<'_>) -> Option<SourceView> {
    SourceView::choose(&view.settings.lights, &view.bounds_ws())
}

/// The same of a scene as it was uploaded.
pub fn source_at_rest(scene: &SceneGpu, settings: &Settings) -> Option<SourceView> {
    let displacement_m = settings.effects.tessellation.displacement_m();
    SourceView::choose(&settings.lights, &scene.rest.bounds_ws(displacement_m))
}

/// Constants of a shader that `of_source` computes from the light's view of each pose.
///
/// # Errors
/// The device.
pub fn constants_of_pose<T: bytemuck::NoUninit>(
    graph: &mut Graph,
    frame: &Frame<'_>,
    name: &str,
    of_source: impl Fn(&View<'_>) -> T + Send + Sync + 'static,
) -> Result<BufferHandle, TechniqueError> {
    let named = (name, BufferRole::Constants);
    let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
    let how = (size_of::<T>() as u64, usage, ChangesWith::Pose);
    frame.input(graph, named, how, move |view, bytes| {
        put(bytes, 0, &[of_source(view)]);
    })
}

/// What the light sees, `size_px` texels a side.
fn through(view: &View<'_>, size_px: u32) -> Option<CameraView> {
    Some(CameraView::new(&source(view)?.camera, [size_px; 2]))
}

/// Lets the frame look through the light of its settings ([`source`]), `size_px` texels a side, while `declare` declares passes: constants,
/// and draws culled by that view. Their buffers are named after `pass`.
///
/// # Errors
/// Those of `declare`, the device.
pub fn look_through<T>(
    graph: &mut Graph,
    frame: &mut Frame<'_>,
    (pass, size_px): (&str, u32),
    declare: impl FnOnce(&mut Graph, &Frame<'_>) -> Result<T, TechniqueError>,
) -> Result<T, TechniqueError> {
    let constants = constants_of_pose(graph, frame, &format!("{pass} view"), move |view| {
        through(view, size_px).map_or_else(FrameConstants::zeroed, |camera| {
            let of_view = camera.constants(view.settings, view.lights, &view.bounds_ws());
            FrameConstants { samples: 1, ..view.time.alone().constants(of_view) }
        })
    })?;
    let scene = SceneOfDraws::of(frame);
    let options = DrawParams { cull_on: scene.cull_on, ..DrawParams::default() };
    let named = (&*format!("{pass} draw"), ChangesWith::Pose);
    let draws = scene.by_query(graph, named, move |view| match through(view, size_px) {
        Some(camera) => view.query_of(&options, &camera, None),
        None => DrawQuery::NOTHING,
    })?;
    let imported = [constants, draws.commands, draws.counts];
    let b = &mut frame.buffers;
    let [constants, commands, counts] = imported;
    let eye = [
        std::mem::replace(&mut b.frame, constants),
        std::mem::replace(&mut b.commands, commands),
        std::mem::replace(&mut b.command_counts, counts),
    ];
    let declared = declare(graph, frame);
    let b = &mut frame.buffers;
    [b.frame, b.commands, b.command_counts] = eye;
    declared
}
