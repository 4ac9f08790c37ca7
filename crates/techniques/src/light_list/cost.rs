//! What `light-list` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// LLiD, section 4.7.
pub fn light_list(w: &Workload) -> Cost {
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + w.light_volumes() + w.light_fragments * w.evaluation,
        mem: 3.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0))
            + (w.volume_traffic() + w.light_fragments)
            + (w.light_fragments * w.light_fragment_traffic + 4.0 * w.pixels),
    }
}
