//! Lights as shaders read them.

use afterlight_graph::gpu::{self, vk};
use afterlight_scene::{Light, LightKind};
use afterlight_shader::structs::LightData;

use crate::scene_gpu::record_image;

/// Lights on the device: those without an end first, so that techniques with light volumes can tell them apart.
pub struct LightList {
    /// Four texels a light.
    pub(crate) data: gpu::Image,
    /// Centre and range of each light, one texel, what culling reads.
    pub(crate) spheres: gpu::Image,
    /// Number of lights.
    pub count: u32,
    /// Number of lights without an end, first in the list.
    pub unbounded_count: u32,
    /// Whether there are point lights alone.
    pub only_points: bool,
    /// The lights in the order of the device.
    pub lights: Vec<Light>,
}

impl LightList {
    /// Uploads lights, in a stable order: unbounded ones first.
    ///
    /// # Errors
    /// Of the device.
    pub fn new(
        device: &gpu::Device,
        uploader: &mut gpu::Uploader,
        lights: &[Light],
    ) -> Result<Self, gpu::GpuError> {
        let mut lights = lights.to_vec();
        lights.sort_by_key(|light| !is_unbounded(light));
        let data: Vec<LightData> = lights.iter().map(light_data).collect();
        let spheres: Vec<[f32; 4]> = lights
            .iter()
            .map(|l| {
                if is_unbounded(l) {
                    [0.0, 0.0, 0.0, f32::INFINITY]
                } else {
                    l.position_ws.extend(l.range_m).into()
                }
            })
            .collect();
        Ok(Self {
            data: record_image(device, uploader, "lights", &data, 4, vk::Format::R32G32B32A32_UINT)?,
            spheres: record_image(
                device,
                uploader,
                "light spheres",
                &spheres,
                1,
                vk::Format::R32G32B32A32_SFLOAT,
            )?,
            count: lights.len() as u32,
            unbounded_count: lights.iter().filter(|l| is_unbounded(l)).count() as u32,
            only_points: lights.iter().all(|l| l.kind == LightKind::Point),
            lights,
        })
    }

    /// Number of a light in the order of the device, the first of equals; 0 where it is not there.
    pub(crate) fn index_of(&self, light: &Light) -> u32 {
        self.lights.iter().position(|one| one == light).unwrap_or_default() as u32
    }
}

fn is_unbounded(light: &Light) -> bool {
    light.kind == LightKind::Directional || !light.range_m.is_finite()
}

fn light_data(light: &Light) -> LightData {
    let (kind, spot_scale, spot_offset) = match light.kind {
        LightKind::Point => (0, 0.0, 1.0),
        LightKind::Spot { inner_angle_rad, outer_angle_rad } => {
            // KHR_lights_punctual: falloff between the cosines of the two angles
            let scale = 1.0 / (inner_angle_rad.cos() - outer_angle_rad.cos()).max(0.001);
            (1, scale, -outer_angle_rad.cos() * scale)
        }
        LightKind::Directional => (2, 0.0, 1.0),
    };
    LightData {
        position_ws: light.position_ws.into(),
        range_m: light.range_m,
        intensity: light.intensity.into(),
        kind,
        direction_ws: light.direction_ws.into(),
        inverse_range_sq: if is_unbounded(light) { 0.0 } else { 1.0 / (light.range_m * light.range_m) },
        spot_scale,
        spot_offset,
        _padding: [0; 2],
    }
}
