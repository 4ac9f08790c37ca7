//! What `depth-prepass` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// DPP, section 4.2, for a second pass that is a loop over the lights.
///
/// # Where it departs from the paper
/// The paper's second pass draws the objects once for each light, `{o·o_cmd}1 + {o·l·o_cmd}2` commands, and evaluates one light a pixel,
/// `p·eq_proc`. Here the objects are drawn once more and every pixel loops over the lights: `2·o·o_cmd` and `p·l·eq_proc`.
pub fn depth_prepass(w: &Workload) -> Cost {
    Cost {
        cmd: 2.0 * w.objects * w.object_command,
        proc: w.vertices() + (w.vertices() + w.pixels * w.lights * w.evaluation),
        mem: 0.0,
        band: (w.vertex_traffic() + w.object_fragments)
            + (w.vertex_traffic() + w.pixels * (w.object_fragment_traffic + 2.0)),
    }
}
