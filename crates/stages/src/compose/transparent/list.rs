//! Which triangles with alpha blending a frame draws, in which order, and who finds it.

use std::sync::Arc;

use afterlight_graph::{
    BufferHandle, BufferRole, DrawCall, Graph,
    gpu::{self, vk},
};

use super::{device, is_drawn};
use afterlight_frame::{
    ChangesWith, Cull, CullOn, DrawParams, Frame, TechniqueError, View, put,
    scene::blended::{Ordered, ViewOrder},
    scene::draw_list::COMMAND_BYTES,
};

/// The triangles with alpha blending that a view needs, or all that there are where views change.
pub struct BlendedList {
    /// Draws in view.
    pub draw_count: u32,
    /// Draws outside of the view are left out, or none.
    pub(super) cull: Cull,
    order: Order,
}

/// Who finds the order.
enum Order {
    /// The device, for each frame.
    OnDevice,
    /// The host.
    OnHost {
        index_count: usize,
        command_count: usize,
        /// The order of the only view; `None` where views change.
        found: Option<Arc<Ordered>>,
    },
}

impl BlendedList {
    /// Those of a view; `None` where there are none in it, or the settings ask for none. If the frame `moves`, there is room for every
    /// triangle of the scene.
    pub fn of_view(
        view: &View<'_>,
        options: &DrawParams,
        features: &gpu::Features,
        moves: bool,
    ) -> Option<Self> {
        if !is_drawn(view.settings, view.scene) {
            return None;
        }
        let (cull, triangles) = (options.cull, view.placed.blended.triangle_count());
        // A device that cannot is told only where it is asked to.
        let can = options.cull_on == CullOn::Gpu || device::fits(features, triangles);
        if can && options.cull_on.sorts_on_device(triangles) {
            let draw_count = view.placed.blended.in_view_count(&view_order(view, cull));
            let has_any = moves || draw_count > 0;
            return has_any.then_some(Self { draw_count, cull, order: Order::OnDevice });
        }
        let found = view.placed.blended.order(&view_order(view, cull));
        let draw_count = found.draw_count;
        if moves {
            // Every triangle may be a run of its own.
            let order = Order::OnHost { index_count: 3 * triangles, command_count: triangles, found: None };
            return Some(Self { draw_count, cull, order });
        }
        let (index_count, command_count) = (found.indices.len(), found.commands.len());
        let order = Order::OnHost { index_count, command_count, found: Some(Arc::new(found)) };
        (command_count > 0).then_some(Self { draw_count, cull, order })
    }

    /// Brings the triangles into the graph, in their order.
    pub(super) fn declare(
        &self,
        graph: &mut Graph,
        frame: &Frame<'_>,
    ) -> Result<OrderedTriangles, TechniqueError> {
        match &self.order {
            Order::OnDevice => device::order(graph, frame, self.cull),
            Order::OnHost { index_count, command_count, found } => {
                self.declare_host(graph, frame, [*index_count, *command_count], found.clone())
            }
        }
    }

    /// One buffer, filled for each view: indices, then commands, then their count.
    fn declare_host(
        &self,
        graph: &mut Graph,
        frame: &Frame<'_>,
        [index_count, command_count]: [usize; 2],
        found: Option<Arc<Ordered>>,
    ) -> Result<OrderedTriangles, TechniqueError> {
        let commands_at = 4 * index_count as u64;
        let count_at = commands_at + COMMAND_BYTES * command_count as u64;
        let usage = vk::BufferUsageFlags::INDEX_BUFFER | vk::BufferUsageFlags::INDIRECT_BUFFER;
        let (how, cull) = ((count_at + 4, usage, ChangesWith::Camera), self.cull);
        let buffer =
            frame.input(graph, ("blended triangles", BufferRole::Scene), how, move |view, bytes| {
                let of_view;
                let Ordered { indices, commands, .. } = match &found {
                    Some(found) => &**found,
                    None => {
                        of_view = view.placed.blended.order(&view_order(view, cull));
                        &of_view
                    }
                };
                put(bytes, 0, indices);
                put(bytes, commands_at as usize, commands);
                put(bytes, count_at as usize, &[commands.len() as u32]);
            })?;
        Ok(OrderedTriangles {
            indices: buffer,
            commands: None,
            count: None,
            offsets: [commands_at, count_at],
            max: command_count as u32,
        })
    }
}

/// How a view orders triangles.
fn view_order(view: &View<'_>, cull: Cull) -> ViewOrder {
    ViewOrder {
        cull: (cull == Cull::Frustum).then_some(view.camera.clip_from_world),
        distance_from_world: view.camera.distance_from_world(),
        displacement_m: view.displacement_m(),
    }
}

/// Triangles in drawing order, as the graph knows them.
pub(super) struct OrderedTriangles {
    /// Indices, counted from the first vertex of their draw.
    pub indices: BufferHandle,
    /// A command a run of triangles of one draw; `None` is in the buffer of the indices.
    pub commands: Option<BufferHandle>,
    /// Number of commands; `None` is in the buffer of the indices.
    pub count: Option<BufferHandle>,
    /// Where commands and count begin in their buffers, bytes.
    pub offsets: [u64; 2],
    /// Commands at most.
    pub max: u32,
}

impl OrderedTriangles {
    /// All of them in one call. With a count on the device, as all draws of a frame: after such calls, one without drew nothing on lavapipe.
    pub fn call(&self) -> DrawCall<'_> {
        DrawCall::IndexedIndirectCount {
            buffer: self.commands.as_ref().unwrap_or(&self.indices),
            offset: self.offsets[0],
            count_buffer: self.count.as_ref().unwrap_or(&self.indices),
            count_offset: self.offsets[1],
            max: self.max,
            stride: COMMAND_BYTES as u32,
        }
    }
}
