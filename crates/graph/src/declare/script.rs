//! Scripts: raster passes whose draws are chosen anew for each frame, without a new plan.

use super::draw::Rect;
use super::graph::Graph;
use super::raster_pass::RasterPass;

/// Names the script of a raster pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ScriptId(pub(crate) u32);

/// One step of a script. The pass's pipelines, buffers and bindings stay those of the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Makes one of the pass's draws, changed in what is said.
    Draw {
        /// Which, in the order in which the pass declared them, from 0.
        draw: u32,
        /// Its scissor; the draw's own where none is said.
        scissor: Option<Rect>,
        /// Its stencil reference.
        stencil_reference: Option<u32>,
        /// First word of its push constants.
        push: Option<u32>,
        /// Of [`DrawCall::IndexedIndirectCount`](super::DrawCall::IndexedIndirectCount): which commands.
        commands: Option<Commands>,
    },
    /// Clears the stencil everywhere.
    ClearStencil(u32),
}

impl Step {
    /// A draw as it was declared.
    pub fn draw(draw: u32) -> Self {
        Step::Draw { draw, scissor: None, stencil_reference: None, push: None, commands: None }
    }
}

/// A range of indirect commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Commands {
    /// Offset of the first, bytes.
    pub offset: u64,
    /// Offset of their count in its buffer, bytes.
    pub count_offset: u64,
    /// Upper bound of the count.
    pub max: u32,
}

impl Graph {
    pub(super) fn next_script(&mut self) -> ScriptId {
        let id = ScriptId(self.scripts);
        self.scripts += 1;
        id
    }
}

impl RasterPass<'_> {
    /// Lets a script make the pass's draws: those of the pass are what it chooses from, in the order of their declaration. A frame makes none
    /// until [`Executor::set_script`](crate::Executor::set_script) says which. The pass declares draws alone: a script clears by itself.
    pub fn script(&mut self) -> ScriptId {
        let id = self.graph.next_script();
        self.node().script = Some(id);
        id
    }
}
