//! The stage that makes a tree over the lights with an end: boxes of 32 neighbours, of 32 such boxes, and so on (Olsson et al. 2012,
//! section 3.4). Whoever looks for the lights of a place or of a part of the view walks down from the top, so that the time grows with
//! what is found, not with the number of lights.

use afterlight_graph::{BufferRole, Graph, ImageHandle, ImageInfo, PassRole, gpu::vk};

use crate::{
    error::TechniqueError,
    frame::{Frame, Slots},
};

/// Children of a node: `TREE_WIDTH` in `tree.glsl`.
const WIDTH: u32 = 32;
/// Groups of a row of a dispatch: every device takes as many. `GROUPS_A_ROW` in `boxes.comp.glsl`.
const GROUPS_A_ROW: u32 = 32_768;
/// Width of the image of boxes, texels: 512 nodes.
const ROW_TEXELS: u32 = 1024;

/// Boxes of the tree; none where the lights are few enough to be the top level.
pub struct LightBvh {
    boxes: Option<ImageHandle>,
}

/// Nodes of each level above the lights, the top level, of at most [`WIDTH`] nodes, last.
fn level_counts(lights: u32) -> Vec<u32> {
    let mut counts = Vec::new();
    let mut count = lights;
    while count > WIDTH {
        count = count.div_ceil(WIDTH);
        counts.push(count);
    }
    counts
}

/// Declares the passes `technique/light boxes`, one a level.
///
/// # Errors
/// A shader that is not compiled in.
pub fn build(graph: &mut Graph, frame: &Frame<'_>, technique: &str) -> Result<LightBvh, TechniqueError> {
    build_for(graph, frame, technique, (PassRole::LightAssignment, BufferRole::Lights))
}

/// The same with roles of passes and boxes: work that techniques share has its own.
///
/// # Errors
/// A shader that is not compiled in.
pub(crate) fn build_for(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    (pass_role, buffer_role): (PassRole, BufferRole),
) -> Result<LightBvh, TechniqueError> {
    let counts = level_counts(frame.lights.bounded_count());
    if counts.is_empty() {
        return Ok(LightBvh { boxes: None });
    }
    let shader = frame.shader("light_bvh/boxes.comp")?;
    let nodes: u32 = counts.iter().sum();
    let info = ImageInfo::new(vk::Format::R32G32B32A32_SFLOAT, ROW_TEXELS, (2 * nodes).div_ceil(ROW_TEXELS));
    let mut boxes = graph.image(&format!("{technique}/light boxes"), buffer_role, info);
    for (level, count) in (1u32..).zip(counts) {
        let mut pass = frame.compute(graph, &format!("{technique}/light boxes {level}"), pass_role, &shader);
        pass.constant("LEVEL", level);
        boxes = pass.write("boxes", boxes);
        pass.dispatch([count.min(GROUPS_A_ROW), count.div_ceil(GROUPS_A_ROW), 1]);
        pass.finish();
    }
    Ok(LightBvh { boxes: Some(boxes) })
}

impl LightBvh {
    /// Binds what `boxes.glsl` reads.
    pub fn bind(&self, frame: &Frame<'_>, pass: &mut impl Slots) {
        // Where the lights are the top level nobody reads a box: an image of the same kind fills the slot.
        pass.read_image("light_boxes", self.boxes.as_ref().unwrap_or(&frame.buffers.light_spheres));
    }
}

#[cfg(test)]
mod tests {
    use super::level_counts;

    #[test]
    fn levels_end_in_one_of_at_most_32_nodes() {
        assert!(level_counts(0).is_empty());
        assert!(level_counts(32).is_empty());
        assert_eq!(level_counts(33), [2]);
        assert_eq!(level_counts(1024), [32]);
        assert_eq!(level_counts(1025), [33, 2]);
        assert_eq!(level_counts(100_000), [3125, 98, 4]);
    }
}
