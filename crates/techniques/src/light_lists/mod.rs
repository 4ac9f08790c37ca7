//! Lists of lights, one a pixel, for `light-list` and `light-list-forward`: see the README of this folder.

use afterlight_graph::{BufferHandle, Graph, ImageHandle, gpu::vk};

use crate::{
    Frame, ParamInfo, ParamKind, TechniqueError, capacity::FIRST_GUESS, cost::Workload, frame::Slots, volumes,
};

/// Nodes of the lists.
pub const NODES: ParamInfo = ParamInfo {
    key: "nodes",
    summary: "nodes of the light lists; auto: as many as the view needs, counted; fixed: what finds none is dropped and told",
    kind: ParamKind::AutoOrInteger { min: 0, max: MOST_NODES },
    default: "auto",
};

/// Most nodes, below where the count on the device ends.
const MOST_NODES: u32 = 1 << 30;

/// The lists of a frame: a head of 4 bytes a pixel, nodes of 8 bytes.
pub struct LightLists {
    heads: BufferHandle,
    nodes: BufferHandle,
}

/// Declares `technique/lists`: each light with an end is appended to the list of every pixel whose surface lies within its range.
/// `depth` is the surfaces' depth, reversed, with or without stencil.
///
/// # Errors
/// More nodes than the device binds, a shader that is not compiled in.
pub fn build(
    graph: &mut Graph,
    frame: &Frame<'_>,
    info: &crate::Info,
    depth: &ImageHandle,
) -> Result<LightLists, TechniqueError> {
    let pixels = u64::from(frame.width_px) * u64::from(frame.height_px);
    let fixed: Option<u32> = frame.params.text(info, NODES.key).parse().ok();
    let capacity = fixed.unwrap_or_else(|| frame.capacity(NODES.key, FIRST_GUESS));
    frame.check_binding(info.id, "light heads", 4 * pixels)?;
    frame.check_binding(info.id, "light nodes", 8 * u64::from(capacity))?;
    let zeroed = |graph: &mut Graph, name: &str, bytes: u64| {
        let buffer = graph.buffer(&format!("{}/{name}", info.id), bytes);
        graph.clear_buffer(&format!("{}/clear {name}", info.id), buffer, 0)
    };
    let mut heads = zeroed(graph, "light heads", 4 * pixels);
    let mut count = zeroed(graph, "light node count", 8);
    let mut nodes = graph.buffer(&format!("{}/light nodes", info.id), 8 * u64::from(capacity.max(1)));

    let bounded = frame.lights.count - frame.lights.unbounded_count;
    if bounded > 0 {
        let state = volumes::volume_state(
            frame,
            Some("light_lists/append.frag"),
            vk::CullModeFlags::FRONT,
            Vec::new(),
        )?
        .depth(volumes::BEHIND_SURFACE)
        .constant("NODE_CAPACITY", capacity);
        let mut pass = graph.raster(&format!("{}/lists", info.id));
        frame.bind_scene(&mut pass);
        pass.read_image("light_lists_depth", depth);
        heads = pass.write("LightHeads", heads);
        nodes = pass.write("LightNodes", nodes);
        count = pass.write("LightNodeCount", count);
        pass.depth_read_only(depth);
        pass.draw(volumes::volume_draw(frame, state, frame.lights.unbounded_count, bounded));
        pass.finish();
    } else {
        nodes = graph.clear_buffer(&format!("{}/clear light nodes", info.id), nodes, 0);
    }
    frame.watch(graph, NODES.key, &count, capacity, fixed.is_some());
    Ok(LightLists { heads, nodes })
}

impl LightLists {
    /// Binds what `lists.glsl` reads.
    pub fn bind(&self, pass: &mut impl Slots) {
        pass.read_buffer("LightHeads", &self.heads);
        pass.read_buffer("LightNodes", &self.nodes);
    }
}

/// The workload with the lists' memory: a float a pixel, two a pair of a light and a pixel.
pub fn with_lists(workload: &Workload) -> Workload {
    Workload { light_list_floats: workload.pixels + 2.0 * workload.light_fragments, ..*workload }
}
