//! The one use that a pass makes of each part of a resource; uses that exclude each other are errors.

use std::collections::BTreeMap;

use afterlight_gpu::vk;

use super::access::{Access, WRITES, aspects, is_depth};
use crate::declare::{ResourceId, ResourceKind, ResourceNode, Subresource};
use crate::error::GraphError;

/// A part of a resource: its level and layer (`layer * mips + mip`), or 0 for a buffer.
pub(super) type Cell = (ResourceId, usize);

/// The one use that a pass makes of a part of a resource.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellUse {
    pub(super) stages: vk::PipelineStageFlags2,
    pub(super) access: vk::AccessFlags2,
    pub(super) layout: vk::ImageLayout,
    pub(super) write: bool,
    pub(super) discard: bool,
    /// Whether earlier contents are read.
    pub(super) reads: bool,
    read_aspects: vk::ImageAspectFlags,
    pub(super) write_aspects: vk::ImageAspectFlags,
    pub(super) what: &'static str,
}

pub(super) fn mips_of(kind: &ResourceKind) -> usize {
    match kind {
        ResourceKind::Image(info) => info.mips as usize,
        ResourceKind::Buffer { .. } => 1,
    }
}

pub(super) fn cell_count(kind: &ResourceKind) -> usize {
    match kind {
        ResourceKind::Image(info) => info.mips as usize * info.layers as usize,
        ResourceKind::Buffer { .. } => 1,
    }
}

pub(super) fn cells_of(range: &Subresource, mips: usize) -> impl Iterator<Item = usize> + use<> {
    let range = *range;
    (range.layer as usize..(range.layer + range.layer_count) as usize).flat_map(move |layer| {
        (range.mip as usize..(range.mip + range.mip_count) as usize).map(move |mip| layer * mips + mip)
    })
}

/// Joins a pass's uses of each part; two uses that exclude each other are an error.
pub(super) fn join_uses(
    pass: &str,
    accesses: &[Access],
    resources: &[ResourceNode],
) -> Result<BTreeMap<Cell, CellUse>, GraphError> {
    let mut uses: BTreeMap<Cell, CellUse> = BTreeMap::new();
    for access in accesses {
        let node = &resources[access.resource.0 as usize];
        let none = vk::ImageAspectFlags::empty();
        let one = CellUse {
            stages: access.stages,
            access: access.access,
            layout: access.layout,
            write: access.write,
            discard: access.discard,
            reads: !access.write || (!access.discard && access.access.intersects(!WRITES)),
            read_aspects: if access.write { none } else { access.aspects },
            write_aspects: if access.write { access.aspects } else { none },
            what: access.what,
        };
        for cell in cells_of(&access.range, mips_of(&node.kind)) {
            match uses.get_mut(&(access.resource, cell)) {
                None => {
                    uses.insert((access.resource, cell), one);
                }
                Some(first) => join(first, &one).map_err(|()| GraphError::Conflict {
                    pass: pass.to_owned(),
                    resource: node.name.clone(),
                    first: first.what.to_owned(),
                    second: one.what.to_owned(),
                })?,
            }
        }
    }
    for ((id, _), cell_use) in &mut uses {
        if let ResourceKind::Image(info) = resources[id.0 as usize].kind {
            settle_depth_layout(cell_use, aspects(info.format));
        }
    }
    Ok(uses)
}

/// Joins two uses of one part by one pass.
fn join(first: &mut CellUse, second: &CellUse) -> Result<(), ()> {
    let storage = vk::AccessFlags2::SHADER_STORAGE_READ | vk::AccessFlags2::SHADER_STORAGE_WRITE;
    let overlap = first.write_aspects.intersects(second.write_aspects | second.read_aspects)
        || second.write_aspects.intersects(first.read_aspects);
    let both_storage_writes =
        first.write && second.write && storage.contains(first.access) && storage.contains(second.access);
    if overlap && !both_storage_writes {
        return Err(());
    }
    if first.layout != second.layout {
        let depth = |layout| {
            matches!(
                layout,
                vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL
                    | vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL
            )
        };
        let shader =
            |layout| matches!(layout, vk::ImageLayout::GENERAL | vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        first.layout = if depth(first.layout) && depth(second.layout) {
            vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL
        } else if shader(first.layout) && shader(second.layout) {
            vk::ImageLayout::GENERAL
        } else {
            return Err(());
        };
    }
    first.stages |= second.stages;
    first.access |= second.access;
    // Depth and stencil are one part: contents may be dropped only where both aspects allow it.
    first.discard &= second.discard;
    first.write |= second.write;
    first.reads |= second.reads;
    first.read_aspects |= second.read_aspects;
    first.write_aspects |= second.write_aspects;
    Ok(())
}

/// Picks the layout of a depth image from which aspects the pass writes.
fn settle_depth_layout(cell_use: &mut CellUse, format_aspects: vk::ImageAspectFlags) {
    let attachment =
        vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE;
    if !is_depth(format_aspects) || !cell_use.access.intersects(attachment) {
        return;
    }
    let depth = cell_use.write_aspects.contains(vk::ImageAspectFlags::DEPTH);
    let stencil = cell_use.write_aspects.contains(vk::ImageAspectFlags::STENCIL);
    cell_use.layout = match (depth, stencil) {
        (false, false) => vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
        (false, true) => vk::ImageLayout::DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL,
        (true, _) => vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
    };
}

/// Gives each access the layout that its parts have in the pass; parts of one access must agree.
pub(super) fn settle_layouts(
    pass: &str,
    accesses: &mut [Access],
    uses: &BTreeMap<Cell, CellUse>,
    resources: &[ResourceNode],
) -> Result<(), GraphError> {
    for access in accesses {
        let node = &resources[access.resource.0 as usize];
        let mut layouts =
            cells_of(&access.range, mips_of(&node.kind)).map(|cell| uses[&(access.resource, cell)].layout);
        let Some(first) = layouts.next() else { continue };
        if let Some(other) = layouts.find(|layout| *layout != first) {
            return Err(GraphError::Conflict {
                pass: pass.to_owned(),
                resource: node.name.clone(),
                first: format!("{} in layout {first:?}", access.what),
                second: format!("a range in layout {other:?}"),
            });
        }
        access.layout = first;
    }
    Ok(())
}
