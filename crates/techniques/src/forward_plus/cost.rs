//! What `forward-plus` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// F+, section 4.9.
pub fn forward_plus(w: &Workload) -> Cost {
    let shading = w.light_fragments * (1.0 - w.light_culling);
    let shared = shading / w.pixels_a_tile;
    Cost {
        cmd: 2.0 * w.objects * w.object_command + w.lights * w.light_command,
        proc: 2.0 * w.vertices() + w.light_volumes() + shading * w.evaluation,
        mem: 3.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + w.object_fragments)
            + (w.volume_traffic() + shared)
            + (w.vertex_traffic()
                + w.pixels * w.object_fragment_traffic
                + w.light_fragment_traffic * shared
                + w.pixels),
    }
}
