//! Lights as shaders read them.

use afterlight_graph::gpu::{self, vk};
use afterlight_scene::{Aabb, Light, LightKind};
use afterlight_shader::structs::LightData;
use glam::Vec3;

use crate::upload::{put, record_image};

/// Lights on the device: those without an end first, so that techniques with light volumes can tell them apart, the others along
/// a curve that keeps neighbours together (`lights/bvh/`). Clones share the images.
#[derive(Clone)]
pub struct SceneLights {
    /// Four texels a light.
    pub data: gpu::Image,
    /// Centre and radius of the least sphere around what each light reaches, one texel, what culling reads.
    pub spheres: gpu::Image,
    /// Number of lights.
    pub count: u32,
    /// Number of lights without an end, first in the list.
    pub unbounded_count: u32,
    /// Whether there are point lights alone.
    pub only_points: bool,
    /// The lights in the order of the device.
    pub lights: Vec<Light>,
    /// What they are ordered by, kept for its memory.
    keyed: Vec<Keyed>,
}

impl SceneLights {
    /// Uploads lights in [`device_order`].
    ///
    /// # Errors
    /// Of the device.
    pub fn new(
        device: &gpu::Device,
        uploader: &mut gpu::Uploader,
        lights: &[Light],
    ) -> Result<Self, gpu::GpuError> {
        let lights = device_order(lights);
        let data: Vec<LightData> = lights.iter().map(light_data).collect();
        let spheres: Vec<[f32; 4]> = lights.iter().map(bounding_sphere).collect();
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
            keyed: Vec::new(),
        })
    }

    /// Moves the lights of a copy, which shares the images, in [`device_order`]; their records must be written anew ([`Self::fill_data`],
    /// [`Self::fill_spheres`]). False, and nothing moves, where they are not as many, or of other kinds: what is recorded for the old ones
    /// does not fit them. Memory is used again.
    pub fn set(&mut self, lights: &[Light]) -> bool {
        let unbounded = lights.iter().filter(|light| is_unbounded(light)).count() as u32;
        let only_points = lights.iter().all(|l| l.kind == LightKind::Point);
        let fits = lights.len() as u32 == self.count
            && unbounded == self.unbounded_count
            && only_points == self.only_points;
        if fits {
            order_into(lights, &mut self.keyed, &mut self.lights);
        }
        fits
    }

    /// Writes the records of [`Self::data`], as long as that image.
    pub fn fill_data(&self, bytes: &mut [u8]) {
        self.lights.iter().enumerate().for_each(|(i, light)| put(bytes, 64 * i, &[light_data(light)]));
    }

    /// Writes the spheres of [`Self::spheres`], as long as that image.
    pub fn fill_spheres(&self, bytes: &mut [u8]) {
        self.lights.iter().enumerate().for_each(|(i, light)| put(bytes, 16 * i, &[bounding_sphere(light)]));
    }

    /// Number of lights with an end.
    pub fn bounded_count(&self) -> u32 {
        self.count - self.unbounded_count
    }

    /// Number of a light in the order of the device, the first of equals; 0 where it is not there.
    pub fn index_of(&self, light: &Light) -> u32 {
        self.lights.iter().position(|one| one == light).unwrap_or_default() as u32
    }
}

/// Lights in the order in which the device holds and visits them: those without an end first, the others along a Morton curve through
/// their places, so that 32 in a row are neighbours. Stable: what is in order stays.
pub fn device_order(lights: &[Light]) -> Vec<Light> {
    let mut ordered = Vec::new();
    order_into(lights, &mut Vec::new(), &mut ordered);
    ordered
}

/// What a light is ordered by: whether it has an end, its place along the curve, its place in the list.
type Keyed = (bool, u64, u32);

/// As [`device_order`], into memory that is used again.
fn order_into(lights: &[Light], keyed: &mut Vec<Keyed>, ordered: &mut Vec<Light>) {
    let mut bounds_ws = Aabb::EMPTY;
    lights.iter().filter(|l| !is_unbounded(l)).for_each(|l| bounds_ws.extend(l.position_ws));
    let key = |(place, light): (u32, &Light)| match is_unbounded(light) {
        true => (false, 0, place),
        false => (true, morton_code(&bounds_ws, light.position_ws), place),
    };
    keyed.clear();
    keyed.extend((0..).zip(lights).map(key));
    // No two are equal, so that lights of one place stay in their order.
    keyed.sort_unstable();
    ordered.clear();
    ordered.extend(keyed.iter().map(|(.., place)| lights[*place as usize]));
}

/// Place of a point along the Morton curve through a box: 21 bits an axis, interleaved, steps of one length along all axes.
fn morton_code(bounds_ws: &Aabb, point_ws: Vec3) -> u64 {
    const STEPS: f32 = (1 << 21) as f32;
    let step_m = (bounds_ws.size().max_element() / STEPS).max(f32::MIN_POSITIVE);
    let at = ((point_ws - bounds_ws.min) / step_m).clamp(Vec3::ZERO, Vec3::splat(STEPS - 1.0));
    [at.x, at.y, at.z].iter().enumerate().fold(0, |code, (axis, at)| code | spread(*at as u64) << axis)
}

/// Bits 0 to 20 to every third bit.
fn spread(bits: u64) -> u64 {
    [
        (32, 0x1f_0000_0000_ffff),
        (16, 0x1f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
    ]
    .into_iter()
    .chain([(2, 0x1249_2492_4924_9249)])
    .fold(bits, |bits, (by, mask)| (bits | bits << by) & mask)
}

fn is_unbounded(light: &Light) -> bool {
    light.kind == LightKind::Directional || !light.range_m.is_finite()
}

/// Centre, world space, and radius, m, of the least sphere around what a light reaches: infinite where it has no end; around the
/// cone of a spot light of less than a right angle from its axis, whose corners are its place and the rim of its cap.
fn bounding_sphere(light: &Light) -> [f32; 4] {
    if is_unbounded(light) {
        return [0.0, 0.0, 0.0, f32::INFINITY];
    }
    let around = |offset_m: f32, radius_m: f32| {
        (light.position_ws + light.direction_ws * offset_m).extend(radius_m).into()
    };
    match light.kind {
        LightKind::Spot { outer_angle_rad, .. } if outer_angle_rad < std::f32::consts::FRAC_PI_4 => {
            // Through the apex and the rim, and the cap's pole is inside; room for the rounding of directions.
            let radius_m = 0.5 * light.range_m / outer_angle_rad.cos();
            around(radius_m, radius_m * 1.0001)
        }
        LightKind::Spot { outer_angle_rad, .. } if outer_angle_rad < std::f32::consts::FRAC_PI_2 => {
            let (sin, cos) = outer_angle_rad.sin_cos();
            around(light.range_m * cos, light.range_m * sin * 1.0001)
        }
        _ => around(0.0, light.range_m),
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn spot(outer_angle_rad: f32) -> Light {
        Light {
            kind: LightKind::Spot { inner_angle_rad: 0.0, outer_angle_rad },
            position_ws: Vec3::new(1.0, 2.0, 3.0),
            direction_ws: Vec3::new(2.0, -1.0, 2.0) / 3.0,
            intensity: Vec3::ONE,
            range_m: 5.0,
        }
    }

    #[test]
    fn spheres_hold_what_spot_lights_reach() {
        for outer_angle_rad in [0.01, 0.5, 0.78, 0.79, 1.2, 1.55, 1.6, 3.0] {
            let light = spot(outer_angle_rad);
            let [x, y, z, radius_m] = bounding_sphere(&light);
            assert!(radius_m <= light.range_m * 1.0001, "{outer_angle_rad}: {radius_m}");
            let side = light.direction_ws.any_orthonormal_vector();
            for i in 0..=64 {
                let (sin, cos) = (outer_angle_rad * i as f32 / 64.0).sin_cos();
                let rim = light.position_ws + (light.direction_ws * cos + side * sin) * light.range_m;
                for point in [rim, light.position_ws] {
                    let distance_m = point.distance(Vec3::new(x, y, z));
                    assert!(
                        distance_m <= radius_m * 1.000_001,
                        "{outer_angle_rad}: {distance_m} of {radius_m}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_curve_keeps_neighbours_together() {
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        assert_eq!(morton_code(&bounds, Vec3::ZERO), 0);
        assert_eq!(morton_code(&bounds, Vec3::ONE), (1 << 63) - 1);
        assert_eq!(morton_code(&bounds, Vec3::new(0.5, 0.0, 0.0)), 1 << 60);
        assert_eq!(morton_code(&bounds, Vec3::new(0.0, 0.25, 0.5)), 1 << 58 | 1 << 62);
        let lights = [spot(0.1), Light { kind: LightKind::Directional, ..spot(0.1) }];
        let ordered = device_order(&lights);
        assert_eq!(ordered[0].kind, LightKind::Directional);
        assert_eq!(device_order(&ordered), ordered);
    }
}
