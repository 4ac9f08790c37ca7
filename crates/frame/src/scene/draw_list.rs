//! Which draws a view needs, in which order, and their indirect commands: the CPU's way, and the twin of the device's.

use std::ops::Range;

use afterlight_scene::Aabb;
use afterlight_shader::structs::{DrawChoiceConstants, ORDER_CENTER, ORDER_NEAR, ORDER_SCENE};
use glam::{Mat4, Vec3, Vec4};

use crate::{
    Cull, DrawOrder, DrawParams,
    scene::{BUCKETS, DrawInfo, SceneGpu},
    sort_words::place_of,
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

/// Bins of distance that draws are ordered by: `BINS` in `shared/cull/choice.glsl` of the stages.
pub const BINS: u32 = 256;

/// Bits of a float's mantissa below a step of distance: eight steps a doubling of a square, so that neighbours are 4.4% apart.
const STEP_SHIFT: u32 = 20;

/// Half-spaces of a choice.
const PLANES: usize = 8;

/// Draws of a view, by bucket, in drawing order.
pub type DrawsInOrder = [Vec<u32>; BUCKETS];

/// What decides which draws a view needs and in which order. The device computes the same from the same constants
/// (`shared/cull/choice.glsl` of the stages), operation by operation, so that both come to one list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawQuery(pub DrawChoiceConstants);

/// The view that draws are chosen for.
pub struct QueryView {
    /// World to clip.
    pub clip_from_world: Mat4,
    /// The eye, world space, m.
    pub eye_ws: Vec3,
    /// Height of the image, pixels.
    pub height_px: u32,
    /// What sizes are divided by at a point p, dot(xyz, p) + w, and the pixels that 1 m is high where that is 1.
    pub size_on_image: (Vec4, f32),
    /// Rows of the image that draws are to reach; `None` is all.
    pub rows: Option<Range<u32>>,
    /// Box of all draws, world space, displaced.
    pub bounds_ws: Aabb,
    /// How far surfaces may be displaced along each axis, m.
    pub displacement_m: f32,
}

impl DrawQuery {
    /// Leaves out every draw, but for those whose bounds are no numbers.
    pub const NOTHING: Self = {
        Self(DrawChoiceConstants {
            planes: [[0.0, 0.0, 0.0, -1.0]; PLANES],
            distance_from_world: [0.0; 4],
            eye_ws: [0.0; 3],
            displacement_m: 0.0,
            least_ratio: 0.0,
            order: ORDER_SCENE,
            farthest_step: 0,
        })
    };

    /// How a view chooses and orders draws.
    pub fn new(options: &DrawParams, view: &QueryView) -> Self {
        let bounds_ws = &view.bounds_ws;
        let mut planes = [Vec4::W; PLANES];
        // The rows alone cull: what the view does not cull stays in some rows at least.
        if options.cull == Cull::Frustum {
            planes[..6].copy_from_slice(&Frustum::new(view.clip_from_world).0);
        }
        if let Some(rows) = &view.rows {
            let rows = Rows::new(view.clip_from_world, rows.clone(), view.height_px).0;
            planes[6..].iter_mut().zip(rows).for_each(|(to, plane)| *to = plane);
        }
        let (distance_from_world, px_at_one) = view.size_on_image;
        let farthest_sq =
            (bounds_ws.min - view.eye_ws).abs().max((bounds_ws.max - view.eye_ws).abs()).length_squared();
        let mut constants = DrawChoiceConstants {
            distance_from_world: distance_from_world.into(),
            eye_ws: view.eye_ws.into(),
            displacement_m: view.displacement_m,
            least_ratio: options.cull_px / px_at_one,
            order: match options.order {
                DrawOrder::Scene => ORDER_SCENE,
                DrawOrder::Center => ORDER_CENTER,
                DrawOrder::Near => ORDER_NEAR,
            },
            farthest_step: step_of(farthest_sq),
            ..DrawChoiceConstants::default()
        };
        for (to, plane) in constants.planes.iter_mut().zip(planes) {
            *to = plane.into();
        }
        Self(constants)
    }

    /// The bin of a draw with those bounds, 0 the nearest; `None` where it is left out.
    pub fn bin(&self, bounds_ws: &Aabb) -> Option<u32> {
        let c = &self.0;
        let reached = displaced(bounds_ws, c.displacement_m);
        let planes = c.planes.map(Vec4::from);
        if !touches(&planes, &reached) || self.is_small(&reached) {
            return None;
        }
        let eye_ws = Vec3::from(c.eye_ws);
        let distance_sq = match c.order {
            ORDER_NEAR => distance_sq(bounds_ws, eye_ws),
            ORDER_CENTER => bounds_ws.center().distance_squared(eye_ws),
            _ => return Some(0),
        };
        Some((step_of(distance_sq) + BINS - 1).saturating_sub(c.farthest_step).min(BINS - 1))
    }

    /// Whether a box is smaller on the image than what is to be drawn, wherever on it: seen from its least view distance.
    fn is_small(&self, bounds: &Aabb) -> bool {
        let distance = Vec4::from(self.0.distance_from_world);
        let size = bounds.max - bounds.min;
        let center_m = dot(distance.truncate(), (bounds.min + bounds.max) * 0.5) + distance.w;
        let nearest_m = center_m - 0.5 * dot(distance.truncate().abs(), size);
        let least_m = self.0.least_ratio * nearest_m;
        nearest_m > 0.0 && dot(size, size) < least_m * least_m
    }

    /// Chooses and orders the draws of a scene, which stand where `infos` says: near to far by bins, those of one bin as in the scene.
    pub fn choose(&self, bucket_first: &[u32; BUCKETS + 1], infos: &[DrawInfo]) -> DrawsInOrder {
        let mut draws = DrawsInOrder::default();
        self.choose_into(bucket_first, infos, (&mut draws, &mut Vec::new()));
        draws
    }

    /// Those of some draws that are needed, in their order.
    pub fn keep(&self, draws: &DrawsInOrder, infos: &[DrawInfo]) -> DrawsInOrder {
        let is_needed = |draw: &u32| self.bin(&infos[*draw as usize].bounds_ws).is_some();
        draws.each_ref().map(|draws| draws.iter().copied().filter(is_needed).collect())
    }

    /// The same in memory that was used before: the draws, and the words that they are sorted by.
    pub fn choose_into(
        &self,
        bucket_first: &[u32; BUCKETS + 1],
        infos: &[DrawInfo],
        (draws, words): (&mut DrawsInOrder, &mut Vec<u64>),
    ) {
        for (ends, draws) in bucket_first.windows(2).zip(draws) {
            words.clear();
            words.extend((ends[0]..ends[1]).filter_map(|draw| {
                let bin = self.bin(&infos[draw as usize].bounds_ws)?;
                Some(u64::from(bin) << 32 | u64::from(draw))
            }));
            words.sort_unstable();
            draws.clear();
            draws.extend(words.iter().copied().map(place_of));
        }
    }
}

/// Step of a squared distance on a scale of equal ratios: the upper bits of the float. What is no number is farthest.
const fn step_of(distance_sq: f32) -> u32 {
    distance_sq.to_bits() >> STEP_SHIFT
}

/// Number of draws.
pub fn count(draws: &DrawsInOrder) -> u32 {
    draws.iter().map(|bucket| bucket.len() as u32).sum()
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

/// Squared distance from a point to a box, 0 inside.
fn distance_sq(bounds: &Aabb, point: Vec3) -> f32 {
    let (low, high) = (bounds.min.min(bounds.max), bounds.max.max(bounds.min));
    point.max(low).min(high).distance_squared(point)
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
        dot(n, farthest) + plane.w < 0.0
    })
}

/// The dot product in the order of sums that the device has.
pub(super) fn dot(a: Vec3, b: Vec3) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z
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
