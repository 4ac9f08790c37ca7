//! Lists of lights, one a pixel, for `light-list` and `light-list-forward`: see the README of this folder.

use afterlight_graph::{BufferHandle, BufferRole, DepthTest, Graph, ImageHandle, PassRole, gpu::vk};

use crate::lights::{
    bvh::{self, LightBvh},
    cells::VisibleDepths,
    volumes,
};
use afterlight_cost::Workload;
use afterlight_frame::{Frame, Slots, TechniqueError, capacity::FIRST_GUESS, params::AutoOr};

mod params;

pub use params::LightListParams;

/// Name of the counter of nodes.
const COUNTER: &str = "light nodes";

/// The lists of a frame: a head of 12 bytes a pixel, nodes of 8 bytes.
pub struct LightLists {
    heads: BufferHandle,
    nodes: BufferHandle,
    tree: LightBvh,
    sampled: bool,
}

/// Declares `technique/heads` and `technique/lists`: each light with an end is appended to the list of every pixel that it reaches
/// between the nearest and the farthest of the pixel's surfaces. With depth of one sample, reversed, with or without stencil, what
/// lies behind the surface is not drawn.
///
/// # Errors
/// More nodes than the device binds, a shader that is not compiled in.
pub fn build(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    nodes: AutoOr<u32>,
    surfaces: &VisibleDepths<'_>,
    depth: Option<&ImageHandle>,
) -> Result<LightLists, TechniqueError> {
    let fixed = nodes.fixed();
    let capacity = fixed.unwrap_or_else(|| frame.capacity(COUNTER, FIRST_GUESS));
    frame.check_binding(technique, "light nodes", 8 * u64::from(capacity))?;
    let tree = bvh::build(graph, frame, technique)?;
    let mut heads = empty_heads(graph, frame, technique, surfaces)?;
    let count = graph.buffer(&format!("{}/light node count", technique), BufferRole::Lights, 8);
    let mut count = graph.clear_buffer(
        &format!("{}/clear light node count", technique),
        PassRole::LightAssignment,
        count,
        0,
    );
    let mut nodes = graph.buffer(
        &format!("{}/light nodes", technique),
        BufferRole::Lights,
        8 * u64::from(capacity.max(1)),
    );

    let bounded = frame.lights.bounded_count();
    if bounded > 0 {
        let (test, shader) = match depth {
            Some(_) => (volumes::BEHIND_SURFACE, "lights/pixel_lists/append.frag#one"),
            None => (DepthTest::OFF, "lights/pixel_lists/append.frag"),
        };
        let state = volumes::volume_state(frame, Some(shader), vk::CullModeFlags::FRONT, Vec::new())?
            .depth(test)
            .constant("NODE_CAPACITY", capacity)
            .constant("SAMPLED", u32::from(surfaces.samples() > 1));
        let mut pass = graph.raster(&format!("{}/lists", technique), PassRole::LightAssignment);
        frame.bind_scene(&mut pass);
        heads = pass.write("LightHeads", heads);
        nodes = pass.write("LightNodes", nodes);
        count = pass.write("LightNodeCount", count);
        match depth {
            Some(depth) => {
                pass.read_image("light_lists_depth", depth);
                pass.depth_read_only(depth);
            }
            None => _ = pass.extent(frame.width_px, frame.height_px),
        }
        pass.draw(volumes::volume_draw(frame, state, frame.lights.unbounded_count, bounded));
        pass.finish();
    } else {
        nodes = graph.clear_buffer(
            &format!("{}/clear light nodes", technique),
            PassRole::LightAssignment,
            nodes,
            0,
        );
    }
    frame.watch(graph, COUNTER, &count, capacity, fixed.is_some());
    Ok(LightLists { heads, nodes, tree, sampled: surfaces.samples() > 1 })
}

/// Heads of empty lists, and where the surfaces of each pixel lie.
fn empty_heads(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    surfaces: &VisibleDepths<'_>,
) -> Result<BufferHandle, TechniqueError> {
    let bytes = 12 * u64::from(frame.width_px) * u64::from(frame.height_px);
    frame.check_binding(technique, "light heads", bytes)?;
    let heads = graph.buffer(&format!("{technique}/light heads"), BufferRole::Lights, bytes);
    let shader = frame.shader(&surfaces.shader("lights/pixel_lists", "heads.comp"))?;
    let mut pass = frame.compute(graph, &format!("{technique}/heads"), PassRole::LightAssignment, &shader);
    surfaces.bind(&shader, &mut pass);
    let heads = pass.write("LightHeads", heads);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(heads)
}

impl LightLists {
    /// Specialization constant of what includes `pixel_lists.glsl`.
    pub fn constant(&self) -> (&'static str, u32) {
        ("LISTS_SAMPLED", u32::from(self.sampled))
    }

    /// Binds what `pixel_lists.glsl` reads.
    pub fn bind(&self, frame: &Frame<'_>, pass: &mut impl Slots) {
        pass.read_buffer("LightHeads", &self.heads);
        pass.read_buffer("LightNodes", &self.nodes);
        self.tree.bind(frame, pass);
    }
}

/// The workload with the lists' memory: three floats a pixel, two a pair of a light and a pixel.
pub fn with_lists(workload: &Workload) -> Workload {
    Workload { light_list_floats: 3.0 * workload.pixels + 2.0 * workload.light_fragments, ..*workload }
}
