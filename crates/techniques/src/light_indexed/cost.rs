//! What `light-indexed` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// LiD, section 4.7, with `index_floats` floats of packed indices a pixel.
///
/// # Where it departs from the paper
/// The paper's memory is `4p`, a G-buffer of three floats and one float of indices; here it is `(3 + index_floats)·p`, since the indices take two,
/// four or six floats. The traffic is the paper's, whose numbering leaves pass 2 out.
pub fn light_indexed(w: &Workload, index_floats: f64) -> Cost {
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + w.light_volumes() + 4.0 * w.pixels * w.evaluation,
        mem: (3.0 + index_floats) * w.pixels,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0))
            + (w.volume_traffic() + w.light_fragments * (4.0 * w.light_fragment_traffic + 4.0)),
    }
}
