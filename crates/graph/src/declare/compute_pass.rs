//! Compute passes: one shader and its dispatches.

use afterlight_gpu as gpu;

use super::constants::ConstantBits;
use super::graph::Graph;
use super::handles::{BufferHandle, Handle, ImageHandle};
use super::image_info::Subresource;
use super::nodes::{ComputeNode, DispatchCall, DispatchNode, Intent, PassKind, SlotNode};
use super::slots::slots;

/// A compute pass under declaration.
pub struct ComputePass<'g> {
    pub(super) graph: &'g mut Graph,
    pub(super) pass: usize,
}

impl ComputePass<'_> {
    slots!();

    pub(super) fn node(&mut self) -> &mut ComputeNode {
        match &mut self.graph.passes[self.pass].kind {
            PassKind::Compute(node) => node,
            _ => unreachable!("a compute builder holds a compute pass"),
        }
    }

    /// Sets a specialization constant by name: a `u32`, `i32`, `f32` or `bool`.
    pub fn constant(&mut self, name: &str, value: impl ConstantBits) -> &mut Self {
        self.node().constants.push((name.to_owned(), value.bits()));
        self
    }

    /// Sets the push constants of the dispatches that follow.
    pub fn push<T: bytemuck::NoUninit>(&mut self, value: &T) -> &mut Self {
        self.node().push = bytemuck::bytes_of(value).to_vec();
        self
    }

    /// Runs `groups` workgroups. Dispatches of one pass are not ordered among each other.
    pub fn dispatch(&mut self, groups: [u32; 3]) -> &mut Self {
        let node = self.node();
        node.dispatches.push(DispatchNode { push: node.push.clone(), call: DispatchCall::Direct(groups) });
        self
    }

    /// Runs as many workgroups as three `u32` at `offset` bytes in `buffer` say.
    pub fn dispatch_indirect(&mut self, buffer: &BufferHandle, offset: u64) -> &mut Self {
        let name = self.graph.passes[self.pass].name.clone();
        if let Some(buffer) = self.graph.own(&name, buffer) {
            let node = self.node();
            let call = DispatchCall::Indirect { buffer, offset };
            node.dispatches.push(DispatchNode { push: node.push.clone(), call });
        }
        self
    }
}
