//! The way from a declared frame to its plan.

use std::collections::BTreeMap;

use afterlight_gpu::vk;

use super::barriers::{Barrier, BarrierPlanner};
use super::hazards::{Cell, CellUse, join_uses, settle_layouts};
use super::liveness::{check_history, check_reads_after_writes, lifetimes, live_passes};
use super::placement::place;
use super::requirements::{MemoryNeed, Requirements};
use super::resolve::{Resolved, resolve_pass};
use super::{Plan, PlannedPass, PlannedResource};
use crate::declare::{DispatchCall, Graph, PassKind, ResourceKind};
use crate::error::GraphError;

impl Graph {
    /// Plans the frame: checks it, drops passes that nobody needs, and derives order, barriers, lifetimes and places.
    ///
    /// # Errors
    /// The first error of the declaration, a slot that does not fit its shader, a use that excludes another, a read
    /// before any write, a dispatch that is too large, or an image or buffer that `requirements` cannot make.
    pub fn plan(mut self, requirements: &dyn Requirements) -> Result<Plan, GraphError> {
        if !self.errors.is_empty() {
            return Err(self.errors.swap_remove(0));
        }
        let mut resolved: Vec<Resolved> =
            self.passes.iter().map(|pass| resolve_pass(pass, &self.resources)).collect::<Result<_, _>>()?;
        let uses: Vec<BTreeMap<Cell, CellUse>> = self
            .passes
            .iter()
            .zip(&resolved)
            .map(|(pass, resolved)| join_uses(&pass.name, &resolved.accesses, &self.resources))
            .collect::<Result<_, _>>()?;
        check_history(&self, &uses)?;
        check_reads_after_writes(&self, &uses, &resolved)?;
        check_dispatches(&self, requirements)?;
        for ((pass, resolved), uses) in self.passes.iter().zip(&mut resolved).zip(&uses) {
            settle_layouts(&pass.name, &mut resolved.accesses, uses, &self.resources)?;
        }

        let live = live_passes(&self, &uses);
        let live_uses: Vec<&BTreeMap<Cell, CellUse>> =
            uses.iter().zip(&live).filter(|(_, live)| **live).map(|(uses, _)| uses).collect();
        let lifetimes = lifetimes(&self, &live_uses);
        let mut resources = planned_resources(&self, &resolved, &live, &lifetimes, requirements)?;
        let heaps = place(&mut resources, requirements.most_allocation_bytes());

        let mut planner = BarrierPlanner::new(&resources, &live_uses);
        let barriers: Vec<Vec<Barrier>> = (0..live_uses.len()).map(|pass| planner.pass(pass)).collect();
        let final_barriers = planner.finish();
        let final_layouts: Vec<Vec<vk::ImageLayout>> =
            planner.states.iter().map(|cells| cells.iter().map(|cell| cell.layout).collect()).collect();
        let homes = planner.into_homes();
        for ((resource, layouts), home) in resources.iter_mut().zip(final_layouts).zip(homes) {
            let known = |(home, last)| if home == vk::ImageLayout::UNDEFINED { last } else { home };
            resource.final_layouts = match home {
                Some(home) => home.into_iter().zip(layouts).map(known).collect(),
                None => layouts,
            };
        }

        let mut barriers = barriers.into_iter();
        let mut plan = Plan {
            passes: Vec::new(),
            resources,
            heaps,
            final_barriers,
            dropped: Vec::new(),
            scripts: self.scripts,
            unused_slots: Vec::new(),
        };
        for ((node, resolved), live) in self.passes.into_iter().zip(resolved).zip(live) {
            if !live {
                plan.dropped.push(node.name);
                continue;
            }
            plan.unused_slots.extend(resolved.unused);
            plan.passes.push(PlannedPass {
                name: node.name.clone(),
                role: node.role,
                work: node.kind.work(),
                barriers: barriers.next().unwrap_or_default(),
                accesses: resolved.accesses,
                node,
                bindings: resolved.bindings,
            });
        }
        Ok(plan)
    }
}

/// Checks that no dispatch has more workgroups along an axis than the device takes; what the device itself writes for indirect ones is not
/// known here.
fn check_dispatches(graph: &Graph, requirements: &dyn Requirements) -> Result<(), GraphError> {
    let limit = requirements.most_groups();
    for pass in &graph.passes {
        let PassKind::Compute(node) = &pass.kind else { continue };
        for dispatch in &node.dispatches {
            let DispatchCall::Direct(found) = dispatch.call else { continue };
            if found.iter().zip(limit).any(|(found, limit)| *found > limit) {
                return Err(GraphError::Groups { pass: pass.name.clone(), found, limit });
            }
        }
    }
    Ok(())
}

fn planned_resources(
    graph: &Graph,
    resolved: &[Resolved],
    live: &[bool],
    lifetimes: &[Option<(usize, usize)>],
    requirements: &dyn Requirements,
) -> Result<Vec<PlannedResource>, GraphError> {
    let mut image_usage = vec![vk::ImageUsageFlags::empty(); graph.resources.len()];
    let mut buffer_usage = vec![vk::BufferUsageFlags::empty(); graph.resources.len()];
    for (resolved, _) in resolved.iter().zip(live).filter(|(_, live)| **live) {
        for (id, usage) in &resolved.image_usage {
            image_usage[id.0 as usize] |= *usage;
        }
        for (id, usage) in &resolved.buffer_usage {
            buffer_usage[id.0 as usize] |= *usage;
        }
    }
    for (index, node) in graph.resources.iter().enumerate() {
        if node.kept {
            image_usage[index] |= vk::ImageUsageFlags::TRANSFER_SRC;
            buffer_usage[index] |= vk::BufferUsageFlags::TRANSFER_SRC;
        }
    }
    let mut out = Vec::with_capacity(graph.resources.len());
    for (index, node) in graph.resources.iter().enumerate() {
        if let Some(version) = node.version {
            // The two take turns, and are cleared before the first frame.
            let other = version.other().0 as usize;
            let images = image_usage[index] | image_usage[other] | vk::ImageUsageFlags::TRANSFER_DST;
            let buffers = buffer_usage[index] | buffer_usage[other] | vk::BufferUsageFlags::TRANSFER_DST;
            for of in [index, other] {
                (image_usage[of], buffer_usage[of]) = (images, buffers);
            }
        }
        let used = lifetimes[index].is_some() && node.import.is_none();
        let need = match &node.kind {
            _ if !used => MemoryNeed { bytes: 0, alignment: 1, type_bits: 0 },
            ResourceKind::Image(info) => requirements.image(&node.name, info, image_usage[index])?,
            ResourceKind::Buffer { bytes } => requirements.buffer(&node.name, *bytes, buffer_usage[index])?,
        };
        out.push(PlannedResource {
            name: node.name.clone(),
            role: node.role,
            need,
            lifetime: lifetimes[index],
            placement: None,
            kept: node.kept,
            output: node.output,
            imported: node.import.is_some(),
            image_usage: image_usage[index],
            buffer_usage: buffer_usage[index],
            kind: node.kind.clone(),
            import: node.import.clone(),
            version: node.version,
            final_layouts: Vec::new(),
        });
    }
    Ok(out)
}
