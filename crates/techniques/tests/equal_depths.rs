//! Of surfaces that have exactly one depth the first drawn shows, in every technique, however it finds and keeps surfaces.

mod common;

use afterlight_image::Rgba8Image;
use afterlight_stages::surfaces::{RadianceTarget, depth_first::draw_depth, geometry::SceneDraws};
use afterlight_techniques::{
    Frame, Info, Params, SHADERS, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    find,
    graph::{DepthTest, Graph, ImageHandle, Load, PassRole},
    scene::{AlphaMode, Material, Scene},
    shader::Shader,
};
use common::{
    Stage,
    flat::{Draw, scene_of, unlit},
    image_of,
    ways::every_way,
};
use glam::{Quat, Vec3};

const SIZE: (u32, u32) = (97, 55);

/// Colours are stored with eight bits, in some techniques as sRGB, and averaged over the samples of a pixel.
const MOST_OFF: u8 = 2;

/// A colour that differs from those of all other numbers below 343.
fn color(number: usize) -> [u8; 3] {
    [number % 7, number / 7 % 7, number / 49 % 7].map(|part| 40 + 30 * part as u8)
}

/// Triangles that overlap in the plane of z, of various directions.
fn fan(count: usize, first_color: usize, center: Vec3, size_m: f32) -> Draw {
    let triangle = |i: usize| {
        let turn = Quat::from_rotation_z(0.37 * i as f32);
        let corner = |x: f32, y: f32| center + turn * Vec3::new(x, y, 0.0) * size_m;
        ([corner(-1.0, -0.8), corner(1.0, -0.7), corner(0.1, 1.0)], color(5 * (first_color + i)))
    };
    (0..count).map(triangle).collect()
}

/// The same corners in other colours.
fn again(draw: &Draw, first_color: usize) -> Draw {
    let recolored = (first_color..).zip(draw).map(|(i, (corners, _))| (*corners, color(5 * i)));
    recolored.collect()
}

/// Turned out of the plane and before it: corners of equal triangles are equal all the same.
fn tilted(draw: &Draw) -> Draw {
    let turn = Quat::from_rotation_y(0.9) * Quat::from_rotation_x(0.4);
    let place = |corner| turn * corner + Vec3::new(0.1, -0.5, 1.2);
    draw.iter().map(|(corners, color)| (corners.map(place), *color)).collect()
}

/// Coplanar draws that overlap, coplanar triangles of one draw, and copies of tilted draws and triangles.
fn coplanar(material: impl Fn(usize) -> Material) -> Scene {
    let left = Vec3::new(-1.2, 0.2, 0.0);
    let mut draws: Vec<Draw> = (0..6).map(|i| fan(1, i, left + Vec3::X * 0.2 * i as f32, 0.9)).collect();
    draws.push(fan(7, 6, Vec3::new(1.1, 0.1, 0.0), 0.9));
    // Copies alone overlap: where triangles of other corners share a tilted plane rounding decides.
    let apart = |i: usize| fan(1, 13 + i, Vec3::X * (0.7 * i as f32 - 0.7), 0.34);
    let leaning = tilted(&(0..3).flat_map(apart).collect());
    draws.extend([again(&leaning, 16), again(&leaning, 19), leaning.clone()]);
    draws.push(
        [leaning.clone(), again(&leaning, 22), again(&leaning, 25)].concat().into_iter().rev().collect(),
    );
    let draws: Vec<_> = draws.into_iter().enumerate().map(|(i, draw)| (material(i), draw)).collect();
    scene_of(&draws, Vec3::Z * 3.5)
}

/// The scene with its draws, and the triangles of each, in the reverse order.
fn reversed(scene: &Scene) -> Scene {
    let mut reversed = scene.clone();
    reversed.instances.reverse();
    for mesh in &scene.meshes {
        let range = mesh.first_index as usize..(mesh.first_index + mesh.index_count) as usize;
        let triangles: Vec<u32> = scene.indices[range.clone()].chunks(3).rev().flatten().copied().collect();
        reversed.indices[range].copy_from_slice(&triangles);
    }
    reversed
}

/// Pixels of two images that differ by more than rounding.
fn pixels_off(a: &Rgba8Image, b: &Rgba8Image) -> usize {
    let pairs = a.pixels.chunks_exact(4).zip(b.pixels.chunks_exact(4));
    pairs.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > MOST_OFF)).count()
}

/// Asserts that every technique shows what `forward` does, but for those that `excepted` names with their parameters.
fn all_show_the_first(stage: &Stage, what: &str, excepted: impl Fn(&str) -> bool) {
    let forward = find("forward").unwrap();
    let mut wrong = Vec::new();
    for samples in [1, 4] {
        let settings = Settings { samples, ..stage.settings(SIZE, 0) };
        let reference = stage.image(forward, &settings);
        for (technique, params, name) in every_way() {
            if !technique.info().samples.contains(&samples) || excepted(&name) {
                continue;
            }
            let off =
                pixels_off(&reference, &image_of(&mut stage.prepare_with(technique, &settings, &params)));
            println!("{what}, {samples} samples: {name}: {off} pixels");
            if off > 0 {
                wrong.push(format!("{what}, {samples} samples: {name}: {off} pixels"));
            }
        }
    }
    assert!(wrong.is_empty(), "another than the first of equal depths shows:\n{}", wrong.join("\n"));
}

#[test]
fn of_opaque_surfaces() {
    let gpu = afterlight_testkit::gpu();
    for (what, reverse) in [("in order", false), ("in reverse", true)] {
        let scene = coplanar(|_| unlit(AlphaMode::Opaque));
        let stage = Stage::of(&gpu, if reverse { reversed(&scene) } else { scene });
        all_show_the_first(&stage, what, |_| false);
    }
}

/// Coplanar surfaces of other corners, out of parallel to the image: which is nearer is decided by rounding, in the same way wherever the
/// raster part computes depth, and in the same 32 bits.
#[test]
fn of_nearly_equal_depths() {
    let gpu = afterlight_testkit::gpu();
    let draws: Vec<_> = (0..4).map(|i| tilted(&fan(1 + i, 4 * i, Vec3::X * 0.1 * i as f32, 0.9))).collect();
    let draws: Vec<_> = draws.into_iter().map(|draw| (unlit(AlphaMode::Opaque), draw)).collect();
    let stage = Stage::of(&gpu, scene_of(&draws, Vec3::Z * 3.5));
    // Rasterised in compute, or from the upper edge of a band, depth is rounded otherwise.
    let is_rounded_otherwise = |name: &str| {
        name.contains("visibility=compute") || name.starts_with("dais-list") && !name.contains("bands=1")
    };
    all_show_the_first(&stage, "nearly equal", is_rounded_otherwise);
}

/// Masked surfaces, and masked among opaque ones. Where fragments claim samples, which of two masked ones is first is not defined.
#[test]
fn of_masked_surfaces() {
    let gpu = afterlight_testkit::gpu();
    let mask = || unlit(AlphaMode::Mask { cutoff: 0.5 });
    let claims = |name: &str| name.starts_with("dais-list") || name.contains("fill=");
    let all = Stage::of(&gpu, coplanar(|_| mask()));
    all_show_the_first(&all, "masked", claims);
    // Of the draws that share places one alone is masked.
    let one = |i: usize| if i == 2 || i == 8 { mask() } else { unlit(AlphaMode::Opaque) };
    all_show_the_first(&Stage::of(&gpu, coplanar(one)), "masked and opaque", |_| false);
}

/// A mutant: surfaces drawn after a depth pass with an equal test alone, so that the last of equal depths shows.
struct Last;

impl Technique for Last {
    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }
    fn info(&self) -> &Info {
        find("depth-prepass").expect("known").info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let depth = draw_depth(graph, frame, "test")?;
        let shader = "surfaces/depth_first/forward.frag";
        let surfaces = SceneDraws::shaded(frame, shader, &format!("{shader}#mask"))?.depth(DepthTest::EQUAL);
        let target = RadianceTarget::new(graph, frame, "test");
        let mut pass = graph.raster("test/shade", PassRole::Shading);
        frame.bind_scene(&mut pass);
        let radiance = target.attach(frame, &mut pass);
        let _depth = pass.stencil(depth, Load::Keep);
        surfaces.draw(frame, &mut pass);
        pass.finish();
        Ok(radiance)
    }
}

/// The last of equal depths is another picture: of the reference, and of a pass without the stencil
/// bit.
#[test]
fn the_last_of_equal_depths_is_caught() {
    let gpu = afterlight_testkit::gpu();
    let scene = coplanar(|_| unlit(AlphaMode::Opaque));
    let other = Stage::of(&gpu, reversed(&scene));
    let stage = Stage::of(&gpu, scene);
    for samples in [1, 4] {
        let settings = Settings { samples, ..stage.settings(SIZE, 0) };
        let reference = stage.image(find("forward").unwrap(), &settings);
        let off = pixels_off(&reference, &other.image(find("forward").unwrap(), &settings));
        assert!(off > 100, "{samples} samples: the order of draws changes {off} pixels");

        let off = pixels_off(&reference, &stage.image(&Last, &settings));
        assert!(off > 100, "{samples} samples: without the stencil bit {off} pixels differ");
    }
}
