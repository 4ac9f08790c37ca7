//! Integrals of the BRDF with known answers, by midpoint quadrature over the microfacet normals.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::brdf::{Surface, alpha, brdf, f0, ggx_distribution, schlick, smith_g1, smith_visibility};

/// Steps of the quadrature in elevation and in azimuth.
const STEPS: [u32; 2] = [512, 256];

/// Sums `f(h)` over unit vectors h about +Z so that the sum tends to the integral of `f(h) D(h) (n·h)`. GGX normals follow
/// `tan² θ = α² u / (1 − u)` for uniform u; `u = 1 − (1 − w)²` takes away the pole at the horizon.
fn integrate_over_normals(alpha: f64, f: impl Fn(DVec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for i in 0..STEPS[0] {
        let w = (f64::from(i) + 0.5) / f64::from(STEPS[0]);
        let u = 1.0 - (1.0 - w) * (1.0 - w);
        let tan_sq = alpha * alpha * u / (1.0 - u);
        let cos = 1.0 / (1.0 + tan_sq).sqrt();
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        for k in 0..STEPS[1] {
            let angle = TAU * (f64::from(k) + 0.5) / f64::from(STEPS[1]);
            sum += f(DVec3::new(sin * angle.cos(), sin * angle.sin(), cos)) * 2.0 * (1.0 - w);
        }
    }
    sum / (f64::from(STEPS[0]) * f64::from(STEPS[1]))
}

/// The unit direction at an angle of cosine `n_dot_v` from +Z, in the XZ plane.
fn direction(n_dot_v: f64) -> DVec3 {
    DVec3::new((1.0 - n_dot_v * n_dot_v).max(0.0).sqrt(), 0.0, n_dot_v)
}

/// The weak white furnace (Heitz 2014, equation 85): the integral of `D(h) G1(v) / (4 n·v)` over all directions of light,
/// 1 whatever the roughness and the angle, since it is the share of the projected area that is seen.
pub fn weak_white_furnace(n_dot_v: f64, roughness: f64) -> f64 {
    let (alpha, v) = (alpha(roughness), direction(n_dot_v));
    // dl = 4 (v·h) dh
    integrate_over_normals(alpha, |h| v.dot(h).max(0.0) * smith_g1(n_dot_v, alpha) / (n_dot_v * h.z))
}

/// The integral of `D(h) (n·h)` over the hemisphere by even steps: 1.
pub fn distribution_norm(roughness: f64) -> f64 {
    let (alpha, steps) = (alpha(roughness), 1_000_000);
    let width = 1.0 / f64::from(steps);
    // in s = sin² θ: (n·h) dω = π ds
    (0..steps)
        .map(|i| PI * ggx_distribution((1.0 - (f64::from(i) + 0.5) * width).sqrt(), alpha) * width)
        .sum()
}

/// Share of the light from a white sky that a surface sends to an eye at `n_dot_v`, by channel: the specular and the
/// diffuse lobe. `normal_ws` of `s` is not used.
///
/// Either lobe alone is at most 1. Their sum is not: glTF takes from the diffuse lobe what the half vector's Fresnel
/// term reflects, not what the whole specular lobe does, so that at grazing angles a smooth white dielectric sends back more than
/// it gets (1.72 at a cosine of 0.05; at most 1.05 at cosines from 0.5). That is the model, and every technique shares it.
pub fn directional_albedo(s: &Surface, n_dot_v: f64) -> [DVec3; 2] {
    let v = direction(n_dot_v);
    let upright = Surface { normal_ws: DVec3::Z, ..*s };
    [specular_albedo(&upright, v), diffuse_albedo(&upright, v)]
}

/// The specular part of [`directional_albedo`], over microfacet normals.
fn specular_albedo(s: &Surface, v: DVec3) -> DVec3 {
    let alpha = alpha(s.roughness);
    // all but Fresnel's term, as F = f0 + (1 − f0) w: the integrals of 1 and of w
    let integral = |fresnel: &dyn Fn(f64) -> f64| {
        integrate_over_normals(alpha, |h| {
            let v_dot_h = v.dot(h);
            let l = 2.0 * v_dot_h * h - v;
            if v_dot_h <= 0.0 || l.z <= 0.0 {
                return 0.0;
            }
            // dl = 4 (v·h) dh
            fresnel(v_dot_h) * smith_visibility(l.z, v.z, alpha) * l.z * 4.0 * v_dot_h / h.z
        })
    };
    let (all, edge) = (integral(&|_| 1.0), integral(&|v_dot_h| schlick(DVec3::ZERO, v_dot_h).x));
    f0(s) * (all - edge) + edge
}

/// The diffuse part of [`directional_albedo`], by steps of even projected solid angle.
fn diffuse_albedo(s: &Surface, v: DVec3) -> DVec3 {
    let steps = [128, 128];
    let mut sum = DVec3::ZERO;
    for i in 0..steps[0] {
        let sin_sq = (f64::from(i) + 0.5) / f64::from(steps[0]);
        for k in 0..steps[1] {
            let angle = TAU * (f64::from(k) + 0.5) / f64::from(steps[1]);
            let l =
                DVec3::new(sin_sq.sqrt() * angle.cos(), sin_sq.sqrt() * angle.sin(), (1.0 - sin_sq).sqrt());
            let h = (v + l).normalize();
            let fresnel = schlick(f0(s), v.dot(h));
            sum += (DVec3::ONE - fresnel) * s.base_color * (1.0 - s.metallic);
        }
    }
    sum / f64::from(steps[0] * steps[1])
}

/// Radiance of a sphere of centre `center_ws` and `radius_m` where a ray meets it first, lit by one distant light of
/// `lux` from `to_light`: the closed form that a tessellated sphere tends to. `None` where the ray misses.
pub fn lit_sphere(
    s: &Surface,
    center_ws: DVec3,
    radius_m: f64,
    origin_ws: DVec3,
    direction_ws: DVec3,
    to_light: DVec3,
    lux: DVec3,
) -> Option<DVec3> {
    let d = direction_ws.normalize();
    let offset = origin_ws - center_ws;
    let b = offset.dot(d);
    let discriminant = b * b - (offset.length_squared() - radius_m * radius_m);
    let t = -b - if discriminant < 0.0 { return None } else { discriminant.sqrt() };
    let position_ws = origin_ws + t * d;
    let normal_ws = (position_ws - center_ws) / radius_m;
    let point = Surface { position_ws, normal_ws, ..*s };
    (t > 0.0).then(|| lux * brdf(&point, -d, to_light) * normal_ws.dot(to_light).max(0.0))
}
