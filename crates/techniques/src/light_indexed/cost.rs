//! What `light-indexed` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// LiD, section 4.7, as the paper gives it for packed indices of one float a pixel; others change the memory alone.
pub fn light_indexed(w: &Workload, index_floats: f64) -> Cost {
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + w.light_volumes() + 4.0 * w.pixels * w.evaluation,
        mem: (3.0 + index_floats) * w.pixels,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0))
            + (w.volume_traffic() + w.light_fragments * (4.0 * w.light_fragment_traffic + 4.0)),
    }
}
