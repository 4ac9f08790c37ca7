//! What `light-indexed-forward` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// LiF, section 4.7, which names it and gives no formula: derived from LPP and LiD. The first pass is DPP's, depth alone, since
/// indices need no normal; the second leaves indices as LiD's; the third draws the objects again. Of LiD's four floats beside the
/// lights' the three of its G-buffer are gone.
pub fn light_indexed_forward(w: &Workload, index_floats: f64) -> Cost {
    Cost {
        cmd: 2.0 * w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + w.light_volumes() + (w.vertices() + 4.0 * w.pixels * w.evaluation),
        mem: (1.0 + index_floats) * w.pixels,
        band: (w.vertex_traffic() + w.object_fragments)
            + w.volume_traffic()
            + (w.vertex_traffic()
                + w.pixels * (w.object_fragment_traffic + 2.0)
                + w.light_fragments * (4.0 * w.light_fragment_traffic + 1.0)),
    }
}
