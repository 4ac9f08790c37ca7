//! What `clustered-forward` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// CF, section 4.10; `pixels_a_cluster`: c in lf/c.
pub fn clustered_forward(w: &Workload, pixels_a_cluster: f64) -> Cost {
    let shading = w.light_fragments * (1.0 - w.light_culling);
    let shared = shading / pixels_a_cluster;
    Cost {
        cmd: 2.0 * w.objects * w.object_command + w.lights * w.light_command,
        proc: 2.0 * w.vertices() + w.light_volumes() + shading * w.evaluation,
        mem: 2.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + 3.0 * w.object_fragments)
            + (w.volume_traffic() + shared)
            + (w.vertex_traffic()
                + w.pixels * w.object_fragment_traffic
                + w.light_fragment_traffic * shared
                + w.pixels),
    }
}
