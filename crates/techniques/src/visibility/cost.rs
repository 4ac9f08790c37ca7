//! What `visibility` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// D++, section 4.11.
///
/// # Where it departs from the paper
/// The paper uses `t` in two senses: tiles of a frame (`t·tile_cmd`) and pixels of a tile (`lf/t`, `2p/t`). Here `tiles` is the first and
/// `pixels_a_tile` the second, and `2p/t`, two floats a tile, is `2·tiles`; `ov/t` divides by the tiles of a frame. The paper numbers two terms 3;
/// the second is pass 4.
pub fn visibility_buffer(w: &Workload) -> Cost {
    let shared = w.light_fragments / w.pixels_a_tile * (1.0 - w.light_culling);
    let vertices_a_tile = if w.tiles > 0.0 { w.object_vertices / w.tiles } else { 0.0 };
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command + w.tiles * w.tile_command,
        proc: w.vertices()
            + w.sort
            + w.light_volumes()
            + (vertices_a_tile * w.object_vertex_processing
                + w.light_fragments * (1.0 - w.light_culling) * w.evaluation),
        mem: 3.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + 2.0 * w.object_fragments)
            + 2.0 * w.tiles
            + (w.volume_traffic() + shared)
            + (vertices_a_tile * w.object_vertex_traffic
                + w.pixels * w.object_fragment_traffic
                + w.light_fragment_traffic * shared
                + w.pixels),
    }
}
