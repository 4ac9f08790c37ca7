//! Shadows by rays from the light to a point, without a map.

use afterlight_scene::{Camera, Light, LightKind, Projection};
use glam::{DMat4, DVec3};

use crate::{
    raster::{Ray, RayScene},
    tiles::world_from_view,
};

/// Share of a ray before a point in which nothing shadows it: a millionth, far more than rounding.
const BEFORE: f64 = 1e-6;

/// A light and what stands in its way.
pub struct Shadows<'a> {
    rays: &'a RayScene<'a>,
    light: Light,
    /// Farther than any two points of the scene are apart, m.
    reach_m: f64,
}

impl<'a> Shadows<'a> {
    /// The shadows of one light.
    pub fn new(rays: &'a RayScene<'a>, light: &Light) -> Self {
        let reach_m = 2.0 * f64::from(rays.scene().bounds_ws().size().length());
        Self { rays, light: *light, reach_m }
    }

    /// Whether nothing is between the light and a point. What the light sees the back of counts where it is double-sided.
    pub fn reaches(&self, position_ws: DVec3) -> bool {
        let origin_ws = match self.light.kind {
            LightKind::Directional => position_ws - self.direction_ws() * self.reach_m,
            LightKind::Point | LightKind::Spot { .. } => self.light.position_ws.as_dvec3(),
        };
        let ray = Ray { origin_ws, direction_ws: position_ws - origin_ws, range_m: [0.0, 1.0 - BEFORE] };
        self.rays.first_hit(&ray).is_none()
    }

    fn direction_ws(&self) -> DVec3 {
        self.light.direction_ws.as_dvec3().normalize()
    }

    /// Unit direction of the light at a point.
    pub fn direction_at(&self, position_ws: DVec3) -> DVec3 {
        match self.light.kind {
            LightKind::Directional => self.direction_ws(),
            LightKind::Point | LightKind::Spot { .. } => {
                (position_ws - self.light.position_ws.as_dvec3()).normalize()
            }
        }
    }

    /// Whether the light reaches all of a plane around a point, or nothing of it: no edge of a shadow is within `texels` of a
    /// map of `size_px` texels a side, along each axis of a view of the light. A grid of 5 × 5 points, ones off the plane's
    /// horizon; false where the light meets the plane at less than 14°: there surfaces made of facets, each steeper than the one
    /// before, shadow themselves in part under any bias that knows one of them.
    pub fn is_steady(
        &self,
        position_ws: DVec3,
        plane_normal_ws: DVec3,
        view: &Camera,
        size_px: u32,
        texels: f64,
    ) -> bool {
        if plane_normal_ws.dot(self.direction_at(position_ws)).abs() < 0.25 {
            return false;
        }
        let pose = world_from_view(view);
        let step_m = 0.5 * texels * texel_width_m(&pose, view, position_ws, size_px);
        let reached = self.reaches(position_ws);
        (0..25).all(|i| {
            let [right, up] = [i % 5, i / 5].map(|k| f64::from(k - 2) * step_m);
            let offset = pose.transform_vector3(DVec3::new(right, up, 0.0));
            let point = self.on_plane(position_ws, plane_normal_ws, position_ws + offset);
            point.is_some_and(|point| self.reaches(point) == reached)
        })
    }

    /// Where the light's ray through a point meets a plane; `None` where it does not.
    fn on_plane(&self, origin_ws: DVec3, normal_ws: DVec3, through_ws: DVec3) -> Option<DVec3> {
        let direction = self.direction_at(through_ws);
        let along = (origin_ws - through_ws).dot(normal_ws) / direction.dot(normal_ws);
        let point = through_ws + direction * along;
        // A light at a place: the plane must be before it.
        let ahead = (point - self.light.position_ws.as_dvec3()).dot(direction) > 0.0;
        (along.is_finite() && (self.light.kind == LightKind::Directional || ahead)).then_some(point)
    }
}

/// Width of a texel of a light's view where a point is, m.
fn texel_width_m(pose: &DMat4, view: &Camera, position_ws: DVec3, size_px: u32) -> f64 {
    let width_m = match view.projection {
        Projection::Orthographic { half_height_m, .. } => 2.0 * f64::from(half_height_m),
        Projection::Perspective { fov_y_rad, .. } => {
            let distance_m = -pose.inverse().transform_point3(position_ws).z;
            2.0 * distance_m * (0.5 * f64::from(fov_y_rad)).tan()
        }
    };
    width_m / f64::from(size_px)
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_scene::load_source;
    use glam::Vec3;

    /// Blades stand through a floor from y = -0.7 on, up to 1.5; the sun comes from x, y, z > 0.
    #[test]
    fn a_floor_is_lit_beside_what_stands_on_it_and_not_behind() {
        let scene = load_source("builtin:intersect", &Default::default()).unwrap_or_else(|e| panic!("{e}"));
        let rays = RayScene::new(&scene);
        let shadows = Shadows::new(&rays, &scene.lights[0]);
        let lamp = Light { kind: LightKind::Point, position_ws: Vec3::new(0.8, 2.0, 1.2), ..scene.lights[0] };
        for shadows in [shadows, Shadows::new(&rays, &lamp)] {
            assert!(shadows.reaches(DVec3::new(2.5, 0.0, 2.5)));
            assert!(shadows.reaches(DVec3::new(-2.8, 0.0, 0.5)));
            assert!(!shadows.reaches(DVec3::new(-0.2, 0.0, -0.3)));
            assert!(!shadows.reaches(DVec3::new(0.0, -0.5, 0.0)));
        }
    }
}
