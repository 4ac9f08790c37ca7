//! A camera's matrices for an image size, and what of the scene they bound.

use std::ops::Range;

use afterlight_graph::{Rect, gpu::vk};
use afterlight_scene::{Aabb, Camera, Projection};
use afterlight_shader::structs::FrameConstants;
use glam::{Mat4, Vec3, Vec4};

use crate::{
    SceneLights, Settings,
    scene::{draw_list::QueryView, placed::Placed},
    views,
};

/// A camera's matrices for an image size.
pub struct CameraView {
    /// World to clip space.
    pub clip_from_world: Mat4,
    view_from_world: Mat4,
    projection: Projection,
    size_px: [u32; 2],
    /// The eye, world space, m; where a fitted orthographic view has moved it to.
    pub eye_ws: Vec3,
    /// How far the eye was moved along the view: how much less view distances are than from the camera, m.
    pub eye_moved_m: f32,
}

impl CameraView {
    /// The view of the settings' camera at their width and height, its depths fitted to all surfaces.
    pub fn fitted(settings: &Settings, placed: &Placed) -> Self {
        let bounds_ws = placed.all_bounds_ws(settings.effects.tessellation.displacement_m());
        let (camera, eye_moved_m) = settings.camera.fitted(&bounds_ws);
        Self { eye_moved_m, ..Self::new(&camera, [settings.width_px, settings.height_px]) }
    }

    /// The view of a camera for an image size, width and height in pixels.
    pub fn new(camera: &Camera, size_px: [u32; 2]) -> Self {
        let aspect = size_px[0] as f32 / size_px[1] as f32;
        Self {
            clip_from_world: camera.clip_from_world(aspect),
            view_from_world: camera.view_from_world(),
            projection: camera.projection,
            size_px,
            eye_ws: camera.eye_ws(),
            eye_moved_m: 0.0,
        }
    }

    /// The projection, fitted where the view is.
    pub fn projection(&self) -> &Projection {
        &self.projection
    }

    /// What the view distance of a point p, m, is: dot(xyz, p) + w. The view looks along -z.
    pub fn distance_from_world(&self) -> Vec4 {
        -self.view_from_world.row(2)
    }

    /// What draws are chosen for: this view, of draws within `bounds_ws`.
    pub fn query(&self, rows: Option<Range<u32>>, bounds_ws: Aabb, displacement_m: f32) -> QueryView {
        QueryView {
            clip_from_world: self.clip_from_world,
            eye_ws: self.eye_ws,
            height_px: self.size_px[1],
            size_on_image: self.size_on_image(),
            rows,
            bounds_ws,
            displacement_m,
        }
    }

    /// How large things are on the image: what they are divided by at a point p, dot(xyz, p) + w, and the pixels that 1 m is high where that is 1.
    fn size_on_image(&self) -> (Vec4, f32) {
        let half_px = 0.5 * self.size_px[1] as f32;
        match self.projection {
            Projection::Perspective { fov_y_rad, .. } => {
                (self.distance_from_world(), half_px / (0.5 * fov_y_rad).tan())
            }
            Projection::Orthographic { half_height_m, .. } => (Vec4::W, half_px / half_height_m),
        }
    }

    /// What `include/frame.glsl` declares, for this view of surfaces within `bounds_ws`, in the surroundings of the settings; of a view alone,
    /// see [`FrameTime::constants`](crate::FrameTime::constants).
    pub fn constants(&self, settings: &Settings, lights: &SceneLights, bounds_ws: &Aabb) -> FrameConstants {
        let distance_from_world = self.distance_from_world();
        let near_m = match self.projection {
            Projection::Perspective { near_m, .. } | Projection::Orthographic { near_m, .. } => near_m,
        };
        let to_eye = self.view_from_world.row(2).truncate();
        let (depth_to_distance, eye) = match self.projection {
            Projection::Perspective { near_m, .. } => {
                (Vec4::new(0.0, near_m, 1.0, 0.0), self.eye_ws.extend(1.0))
            }
            Projection::Orthographic { near_m, far_m, .. } => {
                (Vec4::new(near_m - far_m, far_m, 0.0, 1.0), to_eye.extend(0.0))
            }
        };
        FrameConstants {
            clip_from_world: self.clip_from_world.to_cols_array_2d(),
            world_from_clip: inverse(self.clip_from_world),
            depth_to_distance: depth_to_distance.into(),
            distance_from_world: distance_from_world.into(),
            eye_ws: eye.into(),
            size_px: self.size_px,
            tile_count: self.size_px.map(|px| px.div_ceil(16)),
            ambient_radiance: settings.environment.ambient_radiance.into(),
            light_count: lights.count,
            background_radiance: background_radiance(settings).into(),
            unbounded_light_count: lights.unbounded_count,
            distance_range_m: distance_range_m(bounds_ws, distance_from_world, near_m),
            samples: settings.samples,
            frame_index: 0,
            time_s: 0.0,
            before: 0,
            clip_from_world_before: self.clip_from_world.to_cols_array_2d(),
        }
    }
}

/// What techniques with stencil lose on a device that has no 32-bit float depth with stencil, in words; `None` where it has.
/// `range_m` is the nearest and farthest view distance of the scene.
pub fn coarse_depth_warning(
    format: vk::Format,
    projection: &Projection,
    range_m: [f32; 2],
) -> Option<String> {
    // Steps of depth: 2^-24 of the range of depth, which goes from 0 to 1.
    let steps = f64::from(1 << 24);
    let step_m = match *projection {
        Projection::Perspective { near_m, .. } => f64::from(range_m[1]).powi(2) / (f64::from(near_m) * steps),
        Projection::Orthographic { near_m, far_m, .. } => f64::from(far_m - near_m) / steps,
    };
    (format == vk::Format::D24_UNORM_S8_UINT).then(|| {
        format!(
            "depth with stencil has 24 bits on this device: techniques with a stencil confuse surfaces that are less than \
             {step_m:.2e} m apart at {:.0} m",
            range_m[1]
        )
    })
}

/// Nearest and farthest view distance, m, of what lies in a box and behind the near plane, with room for rounding. The nearest is
/// at least this share of the farthest: slices at equal ratios would else be spent on what nobody sees.
fn distance_range_m(bounds_ws: &Aabb, distance_from_world: Vec4, near_m: f32) -> [f32; 2] {
    const LEAST_SHARE: f32 = 1e-4;
    if bounds_ws.is_empty() {
        return [1.0, 2.0];
    }
    let center_m = distance_from_world.dot(bounds_ws.center().extend(1.0));
    let half_m = 0.5 * distance_from_world.truncate().abs().dot(bounds_ws.size());
    let farthest_m = (1.001 * (center_m + half_m)).max(f32::MIN_POSITIVE * 1e8);
    let nearest_m = (0.999 * (center_m - half_m)).max(0.999 * near_m).max(LEAST_SHARE * farthest_m);
    [nearest_m, farthest_m.max(2.0 * nearest_m)]
}

/// Radiance of pixels without a surface: none where it would be taken for pairs of lights.
pub fn background_radiance(settings: &Settings) -> Vec3 {
    match views::replaces_light(&settings.view) {
        true => Vec3::ZERO,
        false => settings.environment.background_radiance,
    }
}

/// Inverse, computed in 64 bits: positions are reconstructed through it.
fn inverse(m: Mat4) -> [[f32; 4]; 4] {
    m.as_dmat4().inverse().as_mat4().to_cols_array_2d()
}

/// Pixels that a box may cover: all where it reaches behind the eye's plane, none where it lies outside the image.
pub fn screen_rect(clip_from_world: Mat4, bounds: &Aabb, whole: Rect) -> Option<Rect> {
    let corners = (0..8).map(|i| {
        let pick = glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0);
        clip_from_world * Vec3::select(pick, bounds.max, bounds.min).extend(1.0)
    });
    let (mut low, mut high) = (glam::Vec2::INFINITY, glam::Vec2::NEG_INFINITY);
    for c in corners {
        if c.w <= 1e-6 {
            return Some(whole);
        }
        let ndc = c.truncate().truncate() / c.w;
        (low, high) = (low.min(ndc), high.max(ndc));
    }
    let size = glam::Vec2::new(whole.width_px as f32, whole.height_px as f32);
    // A pixel more on each side than rounding can move a bound.
    let low = ((low * 0.5 + 0.5) * size - 1.0).floor().max(glam::Vec2::ZERO);
    let high = ((high * 0.5 + 0.5) * size + 1.0).ceil().min(size);
    low.cmplt(high).all().then_some(Rect {
        x_px: low.x as u32,
        y_px: low.y as u32,
        width_px: (high.x - low.x) as u32,
        height_px: (high.y - low.y) as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WHOLE: Rect = Rect { x_px: 0, y_px: 0, width_px: 100, height_px: 60 };

    proptest! {
        /// Every pixel whose ray meets the box lies in the rectangle.
        #[test]
        fn the_rectangle_covers_the_box(c in prop::array::uniform3(-8f32..8.0), r in 0.1f32..3.0, p in prop::array::uniform3(-1f32..1.0)) {
            let clip = Camera::look_at("c", Vec3::new(0.0, 1.0, 9.0), Vec3::ZERO, 1.0, 0.1);
            let clip = clip.clip_from_world(100.0 / 60.0);
            let bounds = Aabb { min: Vec3::from(c) - r, max: Vec3::from(c) + r };
            let q = clip * (Vec3::from(c) + Vec3::from(p) * r).extend(1.0);
            prop_assume!(q.w > 0.0 && q.x.abs() <= q.w && q.y.abs() <= q.w);
            let (x, y) = ((q.x / q.w * 0.5 + 0.5) * 100.0, (q.y / q.w * 0.5 + 0.5) * 60.0);
            let rect = screen_rect(clip, &bounds, WHOLE).expect("a point of the box is on the image");
            prop_assert!(x >= rect.x_px as f32 && x <= (rect.x_px + rect.width_px) as f32);
            prop_assert!(y >= rect.y_px as f32 && y <= (rect.y_px + rect.height_px) as f32);
        }
    }
}
