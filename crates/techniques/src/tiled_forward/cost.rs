//! What `tiled-forward` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// TF, section 4.8.
pub fn tiled_forward(w: &Workload) -> Cost {
    let shared = w.light_fragments / w.pixels_a_tile;
    Cost {
        cmd: 2.0 * w.objects * w.object_command + w.lights * w.light_command,
        proc: 2.0 * w.vertices() + w.light_volumes() + w.light_fragments * w.evaluation,
        mem: 2.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + 2.0 * w.object_fragments)
            + (w.volume_traffic() + shared)
            + (w.vertex_traffic()
                + w.pixels * w.object_fragment_traffic
                + w.light_fragment_traffic * shared
                + 2.0 * w.pixels),
    }
}
