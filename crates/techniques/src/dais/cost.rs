//! What `dais` costs by the model of Petrescu et al. 2016, section 4.

use afterlight_cost::{Cost, Workload};

/// The project's own: DAIS (Schied and Dachsbacher 2015) with the triangle buffer filled from the visibility buffer. Two floats
/// a sample, depth and a triangle's name, written and read twice; `record_floats` (`RecordParams::floats`) for each triangle that shows,
/// at most all of them and at most one a pixel and surface, written once and read for every surface.
pub fn dais(w: &Workload, record_floats: f64) -> Cost {
    let (stored, shaded) = (w.shading_samples, w.expected_samples);
    let triangles = (w.object_vertices / 3.0).min(w.pixels * shaded);
    Cost {
        cmd: w.objects * w.object_command,
        proc: 2.0 * w.vertices() + w.light_fragments * shaded * w.evaluation,
        mem: 2.0 * w.pixels * stored + record_floats * triangles,
        band: 2.0 * w.vertex_traffic()
            + 2.0 * w.object_fragments * stored
            + 2.0 * w.pixels * stored
            + record_floats * triangles
            + w.pixels * shaded * (record_floats + w.object_fragment_traffic)
            + w.light_fragments * shaded * w.light_fragment_traffic,
    }
}

/// The project's own: [`dais`] with the triangle buffer filled by fragments: the scene is drawn twice, and what shows alone writes
/// a triangle's name.
pub fn dais_cached(w: &Workload, record_floats: f64) -> Cost {
    let once = dais(w, record_floats);
    Cost {
        cmd: 2.0 * once.cmd,
        proc: once.proc + w.vertices(),
        mem: once.mem,
        band: once.band + w.vertex_traffic() + (w.pixels - w.object_fragments) * w.shading_samples,
    }
}
