//! Which draws a view needs, in which order: frustum culling and sorting on the CPU, written as indirect commands.

use std::ops::Range;

use afterlight_scene::Aabb;
use glam::{Mat4, Vec3, Vec4};

use crate::{
    Cull, DrawOrder, DrawParams,
    scene::{BUCKETS, DrawInfo, SceneGpu},
    sort_words::{least_first, place_of},
    upload::put,
};

/// `VkDrawIndexedIndirectCommand`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct DrawCommand {
    /// Indices of the draw.
    pub index_count: u32,
    /// Always 1.
    pub instance_count: u32,
    /// First index in the scene's index buffer.
    pub first_index: u32,
    /// Added to every index.
    pub vertex_offset: i32,
    /// The draw's number: instances are draws.
    pub first_instance: u32,
}

/// Distance between commands in the buffer, bytes.
pub const COMMAND_BYTES: u64 = size_of::<DrawCommand>() as u64;

/// Draws in view, by bucket, in drawing order.
#[derive(Clone, Debug, Default)]
pub struct DrawChoice {
    /// How draws are chosen and ordered.
    pub options: DrawParams,
    /// Draws in view, by bucket, in drawing order.
    pub visible: [Vec<u32>; BUCKETS],
    /// What they are sorted by ([`crate::sort_words`]), kept for its memory.
    keyed: Vec<u64>,
}

impl DrawChoice {
    /// No draws.
    pub fn new(options: DrawParams) -> Self {
        Self { options, ..Self::default() }
    }

    /// Chooses and orders the draws for a view, which stand where `infos` says; surfaces may be displaced by `displacement_m` along each axis.
    pub fn update(
        &mut self,
        scene: &SceneGpu,
        infos: &[DrawInfo],
        (clip_from_world, eye_ws): (Mat4, Vec3),
        displacement_m: f32,
    ) {
        let frustum = Frustum::new(clip_from_world);
        let Self { options, visible, keyed } = self;
        for (bucket, visible) in visible.iter_mut().enumerate() {
            let (first, end) = (scene.bucket_first[bucket], scene.bucket_first[bucket + 1]);
            let in_view = |draw: &u32| {
                let bounds = &infos[*draw as usize].bounds_ws;
                options.cull == Cull::None || frustum.touches(&displaced(bounds, displacement_m))
            };
            keyed.clear();
            let key = |draw: u32| options.order.key(&infos[draw as usize].bounds_ws, eye_ws);
            // Draws of one distance keep the scene's order, so that equal depths resolve alike in every technique.
            keyed.extend((first..end).filter(in_view).map(|draw| least_first(key(draw), draw)));
            if options.order != DrawOrder::Scene {
                keyed.sort_unstable();
            }
            visible.clear();
            visible.extend(keyed.iter().copied().map(place_of));
        }
    }

    /// Number of draws in view.
    pub fn count(&self) -> u32 {
        self.visible.iter().map(|bucket| bucket.len() as u32).sum()
    }
}

/// Writes the commands of draws, one range a bucket, into a buffer with room for every draw of the scene.
pub fn write_commands(scene: &SceneGpu, visible: &[Vec<u32>; BUCKETS], bytes: &mut [u8]) {
    for (bucket, visible) in visible.iter().enumerate() {
        let first = scene.bucket_first[bucket] as usize;
        for (place, draw) in (first..).zip(visible) {
            let one = command(&scene.rest.infos[*draw as usize], *draw);
            put(bytes, place * COMMAND_BYTES as usize, &[one]);
        }
    }
}

/// Writes the number of commands of each bucket, 32 bits each.
pub fn write_counts(visible: &[Vec<u32>; BUCKETS], bytes: &mut [u8]) {
    put(bytes, 0, &visible.each_ref().map(|bucket| bucket.len() as u32));
}

/// The indirect command of a draw; instances are draws.
pub fn command(info: &DrawInfo, draw: u32) -> DrawCommand {
    DrawCommand {
        index_count: info.index_count,
        instance_count: 1,
        first_index: info.first_index,
        vertex_offset: info.first_vertex as i32,
        first_instance: draw,
    }
}

/// What surfaces of those bounds reach where they are displaced by up to `displacement_m` along each axis.
pub fn displaced(bounds: &Aabb, displacement_m: f32) -> Aabb {
    let margin = Vec3::splat(displacement_m);
    Aabb { min: bounds.min - margin, max: bounds.max + margin }
}

impl DrawOrder {
    /// What draws are sorted by.
    fn key(self, bounds: &Aabb, eye_ws: Vec3) -> f32 {
        match self {
            Self::Near => distance_sq(bounds, eye_ws),
            Self::Center => bounds.center().distance_squared(eye_ws),
            Self::Scene => 0.0,
        }
    }
}

/// Squared distance from a point to a box, 0 inside.
fn distance_sq(bounds: &Aabb, point: Vec3) -> f32 {
    point.clamp(bounds.min.min(bounds.max), bounds.max.max(bounds.min)).distance_squared(point)
}

/// Half-spaces of a view: inside where dot(xyz, p) + w ≥ 0.
pub struct Frustum([Vec4; 6]);

impl Frustum {
    /// Rows of clip_from_world combined (Gribb and Hartmann 2001); depth is reversed, so near is w − z and far z.
    pub fn new(m: Mat4) -> Self {
        let (x, y, z, w) = (m.row(0), m.row(1), m.row(2), m.row(3));
        Self([w + x, w - x, w + y, w - y, w - z, z])
    }

    /// Whether a box may be in view: false only where it lies outside one half-space as a whole. Boxes with a bound
    /// that is no number are kept.
    pub fn touches(&self, bounds: &Aabb) -> bool {
        touches(&self.0, bounds)
    }
}

/// Some rows of the image, as half-spaces above and below them; the image's own upper and lower bound bound nothing.
pub struct Rows(Vec<Vec4>);

impl Rows {
    /// Rows of an image `height_px` high, with one more to each side than rounding can move a bound.
    pub fn new(clip_from_world: Mat4, rows: Range<u32>, height_px: u32) -> Self {
        let (y, w) = (clip_from_world.row(1), clip_from_world.row(3));
        let ndc = |row: f32| 2.0 * row / height_px as f32 - 1.0;
        let mut planes = Vec::new();
        if rows.start > 0 {
            planes.push(y - w * ndc(rows.start as f32 - 1.0));
        }
        if rows.end < height_px {
            planes.push(w * ndc(rows.end as f32 + 1.0) - y);
        }
        Self(planes)
    }

    /// Whether a box may reach the rows.
    pub fn touch(&self, bounds: &Aabb) -> bool {
        touches(&self.0, bounds)
    }
}

/// Whether a box may lie within half-spaces: false only where it lies outside one of them as a whole. Boxes with a bound that is no
/// number are kept.
fn touches(planes: &[Vec4], bounds: &Aabb) -> bool {
    !planes.iter().any(|plane| {
        let n = plane.truncate();
        let farthest = Vec3::select(n.cmpge(Vec3::ZERO), bounds.max, bounds.min);
        n.dot(farthest) + plane.w < 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_scene::Camera;
    use proptest::prelude::*;

    proptest! {
        /// A box with a corner in the clip volume is never culled.
        #[test]
        fn boxes_in_view_are_kept(c in prop::array::uniform3(-20f32..20.0), s in prop::array::uniform3(0f32..5.0),
                                  e in prop::array::uniform3(-10f32..10.0)) {
            let camera = Camera::look_at("c", e.into(), Vec3::new(0.3, 0.2, 0.1), 1.0, 0.1);
            let clip = camera.clip_from_view(1.5) * camera.view_from_world();
            let bounds = Aabb { min: Vec3::from(c) - Vec3::from(s), max: Vec3::from(c) + Vec3::from(s) };
            let seen = (0..8).any(|i| {
                let p = Vec3::select(glam::BVec3::new(i & 1 == 1, i & 2 == 2, i & 4 == 4), bounds.max, bounds.min);
                let q = clip * p.extend(1.0);
                q.x.abs() <= q.w && q.y.abs() <= q.w && q.z >= 0.0 && q.z <= q.w
            });
            prop_assert!(!seen || Frustum::new(clip).touches(&bounds));
        }

        /// Every corner that is seen is in rows that its box is said to reach.
        #[test]
        fn boxes_are_kept_in_the_rows_that_they_reach(c in prop::array::uniform3(-20f32..20.0), s in prop::array::uniform3(0f32..5.0)) {
            let clip = Camera::look_at("c", Vec3::new(1.0, 2.0, 9.0), Vec3::ZERO, 1.0, 0.1).clip_from_world(1.5);
            let bounds = Aabb { min: Vec3::from(c) - Vec3::from(s), max: Vec3::from(c) + Vec3::from(s) };
            for corner in [bounds.min, bounds.max, bounds.center()] {
                let q = clip * corner.extend(1.0);
                let row = (q.y / q.w * 0.5 + 0.5) * 64.0;
                if q.w > 0.0 && (0.0..64.0).contains(&row) {
                    let band = row as u32 / 16 * 16;
                    prop_assert!(Rows::new(clip, band..band + 16, 64).touch(&bounds), "{corner} in row {row}");
                }
            }
        }
    }

    #[test]
    fn a_box_above_rows_is_not_in_them() {
        let clip = Camera::look_at("c", Vec3::ZERO, Vec3::NEG_Z, 1.0, 0.1).clip_from_world(1.0);
        let bounds = Aabb { min: Vec3::new(-1.0, 0.5, -4.0), max: Vec3::new(1.0, 1.0, -3.0) };
        let reaches = |rows| Rows::new(clip, rows, 64).touch(&bounds);
        assert_eq!([0..16, 16..32, 32..48, 48..64].map(reaches), [true, true, false, false]);
        assert!(reaches(0..64));
    }

    #[test]
    fn a_box_behind_the_eye_is_culled() {
        let camera = Camera::look_at("c", Vec3::ZERO, Vec3::NEG_Z, 1.0, 0.1);
        let clip = camera.clip_from_view(1.0) * camera.view_from_world();
        let bounds = Aabb { min: Vec3::new(-1.0, -1.0, 2.0), max: Vec3::new(1.0, 1.0, 3.0) };
        assert!(!Frustum::new(clip).touches(&bounds));
    }
}
