//! A plan's barriers as the encoder takes them.

use afterlight_gpu::{self as gpu, vk};

use super::builder::Builder;
use super::commands::{BarrierList, ImageTransition};
use super::resources::Physical;
use crate::plan::{Barrier, aspects};

impl Builder<'_> {
    pub(super) fn barriers(&self, barriers: &[Barrier]) -> BarrierList {
        let mut list = BarrierList::default();
        for barrier in barriers {
            let before = gpu::Access { stages: barrier.src_stages, access: barrier.src_access };
            let after = gpu::Access { stages: barrier.dst_stages, access: barrier.dst_access };
            let image = barrier.resource.and_then(|id| match &self.physical[id.0 as usize] {
                Physical::Image(image) => Some(image),
                _ => None,
            });
            // Drivers flush whole caches: barriers without a change of layout are one for all.
            match image {
                Some(image) if barrier.old_layout != barrier.new_layout => {
                    list.images.push(ImageTransition {
                        image: image.clone(),
                        range: vk::ImageSubresourceRange {
                            aspect_mask: aspects(image.format()),
                            base_mip_level: barrier.range.mip,
                            level_count: barrier.range.mip_count,
                            base_array_layer: barrier.range.layer,
                            layer_count: barrier.range.layer_count,
                        },
                        before,
                        after,
                        old_layout: barrier.old_layout,
                        new_layout: barrier.new_layout,
                    })
                }
                _ => {
                    let all = list.memory.get_or_insert(gpu::MemoryBarrier {
                        before: gpu::Access::default(),
                        after: gpu::Access::default(),
                    });
                    all.before.stages |= before.stages;
                    all.before.access |= before.access;
                    all.after.stages |= after.stages;
                    all.after.access |= after.access;
                }
            }
        }
        list
    }
}
