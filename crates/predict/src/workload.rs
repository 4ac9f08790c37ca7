//! The cost model's symbols for a view of a scene.

use afterlight_scene::{Camera, LightKind, Projection, Scene};
use afterlight_techniques::Settings;
use afterlight_techniques::cost::Workload;

/// Vertices of a light volume (an icosahedron subdivided once).
const LIGHT_VOLUME_VERTICES: f64 = 42.0;

/// Vertices of all instances.
pub fn vertices(scene: &Scene) -> f64 {
    scene.instances.iter().map(|one| f64::from(scene.meshes[one.mesh as usize].vertex_count)).sum()
}

/// The cost model's symbols for a view of so many objects (draws of the scene) and vertices.
///
/// How many fragments the objects have is not known before a frame is drawn: the symbol begins as the number of pixels, each
/// covered once, and whoever draws a reference frame replaces it by what the device counts.
pub fn of_view(objects: f64, object_vertices: f64, settings: &Settings) -> Workload {
    let pixels = f64::from(settings.width_px) * f64::from(settings.height_px);
    let lights = settings.lights.len() as f64;
    let light_fragments = settings
        .lights
        .iter()
        .map(|light| match light.kind {
            LightKind::Directional => pixels,
            _ => {
                sphere_pixels(&settings.camera, light.position_ws, light.range_m, settings.height_px, pixels)
            }
        })
        .sum();
    Workload {
        objects,
        lights,
        object_vertices,
        light_vertices: lights * LIGHT_VOLUME_VERTICES,
        object_fragments: pixels,
        light_fragments,
        pixels,
        tiles: f64::from(settings.width_px.div_ceil(16)) * f64::from(settings.height_px.div_ceil(16)),
        shading_samples: f64::from(settings.samples),
        light_list_floats: light_fragments / 256.0,
        ..Workload::default()
    }
}

/// Pixels that a light's sphere covers, by the area of its circle, at most the image; 0 behind the eye.
fn sphere_pixels(camera: &Camera, center_ws: glam::Vec3, radius_m: f32, height_px: u32, pixels: f64) -> f64 {
    let center_vs = camera.view_from_world().transform_point3(center_ws);
    let distance_m = f64::from(-center_vs.z);
    let radius_m = f64::from(radius_m);
    if !radius_m.is_finite() || f64::from(center_vs.length()) <= radius_m {
        return pixels;
    }
    if distance_m <= -radius_m {
        return 0.0;
    }
    let half_height_m = match camera.projection {
        Projection::Perspective { fov_y_rad, .. } => {
            distance_m.max(radius_m) * (f64::from(fov_y_rad) / 2.0).tan()
        }
        Projection::Orthographic { half_height_m, .. } => f64::from(half_height_m),
    };
    let radius_px = radius_m / half_height_m * f64::from(height_px) / 2.0;
    (std::f64::consts::PI * radius_px * radius_px).min(pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(width_px: u32, height_px: u32) -> Settings {
        let scene =
            afterlight_scene::load_source("builtin:spheres", &Default::default()).expect("is built in");
        Settings::for_scene(&scene, width_px, height_px)
    }

    #[test]
    fn tiles_cover_the_image() {
        let counted = of_view(3.0, 100.0, &settings(33, 16));
        assert_eq!((counted.objects, counted.object_vertices), (3.0, 100.0));
        assert_eq!((counted.pixels, counted.tiles, counted.object_fragments), (528.0, 3.0, 528.0));
    }

    #[test]
    fn a_sphere_covers_its_circle_all_or_nothing() {
        let pixels = 100.0 * 100.0;
        // An eye at the origin that looks along −Z, 90 degrees high: at 10 m the image is 20 m high.
        let camera = Camera::look_at("c", glam::Vec3::ZERO, glam::Vec3::NEG_Z, 90f32.to_radians(), 0.1);
        let covered = |z_m: f32, radius_m: f32| {
            sphere_pixels(&camera, glam::Vec3::new(0.0, 0.0, z_m), radius_m, 100, pixels)
        };
        let expected = std::f64::consts::PI * 5.0 * 5.0;
        assert!((covered(-10.0, 1.0) - expected).abs() < 0.01, "{}", covered(-10.0, 1.0));
        assert_eq!(covered(-0.5, 1.0), pixels, "the eye is inside");
        assert_eq!(covered(10.0, 1.0), 0.0, "behind the eye");
        assert_eq!(covered(-10.0, f32::INFINITY), pixels, "no end");
    }
}
