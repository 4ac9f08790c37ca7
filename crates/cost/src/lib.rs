//! The cost model of Petrescu et al. 2016, section 3 and 4: pure arithmetic over counted symbols.

use serde::Serialize;

/// The model's symbols for a scene, a view and a device. Traffic and memory are in floats of four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Workload {
    /// o: draws.
    pub objects: f64,
    /// l: lights.
    pub lights: f64,
    /// o_cmd: cost of one object draw.
    pub object_command: f64,
    /// l_cmd: cost of one light draw.
    pub light_command: f64,
    /// tile_cmd: cost of one tile's dispatch.
    pub tile_command: f64,
    /// ov: vertices of all objects.
    pub object_vertices: f64,
    /// lv: vertices of all light volumes.
    pub light_vertices: f64,
    /// ov_proc: processing of an object vertex.
    pub object_vertex_processing: f64,
    /// lv_proc: processing of a light vertex.
    pub light_vertex_processing: f64,
    /// ov_band: floats of an object vertex.
    pub object_vertex_traffic: f64,
    /// lv_band: floats of a light vertex.
    pub light_vertex_traffic: f64,
    /// of: fragments of objects.
    pub object_fragments: f64,
    /// lf: pairs of a light and a pixel.
    pub light_fragments: f64,
    /// of_band: floats of an object fragment (textures, interpolants).
    pub object_fragment_traffic: f64,
    /// lf_band: floats of a light as a fragment reads it.
    pub light_fragment_traffic: f64,
    /// eq_proc: one evaluation of the illumination model.
    pub evaluation: f64,
    /// p: pixels.
    pub pixels: f64,
    /// t: tiles of the image.
    pub tiles: f64,
    /// t in lf/t: pixels that share one list of lights.
    pub pixels_a_tile: f64,
    /// sspp: most shading samples a pixel; vspp, visibility samples, as well.
    pub shading_samples: f64,
    /// sspe: shading samples that a pixel is expected to need: the surfaces that show in it.
    pub expected_samples: f64,
    /// memll: floats of light lists.
    pub light_list_floats: f64,
    /// lcp: share of light-pixel pairs that culling removes.
    pub light_culling: f64,
    /// sort_cost.
    pub sort: f64,
}

impl Default for Workload {
    /// Zero counts; unit costs, the traffic of this project's vertex (10 floats), light (16) and surface (18: interpolants
    /// and three texture samples), one shading sample.
    fn default() -> Self {
        Self {
            objects: 0.0,
            lights: 0.0,
            object_command: 1.0,
            light_command: 1.0,
            tile_command: 1.0,
            object_vertices: 0.0,
            light_vertices: 0.0,
            object_vertex_processing: 1.0,
            light_vertex_processing: 1.0,
            object_vertex_traffic: 10.0,
            light_vertex_traffic: 3.0,
            object_fragments: 0.0,
            light_fragments: 0.0,
            object_fragment_traffic: 18.0,
            light_fragment_traffic: 16.0,
            evaluation: 1.0,
            pixels: 0.0,
            tiles: 0.0,
            pixels_a_tile: 256.0,
            shading_samples: 1.0,
            expected_samples: 1.0,
            light_list_floats: 0.0,
            light_culling: 0.0,
            sort: 0.0,
        }
    }
}

/// The four costs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Cost {
    /// K_cmd: GPU commands.
    pub cmd: f64,
    /// K_proc: processing.
    pub proc: f64,
    /// K_mem: allocated memory, floats.
    pub mem: f64,
    /// K_band: floats read or written.
    pub band: f64,
}

impl Workload {
    fn vertices(&self) -> f64 {
        self.object_vertices * self.object_vertex_processing
    }
    fn light_volumes(&self) -> f64 {
        self.light_vertices * self.light_vertex_processing
    }
    fn vertex_traffic(&self) -> f64 {
        self.object_vertices * self.object_vertex_traffic
    }
    fn volume_traffic(&self) -> f64 {
        self.light_vertices * self.light_vertex_traffic
    }
}

/// F, section 4.1: `pass` = lights that one draw applies: all (a loop in the shader: one draw an object) or one.
pub fn forward(w: &Workload, draws_per_object: f64) -> Cost {
    Cost {
        cmd: w.objects * draws_per_object * w.object_command,
        proc: w.vertices() + w.object_fragments * w.lights * w.evaluation,
        mem: 0.0,
        band: w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 2.0),
    }
}

/// DPP, section 4.2, the second pass a loop over the lights.
pub fn depth_prepass(w: &Workload) -> Cost {
    Cost {
        cmd: 2.0 * w.objects * w.object_command,
        proc: w.vertices() + (w.vertices() + w.pixels * w.lights * w.evaluation),
        mem: 0.0,
        band: (w.vertex_traffic() + w.object_fragments)
            + (w.vertex_traffic() + w.pixels * (w.object_fragment_traffic + 2.0)),
    }
}

/// D, section 4.3.
pub fn deferred(w: &Workload) -> Cost {
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + (w.light_volumes() + w.light_fragments * w.evaluation),
        mem: 4.0 * w.pixels,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0))
            + (w.volume_traffic() + w.light_fragments * (w.light_fragment_traffic + 3.0))
            + 3.0 * w.pixels,
    }
}

/// LPP, section 4.5.
pub fn light_prepass(w: &Workload) -> Cost {
    Cost {
        cmd: 2.0 * w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + (w.light_volumes() + w.light_fragments * w.evaluation) + w.vertices(),
        mem: 3.0 * w.pixels,
        band: (w.vertex_traffic() + 2.0 * w.object_fragments)
            + (w.volume_traffic() + w.light_fragments * (w.light_fragment_traffic + 3.0))
            + (w.vertex_traffic() + w.pixels * (w.object_fragment_traffic + 2.0)),
    }
}

/// The project's own, for the hybrid that section 4.5 names without a formula: a share of the objects (and of their vertices,
/// fragments and pixels) goes through LPP, the others through D. Its memory is D's: LPP's floats are among them.
pub fn hybrid(w: &Workload, prepass_share: f64) -> Cost {
    let (prepass, deferred) = (prepass_share, 1.0 - prepass_share);
    Cost {
        cmd: (1.0 + prepass) * w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + (w.light_volumes() + w.light_fragments * w.evaluation) + prepass * w.vertices(),
        mem: 4.0 * w.pixels,
        band: (w.vertex_traffic()
            + w.object_fragments * (deferred * (w.object_fragment_traffic + 3.0) + prepass * 2.0))
            + (w.volume_traffic() + w.light_fragments * (w.light_fragment_traffic + 3.0))
            + (prepass * (w.vertex_traffic() + w.pixels * (w.object_fragment_traffic + 2.0))
                + deferred * 3.0 * w.pixels),
    }
}

/// DAA, section 4.4.
pub fn deferred_msaa(w: &Workload) -> Cost {
    let s = w.shading_samples;
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + (w.light_volumes() + w.light_fragments * s * w.evaluation),
        mem: 4.0 * w.pixels * s,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0) * s)
            + (w.volume_traffic() + w.light_fragments * s * (w.light_fragment_traffic + 3.0))
            + 3.0 * w.pixels * s,
    }
}

/// The project's own: DAA with five floats a sample (Schied and Dachsbacher 2015, section 5), of which each is read once and
/// only those of different triangles are shaded. No light volumes.
pub fn deferred_dedup(w: &Workload) -> Cost {
    let (stored, shaded) = (w.shading_samples, w.expected_samples);
    Cost {
        cmd: w.objects * w.object_command,
        proc: w.vertices() + w.light_fragments * shaded * w.evaluation,
        mem: 5.0 * w.pixels * stored,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 5.0 * stored))
            + w.light_fragments * shaded * w.light_fragment_traffic
            + 5.0 * w.pixels * stored,
    }
}

/// The project's own: per-pixel lists (Fridvalszky and Tóth 2020). Depth (and triangle IDs, where compute fills the lists) at
/// all samples, blocks of 3.5 floats for what shows alone.
pub fn gbuffer_list(w: &Workload, fill_in_compute: bool) -> Cost {
    let (stored, shaded) = (w.shading_samples, w.expected_samples);
    let floats_a_sample = if fill_in_compute { 2.0 } else { 1.0 };
    let blocks = 3.5 * w.pixels * shaded;
    let passes = if fill_in_compute { 1.0 } else { 2.0 };
    Cost {
        cmd: passes * w.objects * w.object_command,
        proc: passes * w.vertices() + w.light_fragments * shaded * w.evaluation,
        mem: floats_a_sample * w.pixels * stored + blocks,
        band: passes * w.vertex_traffic()
            + w.object_fragments * floats_a_sample * stored
            + w.pixels * (floats_a_sample * stored + shaded * w.object_fragment_traffic)
            + 2.0 * blocks
            + w.light_fragments * shaded * w.light_fragment_traffic,
    }
}

/// The project's own: DAIS (Schied and Dachsbacher 2015) with the triangle buffer filled from the visibility buffer. Two floats
/// a sample, depth and a triangle's name, written and read twice; twenty floats for each triangle that shows, at most all
/// of them and at most one a pixel and surface, written once and read for every surface.
pub fn dais(w: &Workload) -> Cost {
    let (stored, shaded) = (w.shading_samples, w.expected_samples);
    let triangles = (w.object_vertices / 3.0).min(w.pixels * shaded);
    Cost {
        cmd: w.objects * w.object_command,
        proc: 2.0 * w.vertices() + w.light_fragments * shaded * w.evaluation,
        mem: 2.0 * w.pixels * stored + 20.0 * triangles,
        band: 2.0 * w.vertex_traffic()
            + 2.0 * w.object_fragments * stored
            + 2.0 * w.pixels * stored
            + 20.0 * triangles
            + w.pixels * shaded * (20.0 + w.object_fragment_traffic)
            + w.light_fragments * shaded * w.light_fragment_traffic,
    }
}

/// The project's own: [`dais`] with the triangle buffer filled by fragments: the scene is drawn twice, and what shows alone writes
/// a triangle's name.
pub fn dais_cached(w: &Workload) -> Cost {
    let once = dais(w);
    Cost {
        cmd: 2.0 * once.cmd,
        proc: once.proc + w.vertices(),
        mem: once.mem,
        band: once.band + w.vertex_traffic() + (w.pixels - w.object_fragments) * w.shading_samples,
    }
}

/// The project's own: [`dais`] with a float a sample (depth), a float a pixel (the head) and two a surface where a pixel shows
/// several; the scene is drawn twice.
pub fn dais_list(w: &Workload) -> Cost {
    let (stored, shaded) = (w.shading_samples, w.expected_samples);
    let triangles = (w.object_vertices / 3.0).min(w.pixels * shaded);
    let lists = w.pixels * (1.0 + 2.0 * (shaded - 1.0).max(0.0));
    Cost {
        cmd: 2.0 * w.objects * w.object_command,
        proc: 3.0 * w.vertices() + w.light_fragments * shaded * w.evaluation,
        mem: w.pixels * stored + lists + 20.0 * triangles,
        band: 3.0 * w.vertex_traffic()
            + w.object_fragments * stored
            + w.pixels * stored
            + 2.0 * lists
            + 20.0 * triangles
            + w.pixels * shaded * (20.0 + w.object_fragment_traffic)
            + w.light_fragments * shaded * w.light_fragment_traffic,
    }
}

/// TD, section 4.8.
pub fn tiled_deferred(w: &Workload) -> Cost {
    let shared = w.light_fragments / w.pixels_a_tile;
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + w.light_volumes() + w.light_fragments * w.evaluation,
        mem: 3.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0))
            + (w.volume_traffic() + shared)
            + (shared * w.light_fragment_traffic + 4.0 * w.pixels),
    }
}

/// TF, section 4.8.
pub fn tiled_forward(w: &Workload) -> Cost {
    let shared = w.light_fragments / w.pixels_a_tile;
    Cost {
        cmd: 2.0 * w.objects * w.object_command + w.lights * w.light_command,
        proc: 2.0 * w.vertices() + w.light_volumes() + w.light_fragments * w.evaluation,
        mem: 2.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + 2.0 * w.object_fragments)
            + (w.volume_traffic() + shared)
            + (w.vertex_traffic()
                + w.pixels * w.object_fragment_traffic
                + w.light_fragment_traffic * shared
                + 2.0 * w.pixels),
    }
}

/// F+, section 4.9.
pub fn forward_plus(w: &Workload) -> Cost {
    let shading = w.light_fragments * (1.0 - w.light_culling);
    let shared = shading / w.pixels_a_tile;
    Cost {
        cmd: 2.0 * w.objects * w.object_command + w.lights * w.light_command,
        proc: 2.0 * w.vertices() + w.light_volumes() + shading * w.evaluation,
        mem: 3.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + w.object_fragments)
            + (w.volume_traffic() + shared)
            + (w.vertex_traffic()
                + w.pixels * w.object_fragment_traffic
                + w.light_fragment_traffic * shared
                + w.pixels),
    }
}

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

/// LLiD, section 4.7.
pub fn light_list(w: &Workload) -> Cost {
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command,
        proc: w.vertices() + w.light_volumes() + w.light_fragments * w.evaluation,
        mem: 3.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + w.object_fragments * (w.object_fragment_traffic + 3.0))
            + (w.volume_traffic() + w.light_fragments)
            + (w.light_fragments * w.light_fragment_traffic + 4.0 * w.pixels),
    }
}

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

/// D++, section 4.11. The paper numbers two terms 3; the second is pass 4.
pub fn visibility_buffer(w: &Workload) -> Cost {
    let shared = w.light_fragments / w.pixels_a_tile * (1.0 - w.light_culling);
    let vertices_a_tile = if w.tiles > 0.0 { w.object_vertices / w.tiles } else { 0.0 };
    Cost {
        cmd: w.objects * w.object_command + w.lights * w.light_command + w.tiles * w.tile_command,
        proc: w.vertices()
            + w.sort
            + w.light_volumes()
            + (vertices_a_tile * w.object_vertex_processing
                + w.light_fragments * (1.0 - w.light_culling) * w.evaluation),
        mem: 3.0 * w.pixels + w.light_list_floats,
        band: (w.vertex_traffic() + 2.0 * w.object_fragments)
            + 2.0 * w.tiles
            + (w.volume_traffic() + shared)
            + (vertices_a_tile * w.object_vertex_traffic
                + w.pixels * w.object_fragment_traffic
                + w.light_fragment_traffic * shared
                + w.pixels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn workload() -> Workload {
        Workload {
            objects: 10.0,
            lights: 3.0,
            object_vertices: 100.0,
            object_fragments: 50.0,
            light_fragments: 20.0,
            light_vertices: 24.0,
            pixels: 40.0,
            tiles: 2.0,
            pixels_a_tile: 20.0,
            object_vertex_traffic: 2.0,
            light_vertex_traffic: 1.0,
            object_fragment_traffic: 5.0,
            light_fragment_traffic: 7.0,
            ..Workload::default()
        }
    }

    /// Worked by hand from the paper's formulas.
    #[test]
    fn formulas_give_the_papers_terms() {
        let w = workload();
        assert_eq!(forward(&w, 3.0), Cost { cmd: 30.0, proc: 250.0, mem: 0.0, band: 550.0 });
        assert_eq!(depth_prepass(&w), Cost { cmd: 20.0, proc: 320.0, mem: 0.0, band: 730.0 });
        assert_eq!(deferred(&w), Cost { cmd: 13.0, proc: 144.0, mem: 160.0, band: 600.0 + 224.0 + 120.0 });
        assert_eq!(
            light_prepass(&w),
            Cost { cmd: 23.0, proc: 100.0 + 44.0 + 100.0, mem: 120.0, band: 300.0 + 224.0 + 480.0 }
        );
        // A quarter of 10 objects twice; 50 fragments × (0.75 × 8 + 0.25 × 2); 0.25 × (200 + 40 × 7) + 0.75 × 120.
        assert_eq!(
            hybrid(&w, 0.25),
            Cost {
                cmd: 15.5,
                proc: 144.0 + 25.0,
                mem: 160.0,
                band: (200.0 + 325.0) + 224.0 + (120.0 + 90.0)
            }
        );
        assert_eq!(hybrid(&w, 0.0), deferred(&w));
        assert_eq!(hybrid(&w, 1.0), Cost { mem: 160.0, ..light_prepass(&w) });
        assert_eq!(
            tiled_deferred(&w),
            Cost { cmd: 13.0, proc: 144.0, mem: 120.0, band: 600.0 + 25.0 + 167.0 }
        );
        assert_eq!(
            tiled_forward(&w),
            Cost { cmd: 23.0, proc: 244.0, mem: 80.0, band: 300.0 + 25.0 + (200.0 + 200.0 + 7.0 + 80.0) }
        );
        // Of 20 pairs 10 are left, 5 pixels share a list.
        let half = Workload { light_culling: 0.5, ..w };
        assert_eq!(
            forward_plus(&Workload { pixels_a_tile: 5.0, ..half }),
            Cost { cmd: 23.0, proc: 234.0, mem: 120.0, band: 250.0 + 26.0 + (200.0 + 200.0 + 14.0 + 40.0) }
        );
        assert_eq!(
            clustered_deferred(&half, 5.0),
            Cost { cmd: 13.0, proc: 134.0, mem: 120.0, band: 600.0 + 26.0 + (14.0 + 160.0) }
        );
        assert_eq!(
            clustered_forward(&half, 5.0),
            Cost { cmd: 23.0, proc: 234.0, mem: 80.0, band: 350.0 + 26.0 + (200.0 + 200.0 + 14.0 + 40.0) }
        );
        let lists = Workload { light_list_floats: 80.0, ..w };
        assert_eq!(
            light_list(&lists),
            Cost { cmd: 13.0, proc: 144.0, mem: 120.0 + 80.0, band: 600.0 + 44.0 + 300.0 }
        );
        // A list a pixel is a tile of one pixel.
        let tile_a_pixel = Workload { pixels_a_tile: 1.0, ..lists };
        assert_eq!(light_list(&lists), tiled_deferred(&tile_a_pixel));
        assert_eq!(
            light_list_forward(&lists),
            Cost { cmd: 23.0, proc: 244.0, mem: 40.0 + 80.0, band: 250.0 + 44.0 + 620.0 }
        );
        assert_eq!(
            light_indexed(&w, 1.0),
            Cost { cmd: 13.0, proc: 124.0 + 160.0, mem: 160.0, band: 600.0 + 24.0 + 640.0 }
        );
        assert_eq!(
            light_indexed_forward(&w, 2.0),
            Cost { cmd: 23.0, proc: 224.0 + 160.0, mem: 120.0, band: 250.0 + 24.0 + (480.0 + 580.0) }
        );
        let four = Workload { shading_samples: 4.0, expected_samples: 1.5, ..w };
        assert_eq!(
            deferred_msaa(&four),
            Cost {
                cmd: 13.0,
                proc: 100.0 + 24.0 + 80.0 * 1.0,
                mem: 640.0,
                band: 200.0 + 1600.0 + 24.0 + 800.0 + 480.0
            }
        );
        assert_eq!(
            deferred_dedup(&four),
            Cost { cmd: 10.0, proc: 130.0, mem: 800.0, band: 200.0 + 50.0 * 25.0 + 210.0 + 800.0 }
        );
        assert_eq!(
            gbuffer_list(&four, true),
            Cost {
                cmd: 10.0,
                proc: 130.0,
                mem: 320.0 + 210.0,
                band: 200.0 + 400.0 + 40.0 * 15.5 + 420.0 + 210.0
            }
        );
        let (once, cached) = (dais(&four), dais_cached(&four));
        assert_eq!((cached.cmd, cached.mem), (20.0, once.mem));
        assert_eq!((cached.proc - once.proc, cached.band - once.band), (100.0, 200.0 - 40.0));
        assert_eq!(
            visibility_buffer(&w),
            Cost { cmd: 15.0, proc: 100.0 + 24.0 + 70.0, mem: 120.0, band: 300.0 + 4.0 + 25.0 + 347.0 }
        );
    }
}
