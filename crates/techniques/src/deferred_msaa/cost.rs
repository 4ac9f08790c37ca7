//! What `deferred-msaa` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// DAA, section 4.4.
pub fn deferred_msaa(w: &Workload) -> Cost {
    let s = w.shading_samples;
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + (w.light_volumes() + w.light_fragments * s * w.evaluation),
        mem: 4.0 * w.pixels * s,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0) * s)
            + (w.volume_traffic() + w.light_fragments * s * (w.light_fragment_traffic + 3.0))
            + 3.0 * w.pixels * s,
    }
}
