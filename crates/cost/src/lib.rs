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
    /// Processing of all object vertices: ov × ov_proc.
    pub fn vertices(&self) -> f64 {
        self.object_vertices * self.object_vertex_processing
    }
    /// Processing of all vertices of light volumes: lv × lv_proc.
    pub fn light_volumes(&self) -> f64 {
        self.light_vertices * self.light_vertex_processing
    }
    /// Floats of all object vertices: ov × ov_band.
    pub fn vertex_traffic(&self) -> f64 {
        self.object_vertices * self.object_vertex_traffic
    }
    /// Floats of all vertices of light volumes: lv × lv_band.
    pub fn volume_traffic(&self) -> f64 {
        self.light_vertices * self.light_vertex_traffic
    }
}
