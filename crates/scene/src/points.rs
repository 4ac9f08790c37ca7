//! Points on the surfaces of a scene, drawn at random: where cameras and probes are put.

use glam::Vec3;

use crate::{Scene, camera::world_triangle, rng::SplitMix64};

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Its place, world space, metres.
    pub position_ws: Vec3,
    /// Unit normal of its triangle on the front, world space.
    pub normal_ws: Vec3,
}

/// Draws points of the scene's surfaces: every second one uniformly by area, so that walls and floors are met, the others uniformly by
/// triangle, so that small details are met. None where no triangle has an area.
pub fn surface_points(scene: &Scene, count: usize, seed: u64) -> Vec<SurfacePoint> {
    let mut triangles = Vec::new();
    let mut areas_m2 = Vec::new();
    let mut sum_m2 = 0.0f64;
    for (index, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh as usize];
        for triangle in 0..mesh.index_count as usize / 3 {
            let [a, b, c] = world_triangle(scene, instance, triangle);
            let area_m2 = 0.5 * f64::from((b - a).cross(c - a).length());
            if area_m2.is_finite() && area_m2 > 0.0 {
                sum_m2 += area_m2;
                triangles.push((index, triangle));
                areas_m2.push(sum_m2);
            }
        }
    }
    if triangles.is_empty() {
        return Vec::new();
    }
    let mut rng = SplitMix64::new(seed);
    let point = |i: usize| {
        let pick = f64::from(rng.next_f32());
        let place = match i % 2 {
            0 => areas_m2.partition_point(|area_m2| *area_m2 <= pick * sum_m2),
            _ => (pick * triangles.len() as f64) as usize,
        };
        let (index, triangle) = triangles[place.min(triangles.len() - 1)];
        let [a, b, c] = world_triangle(scene, &scene.instances[index], triangle);
        // Uniform in a triangle: the half of a parallelogram that lies beyond is folded back.
        let (mut u, mut v) = (rng.next_f32(), rng.next_f32());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let normal_ws = (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize_or(glam::DVec3::Y).as_vec3();
        SurfacePoint { position_ws: a + (b - a) * u + (c - a) * v, normal_ws }
    };
    (0..count).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_floor_are_spread_over_it() {
        let scene = crate::builtin::build("builtin:floor?width=10").expect("is there");
        let points = surface_points(&scene, 400, 1);
        assert!(points.iter().all(|p| p.position_ws.y == 0.0 && p.normal_ws.abs_diff_eq(Vec3::Y, 1e-6)));
        for (x, z) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
            let count =
                points.iter().filter(|p| p.position_ws.x * x > 0.0 && p.position_ws.z * z > 0.0).count();
            assert!((70..130).contains(&count), "{count} of 400 in a quarter");
        }
        assert_eq!(points, surface_points(&scene, 400, 1));
        assert!(surface_points(&Scene::default(), 4, 1).is_empty());
    }
}
