//! The least barriers between the uses of each part of a resource.

use std::collections::BTreeMap;

use afterlight_gpu::vk;

use super::PlannedResource;
use super::access::WRITES;
use super::hazards::{Cell, CellUse, cell_count, mips_of};
use super::placement::shares_memory;
use crate::declare::{Import, ResourceId, ResourceKind, Subresource, Version};

/// One barrier of a plan. Without a resource it is a memory barrier: the memory changes its owner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Barrier {
    /// The resource; `None` where memory passes from one resource to another.
    pub resource: Option<ResourceId>,
    /// Levels and layers of an image; level 0 and layer 0 of a buffer.
    pub range: Subresource,
    /// Stages that must have finished.
    pub src_stages: vk::PipelineStageFlags2,
    /// Writes that are made available.
    pub src_access: vk::AccessFlags2,
    /// Stages that wait.
    pub dst_stages: vk::PipelineStageFlags2,
    /// Accesses to which the writes become visible.
    pub dst_access: vk::AccessFlags2,
    /// Layout before; `UNDEFINED` drops the contents. Equal to the new layout where there is no transition.
    pub old_layout: vk::ImageLayout,
    /// Layout after; `UNDEFINED` for buffers and memory.
    pub new_layout: vk::ImageLayout,
}

/// What the planner knows of a part of a resource between two passes.
#[derive(Clone, Default)]
pub(super) struct CellState {
    pub(super) layout: vk::ImageLayout,
    touched: bool,
    write_stages: vk::PipelineStageFlags2,
    write_access: vk::AccessFlags2,
    readers: vk::PipelineStageFlags2,
    /// To whom the last write is visible.
    visible: Vec<(vk::PipelineStageFlags2, vk::AccessFlags2)>,
}

impl CellState {
    fn stages(&self) -> vk::PipelineStageFlags2 {
        self.write_stages | self.readers
    }

    fn sees(&self, cell_use: &CellUse) -> bool {
        self.visible
            .iter()
            .any(|(stages, access)| stages.contains(cell_use.stages) && access.contains(cell_use.access))
    }
}

pub(super) struct BarrierPlanner<'a> {
    pub(super) resources: &'a [PlannedResource],
    pub(super) uses: &'a [&'a BTreeMap<Cell, CellUse>],
    pub(super) states: Vec<Vec<CellState>>,
    /// Whether some pass writes the resource.
    pub(super) written: Vec<bool>,
    /// Layouts of the parts of a resource between frames; `None` where none must hold.
    homes: Vec<Option<Vec<vk::ImageLayout>>>,
    /// Of resources with history: stages of the frame before that may use its memory, and how they write.
    earlier: Vec<(vk::PipelineStageFlags2, vk::AccessFlags2)>,
}

/// A barrier of one part, before parts are joined.
#[derive(Clone, Copy, PartialEq, Eq)]
struct CellBarrier {
    src_stages: vk::PipelineStageFlags2,
    src_access: vk::AccessFlags2,
    dst_stages: vk::PipelineStageFlags2,
    dst_access: vk::AccessFlags2,
    old_layout: vk::ImageLayout,
    new_layout: vk::ImageLayout,
}

impl<'a> BarrierPlanner<'a> {
    pub(super) fn new(resources: &'a [PlannedResource], uses: &'a [&'a BTreeMap<Cell, CellUse>]) -> Self {
        let homes = homes(resources, uses);
        let state = |resource: &PlannedResource, home: &Option<Vec<vk::ImageLayout>>| {
            // What this frame writes of a resource with history begins without contents.
            let is_now = matches!(resource.version, Some(Version::Now { .. }));
            let home = home.as_ref().filter(|_| !is_now);
            let layout = |cell: usize| home.map_or(vk::ImageLayout::UNDEFINED, |home| home[cell]);
            let cells = 0..cell_count(&resource.kind);
            cells.map(|cell| CellState { layout: layout(cell), ..CellState::default() }).collect()
        };
        let states = resources.iter().zip(&homes).map(|(resource, home)| state(resource, home)).collect();
        let mut written = vec![false; resources.len()];
        for ((id, _), cell_use) in uses.iter().flat_map(|uses| uses.iter()) {
            written[id.0 as usize] |= cell_use.write;
        }
        let earlier = uses_of_versions(resources, uses);
        Self { resources, uses, states, written, homes, earlier }
    }

    /// The union of this read and those that follow it up to the next write or layout change.
    fn reads_from(&self, pass: usize, cell: &Cell) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
        let first = &self.uses[pass][cell];
        let mut all = (first.stages, first.access);
        for uses in &self.uses[pass + 1..] {
            let Some(next) = uses.get(cell) else { continue };
            if next.write || next.layout != first.layout {
                break;
            }
            all = (all.0 | next.stages, all.1 | next.access);
        }
        all
    }

    /// What must have happened before the first use of a part in the frame.
    fn before_first(&self, pass: usize, cell: &Cell) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
        let id = cell.0;
        let resource = &self.resources[id.0 as usize];
        if resource.imported {
            // Earlier frames, and uploads, may have used it in any way.
            return if self.written[id.0 as usize] {
                (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_WRITE)
            } else {
                (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE)
            };
        }
        let nothing = (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE);
        match resource.version {
            Some(Version::Before { now }) if self.returns_home(&(now, cell.1)) => return nothing,
            Some(_) => return self.earlier[id.0 as usize],
            None => {}
        }
        let mut before = nothing;
        for (index, other) in self.resources.iter().enumerate() {
            let earlier = other.lifetime.is_some_and(|lifetime| lifetime.1 < pass);
            if index != id.0 as usize && earlier && shares_memory(other, resource) {
                for state in &self.states[index] {
                    before = (before.0 | state.stages(), before.1 | state.write_access);
                }
            }
        }
        before
    }

    /// Whether a part changes its layout at the end of the frame, by a barrier that shows it to all that follows.
    fn returns_home(&self, cell: &Cell) -> bool {
        let last = self.uses.iter().rev().find_map(|uses| uses.get(cell));
        let home = self.homes[cell.0.0 as usize].as_ref().map(|home| home[cell.1]);
        last.zip(home).is_some_and(|(last, home)| last.layout != home)
    }

    fn cell_barrier(&mut self, pass: usize, cell: &Cell) -> (Option<CellBarrier>, Option<CellBarrier>) {
        let cell_use = self.uses[pass][cell];
        let is_image = matches!(self.resources[cell.0.0 as usize].kind, ResourceKind::Image(_));
        let resource = &self.resources[cell.0.0 as usize];
        // Its memory may be another one's.
        let is_transient = !resource.imported && resource.version.is_none();
        let state = &self.states[cell.0.0 as usize][cell.1];
        let first = !state.touched;
        let (src_stages, src_access) =
            if first { self.before_first(pass, cell) } else { (state.stages(), state.write_access) };
        let transition = is_image && state.layout != cell_use.layout;
        let hazard = if cell_use.write {
            !src_stages.is_empty()
        } else {
            !(state.write_stages | if first { src_stages } else { vk::PipelineStageFlags2::NONE }).is_empty()
                && !state.sees(&cell_use)
        };
        let mut memory = None;
        let mut barrier = None;
        let mut dst = (cell_use.stages, cell_use.access);
        if !cell_use.write {
            dst = self.reads_from(pass, cell);
        }
        if transition || hazard {
            // A read that needs no transition waits for the last write alone, not for other readers.
            let (src_stages, src_access) = if cell_use.write || transition || first {
                (src_stages, src_access)
            } else {
                (state.write_stages, state.write_access)
            };
            let keep = if cell_use.discard && transition { vk::ImageLayout::UNDEFINED } else { state.layout };
            let one = CellBarrier {
                src_stages,
                src_access,
                dst_stages: dst.0,
                dst_access: dst.1,
                old_layout: if is_image { keep } else { vk::ImageLayout::UNDEFINED },
                new_layout: if is_image { cell_use.layout } else { vk::ImageLayout::UNDEFINED },
            };
            if first && is_transient && !src_stages.is_empty() {
                let none = vk::ImageLayout::UNDEFINED;
                memory = Some(CellBarrier { old_layout: none, new_layout: none, ..one });
            }
            if is_image || memory.is_none() {
                barrier = Some(one);
            }
        }
        let state = &mut self.states[cell.0.0 as usize][cell.1];
        state.touched = true;
        if cell_use.write {
            *state = CellState {
                layout: cell_use.layout,
                touched: true,
                write_stages: cell_use.stages,
                write_access: cell_use.access & WRITES,
                ..CellState::default()
            };
        } else if transition || first && hazard {
            // The transition counts as a write that has happened once the barrier's second scope begins.
            *state = CellState {
                layout: cell_use.layout,
                touched: true,
                write_stages: dst.0,
                readers: cell_use.stages,
                visible: vec![dst],
                ..CellState::default()
            };
        } else {
            if hazard {
                state.visible.push(dst);
            }
            state.readers |= cell_use.stages;
        }
        (memory, barrier)
    }

    pub(super) fn pass(&mut self, pass: usize) -> Vec<Barrier> {
        let mut out: Vec<Barrier> = Vec::new();
        let mut memory: Option<Barrier> = None;
        let cells: Vec<Cell> = self.uses[pass].keys().copied().collect();
        let mut start = 0;
        while start < cells.len() {
            let id = cells[start].0;
            let count = cells[start..].iter().take_while(|cell| cell.0 == id).count();
            let mut grid: Vec<Option<CellBarrier>> =
                vec![None; cell_count(&self.resources[id.0 as usize].kind)];
            for cell in &cells[start..start + count] {
                let (owner, barrier) = self.cell_barrier(pass, cell);
                grid[cell.1] = barrier;
                if let Some(owner) = owner {
                    let one = lower(None, Subresource::mip_layer(0, 0), &owner);
                    let all = memory.get_or_insert(one);
                    all.src_stages |= one.src_stages;
                    all.src_access |= one.src_access;
                    all.dst_stages |= one.dst_stages;
                    all.dst_access |= one.dst_access;
                }
            }
            out.extend(join_cells(id, &grid, mips_of(&self.resources[id.0 as usize].kind)));
            start += count;
        }
        out.splice(0..0, memory);
        out
    }

    /// Returns images to the layouts that hold between frames.
    pub(super) fn finish(&self) -> Vec<Barrier> {
        let mut out = Vec::new();
        for (index, resource) in self.resources.iter().enumerate() {
            let Some(home) = &self.homes[index] else { continue };
            let grid: Vec<Option<CellBarrier>> = self.states[index]
                .iter()
                .zip(home)
                .map(|(state, home)| {
                    let moves = *home != vk::ImageLayout::UNDEFINED && state.layout != *home;
                    moves.then_some(CellBarrier {
                        src_stages: state.stages(),
                        src_access: state.write_access,
                        dst_stages: vk::PipelineStageFlags2::ALL_COMMANDS,
                        dst_access: vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE,
                        old_layout: state.layout,
                        new_layout: *home,
                    })
                })
                .collect();
            out.extend(join_cells(ResourceId(index as u32), &grid, mips_of(&resource.kind)));
        }
        out
    }

    /// Layouts of the parts of resources between frames; `None` where none must hold.
    pub(super) fn into_homes(self) -> Vec<Option<Vec<vk::ImageLayout>>> {
        self.homes
    }
}

/// Layouts that hold between frames: of imports, which have one, and of images with history, whose two versions change places then. That is
/// the layout in which the frame before is read first, so that its readers need no transition; where nobody reads, the last one.
fn homes(
    resources: &[PlannedResource],
    uses: &[&BTreeMap<Cell, CellUse>],
) -> Vec<Option<Vec<vk::ImageLayout>>> {
    let of_version = |index: usize, version: Version| {
        let id = ResourceId(index as u32);
        let (before, now) = match version {
            Version::Before { now } => (id, now),
            Version::Now { before } => (before, id),
        };
        let cells = 0..cell_count(&resources[index].kind);
        let layout = |cell: usize| {
            let first_read = uses.iter().find_map(|uses| uses.get(&(before, cell)));
            let last = || uses.iter().rev().find_map(|uses| uses.get(&(now, cell)));
            first_read.or_else(last).map_or(vk::ImageLayout::UNDEFINED, |one| one.layout)
        };
        cells.map(layout).collect()
    };
    let home = |(index, resource): (usize, &PlannedResource)| match (&resource.import, resource.version) {
        (Some(Import::Image { layout, .. }), _) => Some(vec![*layout; cell_count(&resource.kind)]),
        #[cfg(test)]
        (Some(Import::Fake { layout }), _) => Some(vec![*layout; cell_count(&resource.kind)]),
        (None, Some(version)) if matches!(resource.kind, ResourceKind::Image(_)) => {
            Some(of_version(index, version))
        }
        _ => None,
    };
    resources.iter().enumerate().map(home).collect()
}

/// Stages that use either version of each resource with history, and how they write. The frame before may have used the memory of one in the
/// way of the other, or in the same way where it is drawn again.
fn uses_of_versions(
    resources: &[PlannedResource],
    uses: &[&BTreeMap<Cell, CellUse>],
) -> Vec<(vk::PipelineStageFlags2, vk::AccessFlags2)> {
    let mut earlier = vec![(vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE); resources.len()];
    for ((id, _), one) in uses.iter().flat_map(|uses| uses.iter()) {
        let Some(version) = resources[id.0 as usize].version else { continue };
        for of in [*id, version.other()] {
            let all = &mut earlier[of.0 as usize];
            *all = (all.0 | one.stages, all.1 | one.access & WRITES);
        }
    }
    earlier
}

fn lower(resource: Option<ResourceId>, range: Subresource, barrier: &CellBarrier) -> Barrier {
    Barrier {
        resource,
        range,
        src_stages: barrier.src_stages,
        src_access: barrier.src_access,
        dst_stages: barrier.dst_stages,
        dst_access: barrier.dst_access,
        old_layout: barrier.old_layout,
        new_layout: barrier.new_layout,
    }
}

/// Joins equal barriers of neighbouring parts: levels of a layer first, then layers with equal runs of levels.
fn join_cells(id: ResourceId, grid: &[Option<CellBarrier>], mips: usize) -> Vec<Barrier> {
    let mut out: Vec<(Subresource, CellBarrier)> = Vec::new();
    for (layer, row) in grid.chunks(mips).enumerate() {
        let mut mip = 0;
        while mip < row.len() {
            let count = row[mip..].iter().take_while(|other| **other == row[mip]).count();
            if let Some(barrier) = row[mip] {
                let above = out.iter_mut().find(|(range, other)| {
                    *other == barrier
                        && range.mip as usize == mip
                        && range.mip_count as usize == count
                        && (range.layer + range.layer_count) as usize == layer
                });
                match above {
                    Some((range, _)) => range.layer_count += 1,
                    None => out.push((
                        Subresource {
                            mip: mip as u32,
                            mip_count: count as u32,
                            layer: layer as u32,
                            layer_count: 1,
                        },
                        barrier,
                    )),
                }
            }
            mip += count;
        }
    }
    out.iter().map(|(range, barrier)| lower(Some(id), *range, barrier)).collect()
}
