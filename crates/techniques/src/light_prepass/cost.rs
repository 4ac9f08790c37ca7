//! What `light-prepass` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// LPP, section 4.5.
pub fn light_prepass(w: &Workload) -> Cost {
    Cost {
        cmd: 2.0 * w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + (w.light_volumes() + w.light_fragments * w.evaluation) + w.vertices(),
        mem: 3.0 * w.pixels,
        band: (w.vertex_traffic() + 2.0 * w.object_fragments)
            + (w.volume_traffic() + w.light_fragments * (w.light_fragment_traffic + 3.0))
            + (w.vertex_traffic() + w.pixels * (w.object_fragment_traffic + 2.0)),
    }
}
