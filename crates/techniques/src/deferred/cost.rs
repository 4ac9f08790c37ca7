//! What `deferred` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// D, section 4.3.
pub fn deferred(w: &Workload) -> Cost {
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + (w.light_volumes() + w.light_fragments * w.evaluation),
        mem: 4.0 * w.pixels,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0))
            + (w.volume_traffic() + w.light_fragments * (w.light_fragment_traffic + 3.0))
            + 3.0 * w.pixels,
    }
}
