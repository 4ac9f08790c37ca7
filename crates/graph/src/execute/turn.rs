//! Frames that take turns: what one writes of a resource with history is what the next one reads.

use std::mem::discriminant;

use afterlight_gpu::{self as gpu, Device, vk};

use super::raster::clear_color;
use super::read_back::ANY;
use super::resources::Physical;
use crate::error::GraphError;
use crate::plan::{Plan, aspects};

/// Which of the two places of a resource with history a frame writes; it reads the other one. A frame of the other turn reads what this one
/// wrote, one of the same turn overwrites it and reads what this one has read: so a frame is drawn again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Turn {
    /// The first frame's.
    #[default]
    Even,
    /// The second frame's.
    Odd,
}

impl Turn {
    /// Both, the first frame's first.
    pub const ALL: [Self; 2] = [Self::Even, Self::Odd];

    /// The turn of the next frame.
    pub fn other(self) -> Self {
        match self {
            Self::Even => Self::Odd,
            Self::Odd => Self::Even,
        }
    }

    pub(super) fn index(self) -> usize {
        self as usize
    }
}

/// What the plan's resources are in each turn, the first frame's first; without history all turns are one.
pub(super) fn taking_turns(plan: &Plan, physical: Vec<Physical>) -> Vec<Vec<Physical>> {
    if !plan.has_history() {
        return vec![physical];
    }
    let other = |(index, resource): (usize, &crate::PlannedResource)| {
        let there = resource.version.map_or(index, |version| version.other().0 as usize);
        physical[there].clone()
    };
    let odd = plan.resources.iter().enumerate().map(other).collect();
    vec![physical, odd]
}

/// What an earlier plan's resources are that take the places of the plan's resources with history, by the numbers of the plan's; `None` where it
/// has not the same ones, to be used in the same ways, or none at all. Other entries are unused.
pub(super) fn taken_over(plan: &Plan, earlier: &Plan, physical: &[Physical]) -> Option<Vec<Physical>> {
    let mut taken = vec![Physical::Unused; plan.resources.len()];
    for (index, resource) in plan.resources.iter().enumerate() {
        let Some(version) = resource.version.filter(|_| resource.placement.is_some()) else { continue };
        let there = earlier.resource(&resource.name)?.0 as usize;
        let found = &earlier.resources[there];
        let is_same = discriminant(&version) == discriminant(&found.version?)
            && found.kind == resource.kind
            && found.image_usage == resource.image_usage
            && found.buffer_usage == resource.buffer_usage
            && found.final_layouts == resource.final_layouts;
        if !is_same || matches!(physical[there], Physical::Unused) {
            return None;
        }
        taken[index] = physical[there].clone();
    }
    plan.has_history().then_some(taken)
}

/// Makes both versions of resources with history zero, images in the layout in which frames find them: what the first frame reads is defined.
pub(super) fn clear_history(device: &Device, plan: &Plan, physical: &[Physical]) -> Result<(), GraphError> {
    if !plan.has_history() {
        return Ok(());
    }
    let mut encoder = device.encoder()?;
    for (resource, physical) in plan.resources.iter().zip(physical) {
        match (resource.version, physical) {
            (Some(_), Physical::Image(image)) => {
                clear_image(&mut encoder, image, &resource.final_layouts);
            }
            (Some(_), Physical::Buffer(buffer)) => encoder.fill_buffer(buffer, 0),
            _ => {}
        }
    }
    encoder.barriers(&[gpu::MemoryBarrier { before: ANY, after: ANY }], &[], &[]);
    device.submit(encoder)?;
    Ok(())
}

/// Clears an image without contents and leaves each part in its layout.
fn clear_image(encoder: &mut gpu::Encoder, image: &gpu::Image, layouts: &[vk::ImageLayout]) {
    let all = aspects(image.format());
    let whole = vk::ImageSubresourceRange {
        aspect_mask: all,
        base_mip_level: 0,
        level_count: image.mips(),
        base_array_layer: 0,
        layer_count: image.layers(),
    };
    let clearing = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    let barrier = |range, old_layout, new_layout| gpu::ImageBarrier {
        image,
        range,
        before: ANY,
        after: ANY,
        old_layout,
        new_layout,
    };
    encoder.barriers(&[], &[], &[barrier(whole, vk::ImageLayout::UNDEFINED, clearing)]);
    match all.contains(vk::ImageAspectFlags::COLOR) {
        true => encoder.clear_color_image(image, clearing, clear_color(image.format(), [0.0; 4]), whole),
        false => encoder.clear_depth_image(image, clearing, whole),
    }
    let part = |(cell, layout): (u32, &vk::ImageLayout)| {
        let range = vk::ImageSubresourceRange {
            base_mip_level: cell % image.mips(),
            level_count: 1,
            base_array_layer: cell / image.mips(),
            layer_count: 1,
            ..whole
        };
        (*layout != vk::ImageLayout::UNDEFINED).then(|| barrier(range, clearing, *layout))
    };
    let parts: Vec<_> = (0..).zip(layouts).filter_map(part).collect();
    encoder.barriers(&[], &[], &parts);
}
