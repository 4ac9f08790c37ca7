//! The illumination model in f64: glTF 2.0, appendix B (metal-rough), and KHR_lights_punctual.

use std::f64::consts::PI;

use afterlight_scene::{Light, LightKind};
use glam::DVec3;

/// Least perceptual roughness: α = 0.002025. Below, the highlight of a point light is narrower than
/// a pixel and its peak overflows 16-bit floats.
pub const MIN_ROUGHNESS: f64 = 0.045;

/// Least cosine between normal and view direction: a pixel may show a surface whose interpolated normal is turned away.
pub const MIN_N_DOT_V: f64 = 1e-4;

/// What shading needs to know of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Position in world space, metres.
    pub position_ws: DVec3,
    /// Unit normal in world space, on the side that is seen.
    pub normal_ws: DVec3,
    /// Linear base colour.
    pub base_color: DVec3,
    /// Metalness, 0 to 1.
    pub metallic: f64,
    /// Perceptual roughness, 0 to 1; clamped to [`MIN_ROUGHNESS`].
    pub roughness: f64,
    /// Share of the ambient light that arrives, 0 to 1.
    pub occlusion: f64,
    /// Radiance that the surface emits.
    pub emission: DVec3,
    /// Whether the base colour is the radiance that leaves.
    pub unlit: bool,
}

/// α of a perceptual roughness: its square, clamped.
pub fn alpha(roughness: f64) -> f64 {
    roughness.clamp(MIN_ROUGHNESS, 1.0).powi(2)
}

/// The distribution of microfacet normals, Trowbridge-Reitz (GGX): glTF 2.0, B.3.2.
pub fn ggx_distribution(n_dot_h: f64, alpha: f64) -> f64 {
    if n_dot_h <= 0.0 {
        return 0.0;
    }
    let a2 = alpha * alpha;
    a2 / (PI * (n_dot_h * n_dot_h * (a2 - 1.0) + 1.0).powi(2))
}

/// Smith's masking of one direction for GGX (Walter et al. 2007, equation 34).
pub fn smith_g1(n_dot_v: f64, alpha: f64) -> f64 {
    if n_dot_v <= 0.0 {
        return 0.0;
    }
    let a2 = alpha * alpha;
    2.0 * n_dot_v / (n_dot_v + (a2 + (1.0 - a2) * n_dot_v * n_dot_v).sqrt())
}

/// Height-correlated Smith masking and shadowing over `4 (n·l) (n·v)` (Heitz 2014, equation 99; glTF 2.0, B.3.2).
pub fn smith_visibility(n_dot_l: f64, n_dot_v: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let lambda = |c: f64| (a2 + (1.0 - a2) * c * c).sqrt();
    0.5 / (n_dot_l * lambda(n_dot_v) + n_dot_v * lambda(n_dot_l))
}

/// Schlick's approximation of Fresnel reflection (Schlick 1994).
pub fn schlick(f0: DVec3, v_dot_h: f64) -> DVec3 {
    f0 + (DVec3::ONE - f0) * (1.0 - v_dot_h.clamp(0.0, 1.0)).powi(5)
}

/// Reflectance at normal incidence.
pub fn f0(s: &Surface) -> DVec3 {
    DVec3::splat(0.04).lerp(s.base_color, s.metallic)
}

/// The BRDF, 1/sr, for unit directions to the eye and to the light; zero for light from below. Lambert's term loses what
/// the surface reflects: `(1 − F) (1 − metallic) base / π + F D V`.
pub fn brdf(s: &Surface, to_eye: DVec3, to_light: DVec3) -> DVec3 {
    let n_dot_l = s.normal_ws.dot(to_light);
    if n_dot_l <= 0.0 {
        return DVec3::ZERO;
    }
    let n_dot_v = s.normal_ws.dot(to_eye).max(MIN_N_DOT_V);
    let half = (to_eye + to_light).normalize();
    let alpha = alpha(s.roughness);
    let fresnel = schlick(f0(s), to_eye.dot(half));
    let specular = ggx_distribution(s.normal_ws.dot(half), alpha) * smith_visibility(n_dot_l, n_dot_v, alpha);
    let diffuse = s.base_color * (1.0 - s.metallic) / PI;
    (DVec3::ONE - fresnel) * diffuse + fresnel * specular
}

/// Illuminance of a surface that faces the light at a point, lux by channel, and the unit direction to the light.
pub fn illuminance(light: &Light, position_ws: DVec3) -> (DVec3, DVec3) {
    let intensity = light.intensity.as_dvec3();
    let direction_ws = light.direction_ws.as_dvec3().normalize();
    if light.kind == LightKind::Directional {
        return (intensity, -direction_ws);
    }
    let offset = light.position_ws.as_dvec3() - position_ws;
    // a light that lies in the surface is taken to be a tenth of a millimetre away
    let distance_sq = offset.length_squared().max(1e-8);
    let to_light = offset / distance_sq.sqrt();
    let falloff = range_window(distance_sq.sqrt(), f64::from(light.range_m)) / distance_sq;
    let angular = match light.kind {
        LightKind::Spot { inner_angle_rad, outer_angle_rad } => {
            spot_falloff(direction_ws.dot(-to_light), f64::from(inner_angle_rad), f64::from(outer_angle_rad))
        }
        _ => 1.0,
    };
    (intensity * falloff * angular, to_light)
}

/// The window that ends a light at its range (KHR_lights_punctual, "Range Property"); 1 for an infinite range.
pub fn range_window(distance_m: f64, range_m: f64) -> f64 {
    (1.0 - (distance_m / range_m).powi(4)).clamp(0.0, 1.0)
}

/// Falloff of a spot light by the cosine of the angle from its axis (KHR_lights_punctual, "Inner and Outer Cone Angles").
pub fn spot_falloff(cos_angle: f64, inner_rad: f64, outer_rad: f64) -> f64 {
    let scale = 1.0 / (inner_rad.cos() - outer_rad.cos()).max(0.001);
    let attenuation = (cos_angle * scale - outer_rad.cos() * scale).clamp(0.0, 1.0);
    attenuation * attenuation
}

/// Radiance towards the eye that one light causes.
pub fn light_radiance(s: &Surface, to_eye: DVec3, light: &Light) -> DVec3 {
    let (lux, to_light) = illuminance(light, s.position_ws);
    lux * brdf(s, to_eye, to_light) * s.normal_ws.dot(to_light).max(0.0)
}

/// Radiance towards the eye: emission, `base × occlusion × ambient`, and all lights; of an unlit surface its base colour.
pub fn shade(s: &Surface, to_eye: DVec3, lights: &[Light], ambient_radiance: DVec3) -> DVec3 {
    if s.unlit {
        return s.base_color;
    }
    let ambient = s.emission + s.base_color * s.occlusion * ambient_radiance;
    lights.iter().fold(ambient, |sum, light| sum + light_radiance(s, to_eye, light))
}
