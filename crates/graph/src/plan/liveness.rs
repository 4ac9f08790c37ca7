//! Which passes run, from when to when resources live, and reads before any write.

use std::collections::BTreeMap;

use afterlight_gpu::vk;

use super::hazards::{Cell, CellUse, cell_count, cells_of, mips_of};
use super::resolve::Resolved;
use crate::declare::{Graph, Import, ResourceId, ResourceKind, ResourceNode, Version};
use crate::error::GraphError;

/// Finds the passes whose results are used: by this frame, or by the next one where live passes read what the frame before wrote.
pub(super) fn live_passes(graph: &Graph, uses: &[BTreeMap<Cell, CellUse>]) -> Vec<bool> {
    let mut read_next = vec![false; graph.resources.len()];
    loop {
        let live = live_passes_where(graph, uses, &read_next);
        let mut next = read_next.clone();
        for (uses, _) in uses.iter().zip(&live).filter(|(_, live)| **live) {
            for (id, _) in uses.keys() {
                if let Some(Version::Before { now }) = graph.resources[id.0 as usize].version {
                    next[now.0 as usize] = true;
                }
            }
        }
        // What is read can only become more.
        if next == read_next {
            return live;
        }
        read_next = next;
    }
}

/// The same, from the last pass to the first, where the next frame reads these resources.
fn live_passes_where(graph: &Graph, uses: &[BTreeMap<Cell, CellUse>], read_next: &[bool]) -> Vec<bool> {
    let mut wanted: BTreeMap<Cell, bool> = BTreeMap::new();
    for (index, resource) in graph.resources.iter().enumerate() {
        let id = ResourceId(index as u32);
        for cell in 0..cell_count(&resource.kind) {
            let is_wanted = resource.kept || resource.import.is_some() || read_next[index];
            wanted.insert((id, cell), is_wanted);
        }
    }
    let mut live = vec![false; graph.passes.len()];
    for (index, pass) in graph.passes.iter().enumerate().rev() {
        let used = uses[index].iter().any(|(cell, cell_use)| cell_use.write && wanted[cell]);
        if !used && !pass.has_effect {
            continue;
        }
        live[index] = true;
        for (cell, cell_use) in &uses[index] {
            let needs_before = cell_use.reads || cell_use.write && !cell_use.discard && wanted[cell];
            wanted.insert(*cell, needs_before);
        }
    }
    live
}

pub(super) fn check_reads_after_writes(
    graph: &Graph,
    uses: &[BTreeMap<Cell, CellUse>],
    accesses: &[Resolved],
) -> Result<(), GraphError> {
    let mut written: BTreeMap<Cell, vk::ImageAspectFlags> = BTreeMap::new();
    let has_contents = |resource: &ResourceNode| match &resource.import {
        None => resource.is_before(),
        Some(Import::Buffer(_)) => true,
        Some(Import::Image { layout, .. }) => *layout != vk::ImageLayout::UNDEFINED,
        #[cfg(test)]
        Some(Import::Fake { layout }) => *layout != vk::ImageLayout::UNDEFINED,
    };
    for (index, pass) in graph.passes.iter().enumerate() {
        for access in &accesses[index].accesses {
            let resource = &graph.resources[access.resource.0 as usize];
            if has_contents(resource) {
                continue;
            }
            // A storage write may be meant to fill the whole; a read, or an attachment that keeps, is not.
            let keeps = access.write && !access.discard && access.layout != vk::ImageLayout::GENERAL;
            let is_buffer = matches!(resource.kind, ResourceKind::Buffer { .. });
            // Stencil that was never written is undefined, which only a stencil test would show.
            let aspects = access.aspects;
            if !access.write || (keeps && !is_buffer) {
                let unwritten = |cell: usize| {
                    !written.get(&(access.resource, cell)).is_some_and(|written| written.intersects(aspects))
                };
                let stencil_alone = aspects == vk::ImageAspectFlags::STENCIL;
                if !stencil_alone && cells_of(&access.range, mips_of(&resource.kind)).any(unwritten) {
                    return Err(GraphError::ReadBeforeWrite {
                        pass: pass.name.clone(),
                        resource: resource.name.clone(),
                    });
                }
            }
        }
        for (cell, cell_use) in uses[index].iter().filter(|(_, cell_use)| cell_use.write) {
            *written.entry(*cell).or_default() |= cell_use.write_aspects;
        }
    }
    Ok(())
}

/// First and last live pass that uses each resource.
pub(super) fn lifetimes(graph: &Graph, uses: &[&BTreeMap<Cell, CellUse>]) -> Vec<Option<(usize, usize)>> {
    let mut lifetimes: Vec<Option<(usize, usize)>> = vec![None; graph.resources.len()];
    for (pass, uses) in uses.iter().enumerate() {
        for (id, _) in uses.keys() {
            let lifetime = lifetimes[id.0 as usize].get_or_insert((pass, pass));
            lifetime.1 = pass;
        }
    }
    for (resource, lifetime) in graph.resources.iter().zip(&mut lifetimes) {
        if let (true, Some(lifetime)) = (resource.kept, lifetime) {
            lifetime.1 = usize::MAX;
        }
    }
    // Both versions hold something before the first pass and after the last, and take turns.
    for (index, resource) in graph.resources.iter().enumerate() {
        if let Some(version) = resource.version
            && (lifetimes[index].is_some() || lifetimes[version.other().0 as usize].is_some())
        {
            lifetimes[index] = Some((0, usize::MAX));
        }
    }
    lifetimes
}

/// Checks that no pass writes what the frame before wrote, and that some pass writes all that a pass reads of it.
pub(super) fn check_history(graph: &Graph, uses: &[BTreeMap<Cell, CellUse>]) -> Result<(), GraphError> {
    let name = |id: ResourceId| graph.resources[id.0 as usize].name.clone();
    for (pass, of_pass) in graph.passes.iter().zip(uses) {
        for ((id, cell), cell_use) in of_pass {
            let Some(Version::Before { now }) = graph.resources[id.0 as usize].version else { continue };
            if cell_use.write {
                return Err(GraphError::WritesBefore { pass: pass.name.clone(), resource: name(*id) });
            }
            let writes_now =
                |uses: &BTreeMap<Cell, CellUse>| uses.get(&(now, *cell)).is_some_and(|one| one.write);
            if !uses.iter().any(writes_now) {
                let (pass, resource) = (pass.name.clone(), name(*id));
                return Err(GraphError::NeverWritten { pass, resource, now: name(now) });
            }
        }
    }
    Ok(())
}
