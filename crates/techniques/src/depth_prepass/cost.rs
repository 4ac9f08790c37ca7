//! What `depth-prepass` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// DPP, section 4.2, the second pass a loop over the lights.
pub fn depth_prepass(w: &Workload) -> Cost {
    Cost {
        cmd: 2.0 * w.objects * w.object_command,
        proc: w.vertices() + (w.vertices() + w.pixels * w.lights * w.evaluation),
        mem: 0.0,
        band: (w.vertex_traffic() + w.object_fragments)
            + (w.vertex_traffic() + w.pixels * (w.object_fragment_traffic + 2.0)),
    }
}
