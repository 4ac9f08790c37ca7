//! What `clustered` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// CD, section 4.10; `pixels_a_cluster`: c in lf/c.
pub fn clustered_deferred(w: &Workload, pixels_a_cluster: f64) -> Cost {
    let shading = w.light_fragments * (1.0 - w.light_culling);
    let shared = shading / pixels_a_cluster;
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + w.light_volumes() + shading * w.evaluation,
        mem: 3.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0))
            + (w.volume_traffic() + shared)
            + (w.light_fragment_traffic * shared + 4.0 * w.pixels),
    }
}
