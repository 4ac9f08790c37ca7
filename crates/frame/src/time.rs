//! When a frame is, and what the frame before it showed.

use std::sync::Arc;

use afterlight_shader::structs::{DrawData, FrameConstants};
use glam::Mat4;

/// Bit of [`FrameConstants::before`]: the frame before shows the same scene from a view near by. Twin: `include/frame.glsl`.
pub const BEFORE_VIEW: u32 = 1;

/// Bit of [`FrameConstants::before`]: resources with history hold what that frame wrote. Twin: `include/frame.glsl`.
pub const BEFORE_HISTORY: u32 = 2;

/// What a frame showed, for the frame after it.
#[derive(Clone, Debug, Default)]
pub struct ViewBefore {
    /// World to clip space.
    pub clip_from_world: Mat4,
    /// Records of all draws; `None` where surfaces stood where they stand now, or nobody asks.
    pub records: Option<Vec<DrawData>>,
}

/// When a frame is, and what the frame before it showed. A view alone is the frame 0 at 0 s with none before it.
#[derive(Clone, Debug, Default)]
pub struct FrameTime {
    /// Number of the frame.
    pub index: u64,
    /// Time of the scene, s.
    pub time_s: f64,
    /// What the frame before showed; `None` where there was none, or the camera jumped since.
    pub before: Option<Arc<ViewBefore>>,
    /// Whether resources with history hold what that frame wrote.
    pub has_history: bool,
}

impl FrameTime {
    /// The constants of a view at this time: those that know of no time but for number, time and the frame before.
    pub fn constants(&self, of_view: FrameConstants) -> FrameConstants {
        let (before, clip_from_world_before) = match &self.before {
            None => (0, of_view.clip_from_world),
            Some(view) => {
                let history = if self.has_history { BEFORE_HISTORY } else { 0 };
                (BEFORE_VIEW | history, view.clip_from_world.to_cols_array_2d())
            }
        };
        FrameConstants {
            // Numbers count on from 0 after 2^32 frames.
            frame_index: self.index as u32,
            time_s: self.time_s as f32,
            before,
            clip_from_world_before,
            ..of_view
        }
    }

    /// The same time for a view that no frame before had, such as a light's.
    pub fn alone(&self) -> Self {
        Self { before: None, has_history: false, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn constants_tell_the_frame_before() {
        let now = Mat4::from_scale(glam::Vec3::splat(2.0)).to_cols_array_2d();
        let of_view = FrameConstants { clip_from_world: now, samples: 4, ..FrameConstants::zeroed() };
        let alone = FrameTime::default().constants(of_view);
        assert_eq!((alone.before, alone.clip_from_world_before), (0, now), "none before: as now");
        let before = ViewBefore { clip_from_world: Mat4::IDENTITY, records: None };
        let mut time = FrameTime {
            index: (1 << 32) + 7,
            time_s: 0.5,
            before: Some(Arc::new(before)),
            has_history: false,
        };
        let found = time.constants(of_view);
        assert_eq!((found.frame_index, found.time_s, found.before), (7, 0.5, BEFORE_VIEW));
        assert_eq!(found.clip_from_world_before, Mat4::IDENTITY.to_cols_array_2d());
        assert_eq!((found.clip_from_world, found.samples), (now, 4), "the rest stays");
        time.has_history = true;
        assert_eq!(time.constants(of_view).before, BEFORE_VIEW | BEFORE_HISTORY);
        time.before = None;
        assert_eq!(time.constants(of_view).before, 0, "no history without a frame before");
        assert_eq!(time.alone().constants(of_view).frame_index, 7);
    }
}
