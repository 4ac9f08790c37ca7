//! What `light-list-forward` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// LLiF, section 4.7, which names it and gives no formula: derived from LPP and LLiD. The first pass is DPP's, depth alone, since
/// lists need no normal; the second LLiD's; the third draws the objects again and walks the lists.
pub fn light_list_forward(w: &Workload) -> Cost {
    Cost {
        cmd: 2.0 * w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + w.light_volumes() + (w.vertices() + w.light_fragments * w.evaluation),
        mem: w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + w.object_fragments)
            + (w.volume_traffic() + w.light_fragments)
            + (w.vertex_traffic()
                + w.pixels * (w.object_fragment_traffic + 2.0)
                + w.light_fragments * w.light_fragment_traffic),
    }
}
