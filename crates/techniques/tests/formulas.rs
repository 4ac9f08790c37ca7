//! The formulas of the cost model, worked by hand.

use afterlight_techniques::clustered::cost::clustered_deferred;
use afterlight_techniques::clustered_forward::cost::clustered_forward;
use afterlight_techniques::cost::{Cost, Workload};
use afterlight_techniques::dais::cost::{dais, dais_cached};
use afterlight_techniques::deferred::cost::deferred;
use afterlight_techniques::deferred_dedup::cost::deferred_dedup;
use afterlight_techniques::deferred_msaa::cost::deferred_msaa;
use afterlight_techniques::depth_prepass::cost::depth_prepass;
use afterlight_techniques::forward::cost::forward;
use afterlight_techniques::forward_plus::cost::forward_plus;
use afterlight_techniques::gbuffer_list::cost::gbuffer_list;
use afterlight_techniques::hybrid::cost::hybrid;
use afterlight_techniques::light_indexed::cost::light_indexed;
use afterlight_techniques::light_indexed_forward::cost::light_indexed_forward;
use afterlight_techniques::light_list::cost::light_list;
use afterlight_techniques::light_list_forward::cost::light_list_forward;
use afterlight_techniques::light_prepass::cost::light_prepass;
use afterlight_techniques::tiled::cost::tiled_deferred;
use afterlight_techniques::tiled_forward::cost::tiled_forward;
use afterlight_techniques::visibility::cost::visibility_buffer;

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

/// A workload whose symbols are different primes, so that no symbol can stand for another.
fn primes() -> Workload {
    Workload {
        objects: 11.0,
        lights: 3.0,
        object_command: 13.0,
        light_command: 17.0,
        object_vertices: 101.0,
        object_vertex_processing: 5.0,
        object_vertex_traffic: 7.0,
        object_fragments: 53.0,
        object_fragment_traffic: 19.0,
        evaluation: 23.0,
        pixels: 41.0,
        ..workload()
    }
}

/// DPP as section 4.2 of the paper prints it, a term a pass: nothing of it is taken from our formula.
fn depth_prepass_of_the_paper(w: &Workload) -> Cost {
    let vertices = w.object_vertices * w.object_vertex_processing;
    let vertex_traffic = w.object_vertices * w.object_vertex_traffic;
    Cost {
        cmd: w.objects * w.object_command + w.objects * w.lights * w.object_command,
        proc: vertices + (vertices + w.pixels * w.evaluation),
        mem: 0.0,
        band: (vertex_traffic + w.pixels * (w.object_fragment_traffic + 2.0))
            + (vertex_traffic + w.object_fragments),
    }
}

/// The paper draws the objects once for each light of its second pass, `depth-prepass` once for all: at one light both are one formula; with more,
/// ours has as many draws fewer, and as many evaluations a pixel more.
#[test]
fn depth_prepass_is_the_papers_but_for_its_loop_over_the_lights() {
    // By hand: 10 + 10·3; 100 + 100 + 40; 0; (200 + 40·7) + (200 + 50).
    assert_eq!(
        depth_prepass_of_the_paper(&workload()),
        Cost { cmd: 40.0, proc: 240.0, mem: 0.0, band: 480.0 + 250.0 }
    );
    let w = primes();
    let one = Workload { lights: 1.0, ..w };
    assert_eq!(depth_prepass(&one), depth_prepass_of_the_paper(&one));
    let (ours, paper) = (depth_prepass(&w), depth_prepass_of_the_paper(&w));
    // 11 objects of 13 for each of two lights; 41 pixels of 23 for each of two.
    assert_eq!((paper.cmd - ours.cmd, ours.proc - paper.proc), (286.0, 1886.0));
    assert_eq!((ours.mem, ours.band), (paper.mem, paper.band));
}

/// Where a formula departs from the paper, the difference is the one that its documentation states.
#[test]
fn departures_from_the_paper_are_those_that_are_stated() {
    let w = workload();
    // LiD: 4p in the paper; the paper's own packing, one float of indices, gives the same.
    assert_eq!(light_indexed(&w, 1.0).mem, 4.0 * w.pixels);
    assert_eq!(light_indexed(&w, 2.0).mem - 4.0 * w.pixels, w.pixels);
    // D++: the two senses of t are two symbols, so that one may change without the other.
    let more_tiles = visibility_buffer(&Workload { tiles: 2.0 * w.tiles, ..w });
    assert_eq!(more_tiles.cmd - visibility_buffer(&w).cmd, w.tiles * w.tile_command);
    let smaller_tiles = visibility_buffer(&Workload { pixels_a_tile: 0.5 * w.pixels_a_tile, ..w });
    assert_eq!(smaller_tiles.cmd, visibility_buffer(&w).cmd);
}

/// Worked by hand from the paper's formulas.
#[test]
fn formulas_give_the_papers_terms() {
    let w = workload();
    assert_eq!(forward(&w, 3.0), Cost { cmd: 30.0, proc: 250.0, mem: 0.0, band: 550.0 });
    assert_eq!(deferred(&w), Cost { cmd: 13.0, proc: 144.0, mem: 160.0, band: 600.0 + 224.0 + 120.0 });
    assert_eq!(
        light_prepass(&w),
        Cost { cmd: 23.0, proc: 100.0 + 44.0 + 100.0, mem: 120.0, band: 300.0 + 224.0 + 480.0 }
    );
    // A quarter of 10 objects twice; 50 fragments × (0.75 × 8 + 0.25 × 2); 0.25 × (200 + 40 × 7) + 0.75 × 120.
    assert_eq!(
        hybrid(&w, 0.25),
        Cost { cmd: 15.5, proc: 144.0 + 25.0, mem: 160.0, band: (200.0 + 325.0) + 224.0 + (120.0 + 90.0) }
    );
    assert_eq!(hybrid(&w, 0.0), deferred(&w));
    assert_eq!(hybrid(&w, 1.0), Cost { mem: 160.0, ..light_prepass(&w) });
    assert_eq!(tiled_deferred(&w), Cost { cmd: 13.0, proc: 144.0, mem: 120.0, band: 600.0 + 25.0 + 167.0 });
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
    let (once, cached) = (dais(&four, 23.0), dais_cached(&four, 23.0));
    assert_eq!((cached.cmd, cached.mem), (20.0, once.mem));
    // Three floats less of each of 100 / 3 triangles, stored once, and of each of 40 pixels' 1.5 surfaces, which read them.
    let derivatives = dais(&four, 20.0);
    assert!((once.mem - derivatives.mem - 100.0).abs() < 1e-9);
    assert!((once.band - derivatives.band - (100.0 + 180.0)).abs() < 1e-9);
    assert_eq!((cached.proc - once.proc, cached.band - once.band), (100.0, 200.0 - 40.0));
    assert_eq!(
        visibility_buffer(&w),
        Cost { cmd: 15.0, proc: 100.0 + 24.0 + 70.0, mem: 120.0, band: 300.0 + 4.0 + 25.0 + 347.0 }
    );
}
