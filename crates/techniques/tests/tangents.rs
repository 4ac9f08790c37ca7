//! Normal maps: one frame at every point of a surface in every technique and in f64, whatever a file says of tangents and texture
//! coordinates.

mod common;

use std::sync::Arc;

use afterlight_oracle::{
    brdf,
    raster::{RayScene, pixel_ray},
};
use afterlight_techniques::{
    Exactness, Params, Settings, exactness_of, find, params_of, registry,
    scene::{
        Aabb, Camera, Image, ImageData, Instance, Light, LightKind, Material, Mesh, MipMode, Node, Sampler,
        Scene, TextureRef, VertexAttributes, rng::SplitMix64,
    },
    shader::Shader,
};
use common::{
    Stage, compiled, compiled_variant, direction, image_of, least_db_of_four_lights, params, psnr, source,
    wider,
};
use glam::{Affine3A, DVec3, Mat3, Quat, Vec2, Vec3};

const SIZE_PX: (u32, u32) = (160, 90);

/// What the tangents and texture coordinates of a scene are like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Case {
    /// Tangents of the file's own, at any angle to the texture coordinates and to the normal.
    Own,
    /// Neither tangents nor texture coordinates.
    None,
    /// Own tangents and texture coordinates that are a point, a line, or nearly one.
    Stretched,
    /// Zero, along the normal and against it.
    Degenerate,
    /// Bitangents of either sign, also within one triangle.
    Signs,
    /// Instances that transforms flatten to a plane, which leaves some tangents no length.
    Flattened,
    /// Instances that transforms mirror and shear.
    Mirrored,
}

const CASES: [Case; 7] =
    [Case::Own, Case::None, Case::Stretched, Case::Degenerate, Case::Signs, Case::Flattened, Case::Mirrored];

/// A vertex beside a face's normal: its own normal within 35 degrees of that, texture coordinates and tangent as the case has them.
fn vertex(rng: &mut SplitMix64, case: Case, face_normal: Vec3, corner: usize) -> VertexAttributes {
    let normal = (face_normal + 0.4 * direction(rng)).normalize();
    let sideways = normal.cross(direction(rng)).normalize_or(normal.any_orthonormal_vector());
    let own = (sideways + 0.2 * direction(rng)).normalize();
    let uv = match case {
        Case::None => Vec2::ZERO,
        Case::Stretched => Vec2::new(corner as f32, 1e-6 * corner as f32),
        _ => Vec2::new(rng.between(-2.0, 2.0), rng.between(-2.0, 2.0)),
    };
    let tangent = match case {
        Case::None => Vec3::ZERO,
        Case::Degenerate => match corner {
            0 => Vec3::ZERO,
            1 => normal,
            _ => -1e-20 * normal,
        },
        // A transform leaves nothing of it.
        Case::Flattened if corner == 0 => Vec3::Z,
        _ => own,
    };
    let sign = match case {
        Case::Signs => rng.between(-1.0, 1.0),
        _ => 1.0,
    };
    VertexAttributes::pack(normal, tangent, sign, uv, Vec2::ZERO, [1.0; 4])
}

/// A transform for the case: a turn, and what the case does to it.
fn transform(rng: &mut SplitMix64, case: Case) -> Mat3 {
    let turn = Mat3::from_quat(Quat::from_axis_angle(direction(rng), rng.between(0.0, 3.0)));
    match case {
        Case::Flattened => turn * Mat3::from_diagonal(Vec3::new(1.0, 1.0, 0.0)),
        Case::Mirrored => {
            turn * Mat3::from_cols(
                Vec3::new(-1.2, 0.0, 0.0),
                Vec3::new(0.4, 0.8, 0.0),
                Vec3::new(0.0, 0.3, 1.0),
            )
        }
        _ => turn,
    }
}

/// Meshes of a triangle each around the origin, two-sided, with a normal map of one direction, unit as bytes to 1e-5, so that no filter of textures can
/// tell techniques apart.
fn soup(case: Case, seed: u64) -> Scene {
    const MESHES: u32 = 96;
    const CORNERS: u32 = 3;
    let mut rng = SplitMix64::new(seed);
    let texel = [201u8, 104, 229, 255];
    let image = Image {
        name: "one direction".to_owned(),
        data: ImageData::Rgba8 { width: 4, height: 4, pixels: Arc::from(texel.repeat(16)) },
        width: 4,
        height: 4,
    };
    let normal_texture = TextureRef {
        image: 0,
        // The f64 twin has the finest level alone.
        sampler: Sampler { mip: MipMode::None, mag_nearest: true, min_nearest: true, ..Sampler::default() },
        uv_set: 0,
        uv_transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    };
    let mut scene = Scene {
        images: vec![image],
        materials: vec![Material {
            double_sided: true,
            roughness_factor: 0.5,
            metallic_factor: 0.2,
            normal_texture: Some(normal_texture),
            ..Material::default()
        }],
        ..Scene::default()
    };
    for mesh in 0..MESHES {
        let mut bounds_os = Aabb::EMPTY;
        let corners = [0, 1, 2].map(|_| 1.5 * direction(&mut rng));
        let face = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(Vec3::Z);
        for (corner, position) in corners.into_iter().enumerate() {
            bounds_os.extend(position);
            scene.positions_os.push(position.to_array());
            scene.attributes.push(vertex(&mut rng, case, face, corner));
        }
        let place = Vec3::new(rng.between(-4.0, 4.0), rng.between(-2.0, 2.0), rng.between(-4.0, 4.0));
        scene.instances.push(Instance {
            mesh,
            node: 0,
            world_from_object: Affine3A::from_mat3_translation(transform(&mut rng, case), place),
        });
        scene.meshes.push(Mesh {
            name: String::new(),
            first_index: 0,
            index_count: CORNERS,
            first_vertex: mesh * CORNERS,
            vertex_count: CORNERS,
            material: 0,
            bounds_os,
        });
    }
    scene.indices = (0..CORNERS).collect();
    scene.nodes = vec![Node { name: String::new(), parent: None, local: glam::DAffine3::IDENTITY }];
    scene
}

/// A view from anywhere around the scene or within it.
fn view(stage: &Stage, seed: u64, samples: u32) -> Settings {
    let mut rng = SplitMix64::new(seed ^ 0x9e37);
    let eye = direction(&mut rng) * rng.between(1.0, 8.0);
    let camera = Camera::look_at("random", eye, 2.0 * direction(&mut rng), rng.between(0.5, 1.6), 0.05);
    let mut settings = Settings { samples, ..stage.from(camera, SIZE_PX, 0) };
    settings.lights = (0..4)
        .map(|_| Light {
            kind: LightKind::Point,
            position_ws: 6.0 * direction(&mut rng),
            direction_ws: Vec3::NEG_Y,
            intensity: Vec3::splat(rng.between(10.0, 40.0)),
            range_m: 20.0,
        })
        .collect();
    settings
}

/// Every technique shades the frame that `forward` shades, from views at random.
#[test]
fn frames_are_one_in_every_technique() {
    let gpu = afterlight_testkit::gpu();
    for (case, seed) in CASES.into_iter().zip(1..) {
        let stage = Stage::of(&gpu, soup(case, seed));
        for samples in [1, 4] {
            let settings = view(&stage, seed, samples);
            let reference = stage.image(find("forward").unwrap(), &settings);
            for technique in registry().iter().filter(|t| t.info().samples.contains(&samples)) {
                let db = psnr(&reference, &stage.image(*technique, &settings));
                let id = technique.info().id;
                println!("{case:?}, {samples} samples: {id}: {db:.2} dB");
                let least = least_db_of_four_lights(*technique, &Params::default(), samples);
                assert!(db >= least, "{case:?}, {samples} samples: {id}: {db:.2} dB");
            }
        }
    }
}

/// What f64 shades in each pixel whose neighbours show the same instance, with each of some sets of lights.
fn shaded_in_f64(stage: &Stage, settings: &Settings, lights: [&[Light]; 2]) -> Vec<Option<[DVec3; 2]>> {
    let size = [SIZE_PX.0, SIZE_PX.1];
    let rays = RayScene::new(&stage.scene);
    let ray_of = |at| pixel_ray(&settings.camera, at, size);
    let shown: Vec<_> =
        (0..size[0] * size[1]).map(|i| rays.first_hit(&ray_of([i % size[0], i / size[0]]))).collect();
    let instance = |x: u32, y: u32| shown[(y * size[0] + x) as usize].map(|hit| hit.instance);
    let ambient = settings.environment.ambient_radiance.as_dvec3();
    let shaded = |i: u32| {
        let (x, y) = (i % size[0], i / size[0]);
        let inside = (1..size[0] - 1).contains(&x) && (1..size[1] - 1).contains(&y);
        let hit = shown[i as usize].filter(|_| inside)?;
        let around = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
        if around.iter().any(|(x, y)| instance(*x, *y) != Some(hit.instance)) {
            return None;
        }
        let (surface, to_eye) = (rays.surface(&hit), -ray_of([x, y]).direction_ws.normalize());
        Some(lights.map(|lights| brdf::shade(&surface, to_eye, lights, ambient)))
    };
    (0..size[0] * size[1]).map(shaded).collect()
}

/// Largest relative error of an image's radiance to what f64 shades with the first and with the second lights.
fn errors_to_f64(image: &[[f32; 4]], expected: &[Option<[DVec3; 2]>]) -> [f64; 2] {
    let pixels = image.iter().zip(expected).filter_map(|(pixel, expected)| Some((pixel, (*expected)?)));
    pixels.fold([0.0; 2], |worst, (pixel, expected)| {
        let found = DVec3::new(pixel[0].into(), pixel[1].into(), pixel[2].into());
        [0, 1].map(|i| {
            let error = (found - expected[i]).abs().max_element() / (expected[i].max_element() + 0.05);
            // A radiance that is no number is as wrong as can be.
            if error.is_nan() { f64::INFINITY } else { worst[i].max(error) }
        })
    })
}

/// `forward` shades the frame that f64 finds.
#[test]
fn frames_are_those_of_f64() {
    let gpu = afterlight_testkit::gpu();
    for (case, seed) in CASES.into_iter().zip(1..) {
        let stage = Stage::of(&gpu, soup(case, seed));
        let settings = view(&stage, seed, 1);
        let wider = wider(&settings.lights, 1.05);
        let expected = shaded_in_f64(&stage, &settings, [&settings.lights, &wider]);
        let compared = expected.iter().flatten().count();
        for id in ["forward", "visibility", "dais"] {
            let image = stage.radiance(find(id).unwrap(), &settings);
            let [error, mutant] = errors_to_f64(&image, &expected);
            println!("{case:?}: {id}: {compared} pixels, relative error {error:.5}, mutant {mutant:.5}");
            assert!(compared > 1000, "{case:?}: {compared} pixels compared");
            assert!(error < F64_BOUND, "{case:?}: {id}: relative error {error}");
            assert!(mutant > F64_BOUND, "{case:?}: {id}: ranges larger by five percent go unseen");
        }
    }
}

/// Largest relative error to f64: measured on lavapipe 0.0012, see the lines above; RGBA16F rounds to 0.0005.
const F64_BOUND: f64 = 0.002;

/// Tangents by derivatives are another image wherever tangents are not those of the triangle's own texture coordinates, within the bound
/// that is told; where there are no texture coordinates they fall back to the frame that all have.
#[test]
fn tangents_by_derivatives_are_an_approximation() {
    let gpu = afterlight_testkit::gpu();
    for (case, seed) in CASES.into_iter().zip(1..) {
        let stage = Stage::of(&gpu, soup(case, seed));
        let views = [1, 4].map(|samples| {
            let settings = view(&stage, seed, samples);
            (stage.image(find("forward").unwrap(), &settings), settings)
        });
        for (id, samples) in [("dais", 1), ("dais", 4), ("dais-list", 4), ("dais-multirate", 1)] {
            let (reference, settings) = &views[usize::from(samples > 1)];
            let technique = find(id).unwrap();
            let params = params(technique, &[("tangents", "derivatives")]);
            let Exactness::Approximate { min_psnr_db, bound } = exactness_of(technique, &params, samples)
            else {
                panic!("{id}: tangents by derivatives are told to be exact");
            };
            let db = psnr(reference, &image_of(&mut stage.prepare_with(technique, settings, &params)));
            println!("{case:?}, {samples} samples: {id}: {db:.2} dB");
            assert!(db >= min_psnr_db, "{case:?}, {samples} samples: {id}: {db:.2} dB: {bound}");
            // Neither tangents nor texture coordinates: both ways take the frame that all have.
            assert_eq!(case == Case::None, db >= 40.0, "{case:?}, {samples} samples: {id}: {db:.2} dB");
        }
    }
}

/// Gives each triangle its own normal and the tangent of its texture coordinates, of set 0 or 1, of which the other is at random.
fn with_faces_tangents(mut scene: Scene, uv_set: u32) -> Scene {
    let mut rng = SplitMix64::new(11);
    for (positions, attributes) in
        scene.positions_os.as_chunks::<3>().0.iter().zip(scene.attributes.as_chunks_mut::<3>().0)
    {
        let [a, b, c] = positions.map(Vec3::from);
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
        let uv = [0, 1, 2].map(|_| Vec2::new(rng.between(-2.0, 2.0), rng.between(-2.0, 2.0)));
        let (ab, ac) = (uv[1] - uv[0], uv[2] - uv[0]);
        let area = ab.perp_dot(ac);
        let tangent = (ac.y * (b - a) - ab.y * (c - a)) * area.signum();
        // In glTF v runs downwards, the bitangent upwards.
        let sign = -area.signum();
        for (vertex, uv) in attributes.iter_mut().zip(uv) {
            let other = Vec2::new(rng.between(-2.0, 2.0), rng.between(-2.0, 2.0));
            let [uv0, uv1] = if uv_set == 0 { [uv, other] } else { [other, uv] };
            *vertex = VertexAttributes::pack(normal, tangent, sign, uv0, uv1, [1.0; 4]);
        }
    }
    if let Some(texture) = &mut scene.materials[0].normal_texture {
        texture.uv_set = uv_set;
    }
    scene
}

/// Where tangents are those of the triangles' texture coordinates, mirrored ones among them and of either set, derivatives find them.
#[test]
fn derivatives_find_the_tangents_of_texture_coordinates() {
    let gpu = afterlight_testkit::gpu();
    for uv_set in [0, 1] {
        let stage = Stage::of(&gpu, with_faces_tangents(soup(Case::Mirrored, 21), uv_set));
        let settings = view(&stage, 21, 1);
        let reference = stage.image(find("forward").unwrap(), &settings);
        let dais = find("dais").unwrap();
        for way in ["vertices", "derivatives"] {
            let params = params(dais, &[("tangents", way)]);
            let db = psnr(&reference, &image_of(&mut stage.prepare_with(dais, &settings, &params)));
            println!("set {uv_set}, {way}: {db:.2} dB");
            assert!(db >= 45.0, "set {uv_set}, {way}: {db:.2} dB");
        }
    }
}

/// A technique's PSNR to `forward` with one of its shaders changed.
fn changed(stage: &Stage, settings: &Settings, id: &str, shader: Shader) -> f64 {
    let technique = find(id).unwrap();
    let reference = stage.image(find("forward").unwrap(), settings);
    let mut prepared = stage.prepare_shaders(technique, settings, &params_of(technique), [shader]);
    psnr(&reference, &image_of(&mut prepared))
}

/// Another fallback frame, or none, in one of the techniques is seen; so are tangents of vertices that records mix up.
#[test]
fn other_frames_are_caught() {
    let gpu = afterlight_testkit::gpu();
    let header = "scene.glsl";
    let visibility = "visibility/shade.comp";
    let record = "surfaces/triangles/derivatives.comp";
    let other_axis =
        ("? vec3(1.0, 0.0, 0.0) : vec3(0.0, 0.0, 1.0)", "? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0)");
    let none = ("world = fallback_tangent(normal_ws);", "");
    let mixed = ("load_tangent(d, a[i], t.normal_ws[i])", "load_tangent(d, a[0], t.normal_ws[i])");
    let mutants = [
        (Case::Flattened, "visibility", compiled_variant(visibility, header, &[other_axis])),
        (Case::Flattened, "visibility", compiled_variant(visibility, header, &[none])),
        (Case::Flattened, "dais", compiled_variant(record, header, &[other_axis])),
        (Case::Flattened, "dais", compiled_variant(record, header, &[none])),
        (
            Case::Own,
            "dais",
            compiled(record, &source("surfaces/triangles/derivatives.comp.glsl"), &[], &[mixed]),
        ),
    ];
    for (number, (case, id, shader)) in mutants.into_iter().enumerate() {
        let seed = 1 + CASES.iter().position(|known| *known == case).expect("a case") as u64;
        let stage = Stage::of(&gpu, soup(case, seed));
        let db = changed(&stage, &view(&stage, seed, 1), id, shader);
        println!("mutant {number}: {case:?}, {id}: {db:.2} dB");
        assert!(db < 45.0, "mutant {number}: {case:?}, {id}: within the bound: {db:.2} dB");
    }
}

/// Bytes of a record by the scene and the parameter, and room for no more than what shows.
#[test]
fn records_take_the_bytes_that_are_told() {
    let gpu = afterlight_testkit::gpu();
    let bytes = |scene: Scene, sets: &[(&str, &str)], edge_px: Option<f32>| {
        let stage = Stage::of(&gpu, scene);
        let settings = view(&stage, 1, 1).with_effects(|effects| effects.tessellation.edge_px = edge_px);
        let technique = find("dais").unwrap();
        let mut prepared = stage.prepare_with(technique, &settings, &params(technique, sets));
        let counters = prepared.counters().unwrap_or_else(|e| panic!("{e}"));
        let room = counters.iter().find(|counter| counter.name == "triangles").expect("counted").capacity;
        let resources = &prepared.executor().plan().resources;
        let buffer =
            resources.iter().find(|one| one.name == "dais/triangle buffer").expect("a triangle buffer");
        buffer.need.bytes / u64::from(room)
    };
    let plain = || {
        let mut scene = soup(Case::Own, 1);
        scene.materials[0].normal_texture = None;
        scene
    };
    let both_sets = || {
        let mut scene = soup(Case::Own, 1);
        scene.materials[0].base_color_texture =
            scene.materials[0].normal_texture.map(|t| TextureRef { uv_set: 1, ..t });
        scene.attributes[0].color_rgba8 = 0xff00_00ff;
        scene
    };
    let derivatives = [("tangents", "derivatives")];
    assert_eq!(bytes(soup(Case::Own, 1), &[], None), 92);
    assert_eq!(bytes(soup(Case::Own, 1), &derivatives, None), 80);
    assert_eq!(bytes(plain(), &[], None), 80);
    assert_eq!(bytes(both_sets(), &[], None), 92 + 24 + 48);
    assert_eq!(bytes(both_sets(), &derivatives, None), 80 + 24 + 48);
    if afterlight_testkit::has_tessellation(&gpu) {
        assert_eq!(bytes(soup(Case::Own, 1), &[], Some(16.0)), 108);
        assert_eq!(bytes(plain(), &[], Some(16.0)), 80);
    }
}
