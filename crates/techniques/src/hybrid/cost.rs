//! What `hybrid` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// The project's own, for the hybrid that section 4.5 names without a formula: a share of the objects (and of their vertices,
/// fragments and pixels) goes through LPP, the others through D. Its memory is D's: LPP's floats are among them.
pub fn hybrid(w: &Workload, prepass_share: f64) -> Cost {
    let (prepass, deferred) = (prepass_share, 1.0 - prepass_share);
    Cost {
        cmd: (1.0 + prepass) * w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + (w.light_volumes() + w.light_fragments * w.evaluation) + prepass * w.vertices(),
        mem: 4.0 * w.pixels,
        band: (w.vertex_traffic()
            + w.object_fragments * (deferred * (w.object_fragment_traffic + 3.0) + prepass * 2.0))
            + (w.volume_traffic() + w.light_fragments * (w.light_fragment_traffic + 3.0))
            + (prepass * (w.vertex_traffic() + w.pixels * (w.object_fragment_traffic + 2.0))
                + deferred * 3.0 * w.pixels),
    }
}
