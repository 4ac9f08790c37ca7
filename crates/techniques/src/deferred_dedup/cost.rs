//! What `deferred-dedup` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// The project's own: DAA with five floats a sample (Schied and Dachsbacher 2015, section 5), of which each is read once and
/// only those of different triangles are shaded. No light volumes.
pub fn deferred_dedup(w: &Workload) -> Cost {
    let (stored, shaded) = (w.shading_samples, w.expected_samples);
    Cost {
        cmd: w.objects * w.object_command,
        proc: w.vertices() + w.light_fragments * shaded * w.evaluation,
        mem: 5.0 * w.pixels * stored,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 5.0 * stored))
            + w.light_fragments * shaded * w.light_fragment_traffic
            + 5.0 * w.pixels * stored,
    }
}
