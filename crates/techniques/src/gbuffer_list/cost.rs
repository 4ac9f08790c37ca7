//! What `gbuffer-list` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// The project's own: per-pixel lists (Fridvalszky and Tóth 2020). Depth (and triangle IDs, where compute fills the lists) at
/// all samples, blocks of 3.5 floats for what shows alone.
pub fn gbuffer_list(w: &Workload, fill_in_compute: bool) -> Cost {
    let (stored, shaded) = (w.shading_samples, w.expected_samples);
    let floats_a_sample = if fill_in_compute { 2.0 } else { 1.0 };
    let blocks = 3.5 * w.pixels * shaded;
    let passes = if fill_in_compute { 1.0 } else { 2.0 };
    Cost {
        cmd: passes * w.objects * w.object_command,
        proc: passes * w.vertices() + w.light_fragments * shaded * w.evaluation,
        mem: floats_a_sample * w.pixels * stored + blocks,
        band: passes * w.vertex_traffic()
            + w.object_fragments * floats_a_sample * stored
            + w.pixels * (floats_a_sample * stored + shaded * w.object_fragment_traffic)
            + 2.0 * blocks
            + w.light_fragments * shaded * w.light_fragment_traffic,
    }
}
