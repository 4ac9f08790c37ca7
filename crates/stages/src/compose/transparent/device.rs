//! The order of triangles with alpha blending, found on the device: their keys, a sort, and a command for each run of triangles of one draw.

use afterlight_graph::{
    BufferHandle, BufferRole, Graph, PassRole,
    gpu::{self, vk},
};
use afterlight_shader::structs::DrawChoiceConstants;

use super::list::OrderedTriangles;
use crate::shared::sort::{self, ItemCount, Items, KeyBits};
use afterlight_frame::{
    ChangesWith, Cull, DrawOrder, DrawParams, Frame, TechniqueError, View, put,
    scene::draw_list::COMMAND_BYTES,
};

/// Triangles of a group: `THREADS` in `order.glsl`.
const GROUP_TRIANGLES: u32 = 256;

const ROLES: (PassRole, BufferRole) = (PassRole::Transparency, BufferRole::Transparency);

/// Whether a device can sort so many triangles: its groups share the memory that the sort takes, and one binding reaches their commands.
pub(super) fn fits(features: &gpu::Features, triangles: usize) -> bool {
    sort::fits(features) && COMMAND_BYTES * triangles as u64 <= features.max_storage_buffer_range
}

/// Declares the passes that put the triangles of a scene in order for each view.
///
/// # Errors
/// A shader that is not compiled in, the device, more triangles than one binding reaches.
pub(super) fn order(
    graph: &mut Graph,
    frame: &Frame<'_>,
    cull: Cull,
) -> Result<OrderedTriangles, TechniqueError> {
    let triangles = Triangles::import(graph, frame)?;
    let items = triangles.keys(graph, frame, cull)?;
    let items = sort::by_key(
        graph,
        frame,
        "shared/transparent",
        ROLES,
        items,
        ItemCount::Known(triangles.count),
        KeyBits::All32,
    )?
    .items;
    triangles.write(graph, frame, &items)
}

/// The triangles of a scene.
struct Triangles {
    records: BufferHandle,
    count: u32,
}

impl Triangles {
    fn import(graph: &mut Graph, frame: &Frame<'_>) -> Result<Self, TechniqueError> {
        let count = frame.scene.blended_triangle_count();
        let found = COMMAND_BYTES * count;
        frame.check_binding("shared/transparent", "commands of blended triangles", found)?;
        let records =
            graph.import_buffer("scene blended triangles", BufferRole::Scene, &frame.scene.blended_triangles);
        // What one binding reaches is below 4 GiB, and a command is 20 bytes.
        Ok(Self { records, count: count as u32 })
    }

    fn groups(&self) -> u32 {
        self.count.div_ceil(GROUP_TRIANGLES)
    }

    fn buffer(&self, graph: &mut Graph, what: &str, words_each: u64) -> BufferHandle {
        let bytes = 4 * words_each * u64::from(self.count.max(1));
        graph.buffer(&format!("shared/transparent {what}"), ROLES.1, bytes)
    }

    /// Declares the pass that finds the key of every triangle.
    fn keys(&self, graph: &mut Graph, frame: &Frame<'_>, cull: Cull) -> Result<Items, TechniqueError> {
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
        let how = (size_of::<DrawChoiceConstants>() as u64, usage, ChangesWith::Camera);
        let named = ("shared/transparent view", BufferRole::Constants);
        let view =
            frame.input(graph, named, how, move |view, bytes| put(bytes, 0, &[constants(view, cull)]))?;
        let [keys, values] = ["keys", "values"].map(|what| self.buffer(graph, what, 1));
        let shader = frame.shader("compose/transparent/keys.comp")?;
        let mut pass = graph.compute("shared/transparent keys", ROLES.0, &shader);
        pass.push(&[self.count]);
        pass.read("BlendedTriangles", &self.records).read("ViewBlock", &view);
        pass.read("draw_data", &frame.buffers.draw_data).read("draw_bounds", &frame.buffers.draw_bounds);
        let keys = pass.write("Keys", keys);
        let values = pass.write("Values", values);
        pass.dispatch(frame.groups_in_rows(self.groups()));
        pass.finish();
        Ok(Items { keys, values })
    }

    /// Declares the passes that write indices and commands of the triangles in their order.
    fn write(
        &self,
        graph: &mut Graph,
        frame: &Frame<'_>,
        items: &Items,
    ) -> Result<OrderedTriangles, TechniqueError> {
        let commands = self.buffer(graph, "commands", COMMAND_BYTES / 4);
        let indices = self.buffer(graph, "indices", 3);
        let counts =
            graph.buffer("shared/transparent run counts", ROLES.1, 4 * u64::from(self.groups().max(1)));
        let count = graph.buffer("shared/transparent command count", ROLES.1, 4);

        let shader = frame.shader("compose/transparent/count_runs.comp")?;
        let mut pass = graph.compute("shared/transparent count runs", ROLES.0, &shader);
        pass.push(&[self.count]);
        pass.read("BlendedTriangles", &self.records);
        pass.read("Keys", &items.keys).read("Values", &items.values);
        let counts = pass.write("RunCounts", counts);
        let commands = pass.write("DrawCommands", commands);
        pass.dispatch(frame.groups_in_rows(self.groups()));
        pass.finish();

        let shader = frame.shader("compose/transparent/write_runs.comp")?;
        let mut pass = graph.compute("shared/transparent write runs", ROLES.0, &shader);
        pass.push(&[self.count]);
        pass.read("BlendedTriangles", &self.records).read("RunCounts", &counts);
        pass.read("Keys", &items.keys).read("Values", &items.values);
        pass.read("SceneIndices", &frame.buffers.indices).read("draw_data", &frame.buffers.draw_data);
        let commands = pass.write("DrawCommands", commands);
        let indices = pass.write("Indices", indices);
        let count = pass.write("DrawCount", count);
        pass.dispatch(frame.groups_in_rows(self.groups()));
        pass.finish();
        Ok(OrderedTriangles {
            indices,
            commands: Some(commands),
            count: Some(count),
            offsets: [0, 0],
            max: self.count,
        })
    }
}

/// Half-spaces and distances of a view.
fn constants(view: &View<'_>, cull: Cull) -> DrawChoiceConstants {
    let options = DrawParams { cull, order: DrawOrder::Scene, ..DrawParams::default() };
    let query = view.query_of(&options, view.camera, None).0;
    // Those of the query measure sizes on the image.
    DrawChoiceConstants { distance_from_world: view.camera.distance_from_world().into(), ..query }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_sorts_what_its_bindings_and_groups_hold() {
        let mut features = gpu::Features::default();
        features.max_shared_memory_bytes = 1 << 15;
        features.max_storage_buffer_range = 2000;
        assert!(fits(&features, 100) && !fits(&features, 101));
        features.max_shared_memory_bytes = 1 << 14;
        assert!(!fits(&features, 1));
    }
}
