//! What `forward` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// F, section 4.1: `pass` = lights that one draw applies: all (a loop in the shader: one draw an object) or one.
pub fn forward(w: &Workload, draws_per_object: f64) -> Cost {
    Cost {
        cmd: w.objects * draws_per_object * w.object_command,
        proc: w.vertices() + w.object_fragments * w.lights * w.evaluation,
        mem: 0.0,
        band: w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 2.0),
    }
}
