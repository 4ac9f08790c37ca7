//! Light that surfaces reflect onto each other, for every technique: a reflective shadow map (Dachsbacher and Stamminger 2005).
//!
//! One light sees the scene once a frame, in `shared/rsm`; every texel that it sees is a small light. Whatever shades gathers
//! 64 of them a surface, in `unlit_radiance` of `include/shading.glsl`. See the README of this folder.

use std::f32::consts::{PI, TAU};

use afterlight_graph::{
    BufferHandle, Graph, ImageHandle, ImageInfo, Load,
    gpu::{self, vk},
};
use afterlight_scene::{Aabb, Camera, Light, LightKind, Projection};
use afterlight_shader::structs::{FrameConstants, RsmConstants};
use glam::Vec3;

use crate::{
    SceneGpu, Settings,
    draw_list::{DrawList, DrawOptions},
    error::TechniqueError,
    frame::Frame,
    geometry::Surfaces,
    renderer::View,
};

/// Texels that a surface gathers from.
pub const SAMPLES: usize = 64;

/// Radius of the disc of the map that they are taken from, as a share of its width.
pub const RADIUS: f32 = 0.3;

/// Width and height of a light's view where none is given, texels.
pub const DEFAULT_MAP_SIZE_PX: u32 = 512;

/// Widest angle of a light's perspective view, radians: further out a texel has hardly any solid angle.
const WIDEST_RAD: f32 = 150.0 / 180.0 * PI;

/// Angle of the view of a point light inside the scene, radians.
const POINT_RAD: f32 = 120.0 / 180.0 * PI;

/// Light that surfaces reflect onto each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Indirect {
    /// None but the constant ambient term.
    #[default]
    None,
    /// One bounce of one light, by a reflective shadow map.
    Rsm,
}

impl Indirect {
    /// Name on the command line and in run records.
    pub const fn name(self) -> &'static str {
        match self {
            Indirect::None => "none",
            Indirect::Rsm => "rsm",
        }
    }
}

/// What indirect light is gathered from, as the graph knows it.
pub(crate) struct Rsm {
    pub constants: BufferHandle,
    /// None where there is no indirect light.
    pub images: Option<RsmImages>,
}

/// The light's view.
pub(crate) struct RsmImages {
    pub surface: ImageHandle,
    pub flux: ImageHandle,
}

impl Rsm {
    /// `INDIRECT_SAMPLES` of shaders.
    pub fn sample_count(&self) -> u32 {
        self.images.as_ref().map_or(0, |_| SAMPLES as u32)
    }
}

/// The light that indirect light comes from, and its view of the scene, as wide as high.
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

    /// Half the height of the view's plane, m; under perspective of the plane at distance 1.
    fn half_height(&self) -> f32 {
        match self.camera.projection {
            Projection::Perspective { fov_y_rad, .. } => (0.5 * fov_y_rad).tan(),
            Projection::Orthographic { half_height_m, .. } => half_height_m,
        }
    }
}

/// Along the light, around all corners of the bounds.
fn directional_view(light: &Light, bounds_ws: &Aabb) -> Camera {
    let center_ws = bounds_ws.center();
    let mut camera = Camera::look_at("light", center_ws, center_ws + light.direction_ws, 1.0, 0.1);
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

fn perspective_view(light: &Light, target_ws: Vec3, angle_rad: f32, bounds_ws: &Aabb) -> Camera {
    let near_m = (1e-4 * bounds_ws.size().length()).max(1e-4);
    Camera::look_at("light", light.position_ws, target_ws, angle_rad.max(1e-3), near_m)
}

/// Why there is no indirect light though it was asked for.
pub(crate) fn warning(settings: &Settings, scene: &SceneGpu) -> Option<String> {
    (settings.indirect == Indirect::Rsm && SourceView::choose(&settings.lights, &bounds_ws(scene)).is_none())
        .then(|| "no indirect light: the scene has no light, or no surface, to take it from".to_owned())
}

/// Bounds of all draws.
fn bounds_ws(scene: &SceneGpu) -> Aabb {
    scene.draw_infos.iter().fold(Aabb::EMPTY, |bounds, draw| bounds.union(&draw.bounds_ws))
}

/// The pattern of all pixels (section 4.1): Hammersley points (ξ1, ξ2) at radius ξ1 and angle 2π ξ2, weighted by ξ1², the weights
/// normalised so that the samples stand for the disc. Offset in shares of the map, area in shares of the map's.
pub(crate) fn pattern() -> [[f32; 3]; SAMPLES] {
    let points: [[f32; 2]; SAMPLES] = std::array::from_fn(|i| {
        // ξ1 in the middle of its stratum: a sample at the very centre would have no weight.
        let xi1 = (i as f32 + 0.5) / SAMPLES as f32;
        [xi1, (i as u32).reverse_bits() as f32 / 2f32.powi(32)]
    });
    let weights: f32 = points.iter().map(|[xi1, _]| xi1 * xi1).sum();
    points.map(|[xi1, xi2]| {
        let (sine, cosine) = (TAU * xi2).sin_cos();
        [RADIUS * xi1 * sine, RADIUS * xi1 * cosine, PI * RADIUS * RADIUS * xi1 * xi1 / weights]
    })
}

/// Declares `shared/rsm` where indirect light is asked for and there is a light, and gives the frame what its passes bind.
///
/// # Errors
/// A shader that is not compiled in, the device.
pub(crate) fn record(
    graph: &mut Graph,
    frame: &mut Frame<'_>,
    settings: &Settings,
) -> Result<(), TechniqueError> {
    let source = match settings.indirect {
        Indirect::None => None,
        Indirect::Rsm => SourceView::choose(&settings.lights, &bounds_ws(frame.scene)),
    };
    let mut constants = RsmConstants::default();
    let images = match &source {
        None => None,
        Some(source) => {
            let light_settings = Settings {
                camera: source.camera.clone(),
                width_px: settings.shadow_map_size_px,
                height_px: settings.shadow_map_size_px,
                ..settings.clone()
            };
            let view = View::new(&light_settings);
            constants.clip_from_world = view.clip_from_world.to_cols_array_2d();
            let area_m2 = (2.0 * source.half_height()).powi(2);
            constants.samples = pattern().map(|[x, y, share]| [x, y, share * area_m2, 0.0]);
            Some(fill(graph, frame, &light_settings, &view, &source.light)?)
        }
    };
    let buffer = upload(frame.device, "shared/rsm constants", &constants)?;
    let constants = graph.import_buffer("shared/rsm constants", &buffer);
    frame.buffers.rsm = Some(Rsm { constants, images });
    Ok(())
}

fn upload<T: bytemuck::NoUninit>(
    device: &gpu::Device,
    name: &str,
    data: &T,
) -> Result<gpu::Buffer, gpu::GpuError> {
    let buffer = device.create_buffer(&gpu::BufferDesc {
        name,
        bytes: size_of::<T>() as u64,
        usage: vk::BufferUsageFlags::UNIFORM_BUFFER,
        memory: gpu::MemoryKind::Upload,
    })?;
    buffer.write(0, bytemuck::bytes_of(data))?;
    Ok(buffer)
}

/// Rasterises the scene as the light sees it: the frame looks through the light for one pass, with draws of its own.
fn fill(
    graph: &mut Graph,
    frame: &mut Frame<'_>,
    settings: &Settings,
    view: &View,
    light: &Light,
) -> Result<RsmImages, TechniqueError> {
    let mut draws = DrawList::new(frame.device, frame.scene, DrawOptions::default())?;
    draws.update(frame.scene, view.clip_from_world, view.eye_ws, settings.displacement_m)?;
    let constants: FrameConstants = view.constants(settings, frame.lights);
    let constants = upload(frame.device, "shared/rsm view", &constants)?;
    let eye = [
        std::mem::replace(&mut frame.buffers.frame, graph.import_buffer("shared/rsm view", &constants)),
        std::mem::replace(
            &mut frame.buffers.commands,
            graph.import_buffer("shared/rsm draw commands", &draws.commands),
        ),
        std::mem::replace(
            &mut frame.buffers.command_counts,
            graph.import_buffer("shared/rsm draw counts", &draws.counts),
        ),
    ];
    let images = raster(graph, frame, settings.shadow_map_size_px, light);
    [frame.buffers.frame, frame.buffers.commands, frame.buffers.command_counts] = eye;
    images
}

fn raster(
    graph: &mut Graph,
    frame: &Frame<'_>,
    size_px: u32,
    light: &Light,
) -> Result<RsmImages, TechniqueError> {
    let image = |graph: &mut Graph, name: &str, format| {
        graph.image(&format!("shared/rsm {name}"), ImageInfo::new(format, size_px, size_px))
    };
    let surface = image(graph, "surface", vk::Format::R32G32B32A32_UINT);
    let flux = image(graph, "flux", vk::Format::R16G16B16A16_SFLOAT);
    let depth = image(graph, "depth", vk::Format::D32_SFLOAT);
    let mut surfaces = Surfaces::shaded(frame, "indirect/rsm.frag", "indirect/rsm.frag#mask")?;
    let index = frame.lights.lights.iter().position(|one| one == light).unwrap_or_default();
    surfaces.push = (index as u32).to_le_bytes().to_vec();
    let mut pass = graph.raster("shared/rsm");
    frame.bind_scene(&mut pass);
    // A texel without flux gives nothing, wherever it is.
    let images = RsmImages {
        surface: pass.color_uint(surface, Load::Clear([0; 4])),
        flux: pass.color(flux, Load::Clear([0.0; 4])),
    };
    let _depth = pass.depth(depth, Load::Clear(0.0));
    surfaces.draw(frame, &mut pass);
    pass.finish();
    Ok(images)
}
