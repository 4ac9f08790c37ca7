//! What `dais-list` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// The project's own: [`dais`](crate::dais::cost::dais) with a float a sample (depth), a float a pixel (the head) and two a surface where
/// a pixel shows several; the scene is drawn twice.
pub fn dais_list(w: &Workload, record_floats: f64) -> Cost {
    let (stored, shaded) = (w.shading_samples, w.expected_samples);
    let triangles = (w.object_vertices / 3.0).min(w.pixels * shaded);
    let lists = w.pixels * (1.0 + 2.0 * (shaded - 1.0).max(0.0));
    Cost {
        cmd: 2.0 * w.objects * w.object_command,
        proc: 3.0 * w.vertices() + w.light_fragments * shaded * w.evaluation,
        mem: w.pixels * stored + lists + record_floats * triangles,
        band: 3.0 * w.vertex_traffic()
            + w.object_fragments * stored
            + w.pixels * stored
            + 2.0 * lists
            + record_floats * triangles
            + w.pixels * shaded * (record_floats + w.object_fragment_traffic)
            + w.light_fragments * shaded * w.light_fragment_traffic,
    }
}
