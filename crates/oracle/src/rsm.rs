//! Indirect light from a reflective shadow map (Dachsbacher and Stamminger 2005).
//!
//! Here a texel's flux is the paper's, in lumens, and a sample stands for a number of texels; shaders hold flux by area instead.

use std::f64::consts::{PI, TAU};

use afterlight_scene::{Camera, Light, LightKind, Projection};
use glam::{DMat4, DVec2, DVec3};

use crate::{
    brdf::{Surface, range_window, spot_falloff},
    raster::{RayScene, pixel_ray},
    tiles::world_from_view,
};

/// A small light: what one texel of the map shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelLight {
    /// World space, metres.
    pub position_ws: DVec3,
    /// Unit.
    pub normal_ws: DVec3,
    /// Reflected flux, lumens by channel.
    pub flux: DVec3,
}

/// Which texels around a point are taken, and how much each counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    /// Offset in shares of the map's width, and weight.
    pub samples: Vec<(DVec2, f64)>,
    /// Radius of the disc that the samples stand for, a share of the map's width.
    pub radius: f64,
}

impl Pattern {
    /// Section 4.1: radius ξ1, angle 2π ξ2, weight ξ1^`power`, 2 in the paper; ξ1 in even steps, ξ2 the radical inverse.
    pub fn polar(count: u32, radius: f64, power: i32) -> Self {
        let samples = (0..count)
            .map(|i| {
                let xi1 = (f64::from(i) + 0.5) / f64::from(count);
                let xi2: f64 = (0..32).filter(|bit| i >> bit & 1 == 1).map(|bit| 0.5f64.powi(bit + 1)).sum();
                let angle = TAU * xi2;
                (DVec2::new(angle.sin(), angle.cos()) * (radius * xi1), xi1.powi(power))
            })
            .collect();
        Self { samples, radius }
    }
}

/// A light's view of a scene.
pub struct Rsm {
    texels: Vec<Option<PixelLight>>,
    size_px: u32,
    view_from_world: DMat4,
    /// Half the height of the view's plane, m; under perspective of the plane at distance 1.
    half_height: f64,
    is_perspective: bool,
}

impl Rsm {
    /// Looks through the light's camera with a ray a texel.
    pub fn new(rays: &RayScene<'_>, light: &Light, camera: &Camera, size_px: u32) -> Self {
        let (half_height, is_perspective) = match camera.projection {
            Projection::Perspective { fov_y_rad, .. } => ((0.5 * f64::from(fov_y_rad)).tan(), true),
            Projection::Orthographic { half_height_m, .. } => (f64::from(half_height_m), false),
        };
        let mut map = Self {
            texels: Vec::new(),
            size_px,
            view_from_world: world_from_view(camera).inverse(),
            half_height,
            is_perspective,
        };
        map.texels = (0..size_px * size_px)
            .map(|i| {
                let ray = pixel_ray(camera, [i % size_px, i / size_px], [size_px; 2]);
                let surface = rays.surface(&rays.first_hit(&ray)?);
                let reflectance =
                    if surface.unlit { DVec3::ZERO } else { surface.base_color * (1.0 - surface.metallic) };
                let incident = map.incident_flux(light, surface.position_ws);
                Some(PixelLight {
                    position_ws: surface.position_ws,
                    normal_ws: surface.normal_ws,
                    flux: reflectance * incident,
                })
            })
            .collect();
        map
    }

    /// Lumens of the light through the texel that sees a point.
    fn incident_flux(&self, light: &Light, position_ws: DVec3) -> DVec3 {
        let texel_area = (2.0 * self.half_height / f64::from(self.size_px)).powi(2);
        let intensity = light.intensity.as_dvec3();
        if light.kind == LightKind::Directional {
            return intensity * texel_area;
        }
        let offset = position_ws - light.position_ws.as_dvec3();
        let direction = offset.normalize();
        let angular = match light.kind {
            LightKind::Spot { inner_angle_rad, outer_angle_rad } => spot_falloff(
                direction.dot(light.direction_ws.as_dvec3().normalize()),
                inner_angle_rad.into(),
                outer_angle_rad.into(),
            ),
            _ => 1.0,
        };
        // Solid angle of an area of the plane at distance 1, which is seen at this cosine from a distance of 1 / cosine.
        let cosine = -(self.view_from_world.transform_vector3(direction)).z;
        let solid_angle = texel_area * cosine.powi(3);
        intensity * range_window(offset.length(), light.range_m.into()) * angular * solid_angle
    }

    /// A point's place in shares of the map, row 0 on top, and the scale of the view's plane there; `None` behind the light.
    fn project(&self, position_ws: DVec3) -> Option<(DVec2, f64)> {
        let p = self.view_from_world.transform_point3(position_ws);
        let scale = if self.is_perspective { -p.z } else { 1.0 };
        let on_plane = DVec2::new(p.x, -p.y) / (scale * self.half_height);
        (scale > 0.0).then_some((on_plane * 0.5 + 0.5, scale))
    }

    fn texel(&self, place: DVec2) -> Option<&PixelLight> {
        let inside = place.cmpge(DVec2::ZERO).all() && place.cmplt(DVec2::ONE).all();
        let [x, y] = (place * f64::from(self.size_px)).floor().to_array().map(|i| i as usize);
        inside.then(|| self.texels.get(y * self.size_px as usize + x)?.as_ref()).flatten()
    }

    /// Irradiance of a point by the texels of a pattern.
    pub fn irradiance(&self, position_ws: DVec3, normal_ws: DVec3, pattern: &Pattern) -> DVec3 {
        let Some((place, scale)) = self.project(position_ws) else { return DVec3::ZERO };
        let weights: f64 = pattern.samples.iter().map(|(_, weight)| weight).sum();
        let disc_texels = PI * (pattern.radius * f64::from(self.size_px)).powi(2);
        let texel_side_m = 2.0 * self.half_height * scale / f64::from(self.size_px);
        let mut sum = DVec3::ZERO;
        for (offset, weight) in &pattern.samples {
            let Some(light) = self.texel(place + *offset) else { continue };
            let texels = disc_texels * weight / weights;
            // The distance is at least the radius of a disc with the area of the texels that the sample stands for.
            let least_m = texel_side_m * (texels / PI).sqrt();
            sum += texels * pixel_irradiance(position_ws, normal_ws, light, least_m);
        }
        sum
    }

    /// Irradiance of a point by every texel: what patterns estimate, where the distance limits nothing.
    pub fn irradiance_by_all(&self, position_ws: DVec3, normal_ws: DVec3) -> DVec3 {
        let lights = self.texels.iter().flatten();
        lights.map(|light| pixel_irradiance(position_ws, normal_ws, light, 1e-4)).sum()
    }

    /// Radiance towards the eye by light that one surface has reflected before.
    pub fn radiance(&self, s: &Surface, pattern: &Pattern) -> DVec3 {
        if s.unlit {
            return DVec3::ZERO;
        }
        let diffuse = s.base_color * (1.0 - s.metallic) * s.occlusion / PI;
        diffuse * self.irradiance(s.position_ws, s.normal_ws, pattern)
    }
}

/// Equation 1, for flux in lumens: a Lambertian texel has an intensity of flux / π straight ahead.
fn pixel_irradiance(position_ws: DVec3, normal_ws: DVec3, light: &PixelLight, least_m: f64) -> DVec3 {
    let offset = position_ws - light.position_ws;
    let emitted = light.normal_ws.dot(offset).max(0.0);
    let received = normal_ws.dot(-offset).max(0.0);
    light.flux / PI * (emitted * received / offset.length().max(least_m).powi(4))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A light straight above a white square in the plane y = 0, seen by as many texels as asked for.
    fn lit_square(half_side_m: f64, size_px: u32, lux: f64) -> Rsm {
        let texel_m = 2.0 * half_side_m / f64::from(size_px);
        let at = |i: u32| (f64::from(i) + 0.5) * texel_m - half_side_m;
        let texels = (0..size_px * size_px).map(|i| {
            Some(PixelLight {
                position_ws: DVec3::new(at(i % size_px), 0.0, at(i / size_px)),
                normal_ws: DVec3::Y,
                flux: DVec3::splat(lux * texel_m * texel_m),
            })
        });
        // Looks down: x right, -z up.
        let camera = DMat4::from_cols(
            DVec3::X.extend(0.0),
            DVec3::NEG_Z.extend(0.0),
            DVec3::Y.extend(0.0),
            glam::DVec4::W,
        );
        Rsm {
            texels: texels.collect(),
            size_px,
            view_from_world: camera.inverse(),
            half_height: half_side_m,
            is_perspective: false,
        }
    }

    /// Form factor of a small surface to a square that it faces from `height_m` above the centre: four times that of a quarter,
    /// above its corner.
    fn square_form_factor(half_side_m: f64, height_m: f64) -> f64 {
        let side = half_side_m / height_m;
        let sine = side / (1.0 + side * side).sqrt();
        4.0 * 2.0 * sine * sine.atan() / TAU
    }

    #[test]
    fn all_texels_give_the_form_factor_of_a_square() {
        for height_m in [0.3, 1.0, 4.0] {
            let map = lit_square(1.0, 256, 10.0);
            let found = map.irradiance_by_all(DVec3::Y * height_m, DVec3::NEG_Y);
            let expected = 10.0 * square_form_factor(1.0, height_m);
            assert!((found.x / expected - 1.0).abs() < 1e-3, "{height_m} m: {found} for {expected}");
        }
    }

    /// The density of the samples falls as 1/ξ1, so a weight of ξ1 would be unbiased; the paper's ξ1² counts what is near less than
    /// its share. Both miss the corners of a square around the pattern's disc, a fifth of it.
    #[test]
    fn the_papers_weights_give_near_surfaces_too_little() {
        let map = lit_square(0.5, 256, 10.0);
        let share = |height_m: f64, power: i32| {
            let point = DVec3::Y * height_m;
            let all = map.irradiance_by_all(point, DVec3::NEG_Y).x;
            map.irradiance(point, DVec3::NEG_Y, &Pattern::polar(64, 0.5, power)).x / all
        };
        for (height_m, paper) in [(0.1, 0.37), (0.25, 0.64), (0.5, 0.77), (2.0, 0.79)] {
            let found = share(height_m, 2);
            assert!((found - paper).abs() < 0.01, "{height_m} m: {found}");
        }
        assert!((share(0.1, 1) - 1.0).abs() < 0.02, "{}", share(0.1, 1));
    }
}
