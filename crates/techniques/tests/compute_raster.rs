//! Rasterisation in compute against f64: which triangle each sample shows, and how deep, for triangles that reach far out of the image,
//! behind the eye, and for slivers; and that triangles which share an edge share no sample and leave none out.

mod common;

use std::{collections::BTreeSet, sync::Arc};

use afterlight_image::Rgba8Image;
use afterlight_renderer::Renderer;
use afterlight_stages::surfaces::compute_raster;
use afterlight_techniques::{
    Frame, Info, Params, SHADERS, SceneGpu, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    find,
    graph::{
        BufferRole, Graph, ImageHandle, PassRole,
        gpu::{self, vk},
    },
    params_of, registry,
    scene::{Camera, Material, Projection, Scene, rng::SplitMix64},
    set_param,
    shader::Shader,
};
use common::{Stage, compiled_variant, direction, flat, image_of, params, psnr};
use glam::{DVec2, DVec3, DVec4, Vec3};

/// Half of the spacing of floats at 1.
const U: f64 = 1.0 / 16_777_216.0;
/// Relative error of depth, as `surfaces/compute_raster/README.md` states it.
const DEPTH_ERROR: f64 = 16.0 * U;
/// How far snapping moves a vertex along an axis, pixels.
const SNAP_PX: f64 = 1.0 / 512.0;
/// What floats lose of a vertex's place on the screen, a fraction of its distance to the image's corner.
const SCREEN_ERROR: f64 = 6.0 * U;
/// By how much of the terms that they are sums of clip coordinates may be off: floats of the vertex path, and of clipping.
const CLIP_ERROR: f64 = 4.0 * U;

/// The keys of a view.
struct Keys {
    samples: u32,
    small_px: u32,
}

impl Technique for Keys {
    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }
    fn info(&self) -> &Info {
        find("gbuffer-list").expect("known").info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let keys = compute_raster::rasterize(graph, frame, "test", self.small_px, self.samples)?;
        graph.keep(&keys);
        let radiance = graph.image(
            "test/radiance",
            BufferRole::Targets,
            frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
        );
        Ok(graph.clear_image("test/clear", PassRole::Shading, radiance, [0.0; 4]))
    }
}

/// What a sample shows.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Shown {
    triangle: usize,
    depth: f64,
}

type Triangle = [Vec3; 3];

/// At most 1,024 triangles in world space: one draw, so that a triangle's place in it is its own.
fn scene_of(triangles: &[Triangle], camera: &Camera, double_sided: bool) -> Scene {
    assert!(triangles.len() <= 1024, "{} triangles are more than a draw holds", triangles.len());
    let draw = triangles.iter().map(|triangle| (*triangle, [255; 3])).collect();
    let scene = flat::scene_of(&[(Material { double_sided, ..Material::default() }, draw)], Vec3::Z);
    Scene { cameras: vec![camera.clone()], ..scene }
}

/// A view of triangles.
struct View {
    camera: Camera,
    size_px: (u32, u32),
    samples: u32,
    small_px: u32,
    double_sided: bool,
}

impl View {
    fn new(camera: Camera, size_px: (u32, u32), samples: u32) -> Self {
        Self { camera, size_px, samples, small_px: 16, double_sided: true }
    }

    /// What each sample shows, those of a pixel side by side, rows from the top.
    fn on_device(
        &self,
        device: &gpu::Device,
        triangles: &[Triangle],
        shaders: &[Shader],
    ) -> Vec<Option<Shown>> {
        let scene = scene_of(triangles, &self.camera, self.double_sided);
        let uploaded: Arc<SceneGpu> =
            SceneGpu::upload(device, &scene, &|_, _| {}).unwrap_or_else(|e| panic!("{e}"));
        let mut settings = Settings::for_scene(&scene, self.size_px.0, self.size_px.1);
        settings.camera = self.camera.clone();
        settings.samples = self.samples;
        let mut renderer =
            Renderer::with_scene(device, uploaded, &settings).unwrap_or_else(|e| panic!("{e}"));
        renderer.add_shaders(shaders.iter().cloned());
        let technique = Keys { samples: self.samples, small_px: self.small_px };
        // Preparing runs the frame that has room for all.
        let mut prepared = renderer.prepare(&technique, &Params::default()).unwrap_or_else(|e| panic!("{e}"));
        let bytes = prepared.executor().read_buffer("test/sample keys").unwrap_or_else(|e| panic!("{e}"));
        let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        let shown = |key: &[u8]| {
            let depth = f32::from_bits(word(&key[4..]));
            (depth > 0.0).then(|| Shown { triangle: (!word(key) & 1023) as usize, depth: depth.into() })
        };
        bytes.chunks_exact(8).map(shown).collect()
    }

    /// Where a sample stands, pixels from the image's corner.
    fn place_px(&self, index: usize) -> DVec2 {
        const FOUR: [[f64; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];
        let (pixel, sample) = (index / self.samples as usize, index % self.samples as usize);
        let width = self.size_px.0 as usize;
        let offset = if self.samples == 1 { [0.5; 2] } else { FOUR[sample] };
        DVec2::new((pixel % width) as f64, (pixel / width) as f64) + DVec2::from_array(offset)
    }

    /// The point of the plane y = 0 that a place in pixels shows.
    fn ground_at(&self, place_px: DVec2) -> Option<DVec3> {
        let Projection::Perspective { fov_y_rad, near_m } = self.camera.projection else { return None };
        let half = (0.5 * f64::from(fov_y_rad)).tan();
        let at = (place_px * 2.0 / self.size() - 1.0) * half;
        let world_from_view = self.camera.view_from_world().as_dmat4().inverse();
        let ray =
            world_from_view.transform_vector3(DVec3::new(at.x * self.size().x / self.size().y, -at.y, -1.0));
        let eye = world_from_view.transform_point3(DVec3::ZERO);
        let distance_m = -eye.y / ray.y;
        (distance_m > 1.01 * f64::from(near_m)).then(|| eye + ray * distance_m)
    }

    fn size(&self) -> DVec2 {
        DVec2::new(self.size_px.0.into(), self.size_px.1.into())
    }
}

/// A triangle's clip positions, and the sums of the magnitudes that each coordinate is the sum of.
#[derive(Clone)]
struct Exact {
    clip: [DVec4; 3],
    terms: [DVec4; 3],
    /// How far a vertex may stand off on the screen, pixels.
    off_px: f64,
    /// Whether the whole triangle is in front of the eye and within the guard band.
    is_within: bool,
}

/// The three edge functions at a place in pixels from outside (negative) to inside, as distances in pixels, depth there and its change a
/// pixel.
struct At {
    inside_px: f64,
    depth: f64,
    slope: DVec2,
}

impl Exact {
    fn new(view: &View, triangle: &Triangle) -> Self {
        let aspect = view.size_px.0 as f32 / view.size_px.1 as f32;
        // What the device is given.
        let m = view.camera.clip_from_world(aspect).as_dmat4();
        let clip = triangle.map(|p| m * p.as_dvec3().extend(1.0));
        let terms = triangle.map(|p| {
            let p = p.as_dvec3().abs();
            m.x_axis.abs() * p.x + m.y_axis.abs() * p.y + m.z_axis.abs() * p.z + m.w_axis.abs()
        });
        let half = view.size() * 0.5;
        let from_center = |c: &DVec4| (c.truncate().truncate() / c.w * half).abs().max_element();
        let is_within = clip.iter().all(|c| c.z <= c.w && c.w > 0.0 && from_center(c) <= 32_768.0);
        let reach = clip.iter().filter(|c| c.w > 0.0).map(from_center).fold(0.0, f64::max).min(32_768.0);
        let off_px = SNAP_PX + SCREEN_ERROR * (reach + half.max_element());
        Self { clip, terms, off_px, is_within }
    }

    /// At a place; `None` where the triangle is seen edge-on.
    fn at(clip: &[DVec4; 3], size: DVec2, place_px: DVec2) -> Option<At> {
        let to_px = |c: DVec4| DVec3::new((c.x + c.w) * size.x * 0.5, (c.y + c.w) * size.y * 0.5, c.w);
        let p = clip.map(to_px);
        let normals = [p[1].cross(p[2]), p[2].cross(p[0]), p[0].cross(p[1])];
        let det = p[0].dot(normals[0]);
        let sum = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>();
        let place = place_px.extend(1.0);
        let b = normals.map(|n| n.dot(place) / det);
        let depth = sum(&|i| b[i] * clip[i].z);
        let slope = DVec2::new(sum(&|i| normals[i].x * clip[i].z), sum(&|i| normals[i].y * clip[i].z)) / det;
        // Depth 1 is the near plane: an edge as well.
        let near = (1.0 - depth) / slope.length();
        let edges = (0..3).map(|i| b[i] * det.abs() / normals[i].truncate().length());
        let inside_px = edges.fold(if near.is_nan() { f64::INFINITY } else { near }, f64::min);
        (det != 0.0 && inside_px.is_finite() && depth.is_finite()).then_some(At { inside_px, depth, slope })
    }

    /// Distance to the nearest edge and depth at a sample, and how far each may be off on the device.
    fn judged(&self, view: &View, place_px: DVec2) -> Option<Judged> {
        let at = Self::at(&self.clip, view.size(), place_px)?;
        let (mut inside_off, mut depth_off) = (0.0, 0.0);
        for k in 0..12 {
            let mut moved = self.clip;
            moved[k / 4][k % 4] += CLIP_ERROR * self.terms[k / 4][k % 4];
            let other = Self::at(&moved, view.size(), place_px)?;
            inside_off += (other.inside_px - at.inside_px).abs();
            depth_off += (other.depth - at.depth).abs();
        }
        let of_place = (at.slope.x.abs() + at.slope.y.abs()) * self.off_px;
        Some(Judged {
            inside_px: at.inside_px,
            inside_off_px: std::f64::consts::SQRT_2 * self.off_px + inside_off,
            depth: at.depth,
            depth_off: of_place + DEPTH_ERROR * at.depth.abs() + depth_off,
        })
    }
}

struct Judged {
    inside_px: f64,
    inside_off_px: f64,
    depth: f64,
    depth_off: f64,
}

/// What is wrong with an image.
#[derive(Default, Debug, PartialEq)]
struct Wrong {
    /// Samples that show a triangle which does not cover them.
    outside: usize,
    /// Samples whose depth is not that of the triangle that they show.
    depth: usize,
    /// Samples that show nothing, or something farther, where a triangle surely is.
    missed: usize,
}

/// Compares every sample with every triangle in f64. Also returns how many samples surely show a triangle.
fn judge(view: &View, triangles: &[Triangle], shown: &[Option<Shown>]) -> (Wrong, usize) {
    let exact: Vec<Exact> = triangles.iter().map(|t| Exact::new(view, t)).collect();
    let (mut wrong, mut covered) = (Wrong::default(), 0);
    for (index, shown) in shown.iter().enumerate() {
        let place = view.place_px(index);
        if let Some(shown) = shown
            && let Some(judged) = exact[shown.triangle].judged(view, place)
        {
            wrong.outside += usize::from(judged.inside_px < -judged.inside_off_px);
            wrong.depth += usize::from((shown.depth - judged.depth).abs() > judged.depth_off);
        }
        let must_be_nearer = |t: &Exact| {
            let near = Exact::at(&t.clip, view.size(), place)?;
            if near.inside_px <= t.off_px || near.depth <= 0.0 {
                return None;
            }
            let judged = t.judged(view, place)?;
            (judged.inside_px > judged.inside_off_px).then_some(judged.depth - judged.depth_off)
        };
        let least = exact.iter().filter_map(must_be_nearer).fold(0.0, f64::max);
        covered += usize::from(least > 0.0);
        wrong.missed += usize::from(shown.map_or(0.0, |s| s.depth) < least * (1.0 - DEPTH_ERROR));
    }
    (wrong, covered)
}

/// The shaders of the stage with parts of a header replaced.
fn mutants(header: &str, replaced: &[(&str, &str)]) -> Vec<Shader> {
    ["triangles.comp", "bin.comp", "large.comp"]
        .map(|name| compiled_variant(&format!("surfaces/compute_raster/{name}"), header, replaced))
        .to_vec()
}

const RASTER: &str = "surfaces/compute_raster/raster.glsl";

/// Vertices far out of the image are moved to its guard band, x and y apart, instead of clipping edges to it.
fn clamped() -> Vec<Shader> {
    mutants(
        RASTER,
        &[
            ("GUARD_BAND_PX = 32768.0", "GUARD_BAND_PX = 1.0e30"),
            ("round(px * ", "round(clamp(px, -2.0e6, 2.0e6) * "),
        ],
    )
}

/// Depth as a plane over the screen in floats.
fn planes() -> Vec<Shader> {
    let nearer = "precise float sum = nearer.x + nearer.y;";
    let plane = "vec2 a = vec2(t.p1 - t.p0) / 256.0, b = vec2(t.p2 - t.p0) / 256.0;
        float area = float(doubled_area(t.p0, t.p1, t.p2));
        float u = (t.depth + t.depth_gain.x * area) - t.depth, v = (t.depth + t.depth_gain.y * area) - t.depth;
        vec2 slope = vec2(u * b.y - v * a.y, v * a.x - u * b.x) / (a.x * b.y - a.y * b.x);
        float sum = dot(slope, vec2(pixel) - vec2(t.p0) / 256.0 + sample_location(i));";
    mutants(
        RASTER,
        &[
            (nearer, plane),
            ("DepthEdges e, PixelDepth p, uint i)", "DepthEdges e, PixelDepth p, ivec2 pixel, uint i)"),
            ("depth_at(t, edges, at, i)", "depth_at(t, edges, at, pixel, i)"),
        ],
    )
}

fn log_between(rng: &mut SplitMix64, low: f32, high: f32) -> f32 {
    low * (high / low).powf(rng.next_f32())
}

fn camera(eye: Vec3, towards: Vec3, fov_y_rad: f32, near_m: f32) -> Camera {
    Camera::look_at("test", eye, eye + towards, fov_y_rad, near_m)
}

/// A floor of 40 m by 40 m, two triangles, at a height of 0.
fn floor() -> [Triangle; 2] {
    let at = |x: f32, z: f32| Vec3::new(20.0 * x, 0.0, 20.0 * z);
    [[at(-1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0)], [at(-1.0, -1.0), at(1.0, 1.0), at(1.0, -1.0)]]
}

/// A triangle of any shape around a point that shows: of a thousandth of a pixel to far larger than the image, slivers, edges along the line
/// of sight, and vertices behind the eye where its size may reach more than its distance.
fn random_triangle(rng: &mut SplitMix64, camera: &Camera, aspect: f32, reach: f32) -> Triangle {
    let view_from_world = camera.view_from_world();
    let world_from_view = view_from_world.inverse();
    let Projection::Perspective { fov_y_rad, near_m } = camera.projection else {
        panic!("found an orthographic camera, expected a perspective one")
    };
    let half = (0.5 * fov_y_rad).tan();
    let ray =
        Vec3::new((2.0 * rng.next_f32() - 1.0) * half * aspect, (2.0 * rng.next_f32() - 1.0) * half, -1.0);
    let distance_m = log_between(rng, 1.1 * near_m, 300.0);
    let size_m = distance_m * log_between(rng, 0.02, reach);
    let mut edges = [direction(rng), direction(rng)];
    match rng.next_u64() % 4 {
        0 => edges[1] = edges[0] + edges[1] * log_between(rng, 1e-4, 1e-1),
        1 => edges[1] = ray.normalize() + edges[1] * log_between(rng, 1e-3, 1e-1),
        _ => {}
    }
    let edges = edges.map(|e| e * size_m * log_between(rng, 0.1, 1.0));
    let (b, c) = (rng.next_f32(), rng.next_f32());
    let (b, c) = if b + c > 1.0 { (1.0 - b, 1.0 - c) } else { (b, c) };
    let corner = ray * distance_m - edges[0] * b - edges[1] * c;
    [corner, corner + edges[0], corner + edges[1]].map(|p| world_from_view.transform_point3(p))
}

/// Views whose near plane is from a fifth of a millimetre to half a metre away.
fn random_camera(rng: &mut SplitMix64) -> Camera {
    let eye = direction(rng) * 10.0 * rng.next_f32();
    let fov = 0.1 + 2.4 * rng.next_f32();
    camera(eye, direction(rng), fov, log_between(rng, 2e-4, 0.5))
}

/// A view of random triangles: few at a time, so that most of them stay in sight.
fn random_view(seed: u64) -> (View, Vec<Triangle>) {
    let mut rng = SplitMix64::new(seed);
    let mut view = View::new(random_camera(&mut rng), (61, 43), if seed.is_multiple_of(2) { 1 } else { 4 });
    view.small_px = [16, 64, 1][seed as usize % 3];
    let reach = [1.0, 10.0, 1000.0][seed as usize / 2 % 3];
    let triangles = (0..16).map(|_| random_triangle(&mut rng, &view.camera, 61.0 / 43.0, reach)).collect();
    (view, triangles)
}

#[test]
fn random_triangles_are_those_of_f64() {
    let gpu = afterlight_testkit::gpu();
    let (mut covered, mut partly, mut seen) = (0, 0, 0);
    for seed in 0..36 {
        let (view, triangles) = random_view(seed);
        let shown = view.on_device(&gpu, &triangles, &[]);
        let (wrong, sure) = judge(&view, &triangles, &shown);
        let differ: BTreeSet<usize> = shown.iter().flatten().map(|s| s.triangle).collect();
        println!("seed {seed}: {sure} samples surely covered, {} triangles seen, {wrong:?}", differ.len());
        assert_eq!(wrong, Wrong::default(), "seed {seed}");
        covered += sure;
        seen += differ.len();
        partly += differ.iter().filter(|i| !Exact::new(&view, &triangles[**i]).is_within).count();
    }
    println!("{covered} samples, {seen} triangles seen, {partly} of them clipped");
    assert!(covered > 50_000 && partly > 30 && seen > 100, "too few to tell");
}

/// A triangle given by what the rasteriser makes of it: vertices in 1/256 pixel, and depths.
struct Snapped {
    at: [[i64; 2]; 3],
    depth: [f64; 3],
}

impl Snapped {
    /// Within 4,000 pixels of the image, so that floats put every vertex next to the point of the grid that is meant. Depths differ by up to
    /// ten thousand times.
    fn random(rng: &mut SplitMix64, size_px: (u32, u32)) -> Self {
        let reach = log_between(rng, 4.0, 4000.0);
        let mut point = || {
            [size_px.0, size_px.1]
                .map(|size| (256.0 * (0.5 * size as f32 + reach * (2.0 * rng.next_f32() - 1.0))) as i64)
        };
        let mut at = [point(), point(), point()];
        if rng.next_u64().is_multiple_of(2) {
            // A sliver, up to some hundredths of a pixel high.
            let t = f64::from(rng.next_f32());
            let [a, b, _] = at;
            at[2] = [0, 1].map(|k| {
                let along = a[k] as f64 + t * (b[k] - a[k]) as f64;
                along as i64 + (rng.next_u64() % 32) as i64 - 16
            });
        }
        Self { at, depth: [(); 3].map(|()| f64::from(log_between(rng, 1e-4, 0.9))) }
    }

    /// The triangle in the world of a camera in the origin that looks along -Z, and the depths that its vertices have in floats.
    fn in_world(&mut self, view: &View) -> Triangle {
        let m = view.camera.clip_from_view(view.size_px.0 as f32 / view.size_px.1 as f32).as_dmat4();
        let Projection::Perspective { near_m, .. } = view.camera.projection else {
            panic!("a perspective camera")
        };
        let vertex = |i: usize| {
            let w_m = f64::from((f64::from(near_m) / self.depth[i]) as f32);
            let ndc =
                DVec2::new(self.at[i][0] as f64, self.at[i][1] as f64) / 256.0 * 2.0 / view.size() - 1.0;
            DVec3::new(ndc.x * w_m / m.x_axis.x, ndc.y * w_m / m.y_axis.y, -w_m).as_vec3()
        };
        let triangle = [vertex(0), vertex(1), vertex(2)];
        self.depth = triangle.map(|p| f64::from(near_m) / -f64::from(p.z));
        triangle
    }

    /// The least of the edge functions at a place in 1/256 pixel, and depth there.
    fn at(&self, place: [i64; 2]) -> Option<(i64, f64)> {
        let cross = |o: [i64; 2], a: [i64; 2], b: [i64; 2]| {
            (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
        };
        let [a, b, c] = self.at;
        let area = cross(a, b, c);
        let edges = [cross(place, b, c), cross(place, c, a), cross(place, a, b)].map(|e| e * area.signum());
        let depth = (0..3).map(|i| edges[i] as f64 * self.depth[i]).sum::<f64>() / area.abs() as f64;
        (area != 0).then(|| (edges[0].min(edges[1]).min(edges[2]), depth))
    }
}

/// Compares triangles of known snapped vertices with integers, and returns samples that show a triangle which does not cover them, or miss
/// one, samples whose depth is off, and all that show a triangle.
fn judge_snapped(device: &gpu::Device, seed: u64, shaders: &[Shader]) -> (usize, usize, usize) {
    let mut rng = SplitMix64::new(seed);
    let size_px = (64, 48);
    let mut view = View::new(
        camera(Vec3::ZERO, Vec3::NEG_Z, 0.9, 0.01),
        size_px,
        if seed.is_multiple_of(2) { 1 } else { 4 },
    );
    view.small_px = [16, 64, 1][seed as usize % 3];
    let mut snapped: Vec<Snapped> = (0..24).map(|_| Snapped::random(&mut rng, size_px)).collect();
    let triangles: Vec<Triangle> = snapped.iter_mut().map(|t| t.in_world(&view)).collect();
    let (mut elsewhere, mut off, mut all) = (0, 0, 0);
    for (index, shown) in view.on_device(device, &triangles, shaders).into_iter().enumerate() {
        let place = (view.place_px(index) * 256.0).to_array().map(|p| p as i64);
        let inside = snapped.iter().filter_map(|t| t.at(place)).filter(|(least, _)| *least > 0);
        let nearest = inside.map(|(_, depth)| depth).fold(0.0, f64::max);
        let depth = shown.map_or(0.0, |s| s.depth);
        elsewhere += usize::from(depth < nearest * (1.0 - DEPTH_ERROR));
        if let Some(shown) = shown {
            let (least, exact) = snapped[shown.triangle].at(place).unwrap_or((-1, 0.0));
            elsewhere += usize::from(least < 0);
            off += usize::from((depth - exact).abs() > DEPTH_ERROR * exact);
            all += 1;
        }
    }
    (elsewhere, off, all)
}

/// From the snapped vertices on, coverage is exact and depth has a relative error, of slivers as well.
#[test]
fn snapped_triangles_are_those_of_integers() {
    let gpu = afterlight_testkit::gpu();
    let mut samples = 0;
    for seed in 0..24 {
        let (elsewhere, off, all) = judge_snapped(&gpu, seed, &[]);
        println!("seed {seed}: {all} samples, {elsewhere} elsewhere, {off} depths off");
        assert_eq!((elsewhere, off), (0, 0), "seed {seed}");
        samples += all;
    }
    assert!(samples > 50_000, "{samples} samples: too few to tell");
}

#[test]
fn a_floor_from_its_middle_is_that_of_f64() {
    let gpu = afterlight_testkit::gpu();
    let (ahead, down, aside) =
        (Vec3::new(0.3, -0.1, 1.0), Vec3::new(0.0, -1.0, 0.01), Vec3::new(1.0, -0.4, 0.0));
    for (size_px, samples, towards) in [
        ((1920, 1080), 1, ahead),
        ((480, 270), 1, down),
        ((480, 270), 1, aside),
        ((131, 77), 4, ahead),
        ((131, 77), 4, down),
        ((131, 77), 4, aside),
    ] {
        let view = View::new(camera(Vec3::Y * 1.7, towards, 1.0, 0.004), size_px, samples);
        let (wrong, covered) = judge(&view, &floor(), &view.on_device(&gpu, &floor(), &[]));
        println!("{size_px:?}, {samples} samples, towards {towards}: {covered} covered, {wrong:?}");
        assert!(covered > (size_px.0 * size_px.1 * samples / 3) as usize, "{covered} samples of the floor");
        assert_eq!(wrong, Wrong::default(), "{size_px:?}, {samples} samples, towards {towards}");
    }
}

/// A fan around a point: wherever its outer vertices stand, behind the eye as well, every sample of the plane belongs to one triangle of it.
#[test]
fn triangles_of_a_fan_share_no_sample_and_leave_none_out() {
    let gpu = afterlight_testkit::gpu();
    const COUNT: usize = 7;
    for seed in 0..8 {
        let mut rng = SplitMix64::new(100 + seed);
        let samples = if seed.is_multiple_of(2) { 1 } else { 4 };
        // Seen from above, so that the fan's front shows.
        let down = Vec3::new(rng.next_f32() - 0.5, -0.2 - rng.next_f32(), rng.next_f32() - 0.5);
        let near_m = log_between(&mut rng, 1e-4, 0.2);
        let mut view = View::new(camera(Vec3::Y * 1.7, down, 1.2, near_m), (65, 49), samples);
        view.double_sided = false;
        let middle = Vec3::new(rng.next_f32() * 2.0 - 1.0, 0.0, rng.next_f32() * 2.0 - 1.0);
        let far = log_between(&mut rng, 10.0, 1e5);
        let outer: Vec<Vec3> = (0..COUNT)
            .map(|i| {
                let angle = (i as f32 + 0.8 * rng.next_f32()) * std::f32::consts::TAU / COUNT as f32;
                middle + Vec3::new(angle.sin(), 0.0, angle.cos()) * far * (0.5 + rng.next_f32())
            })
            .collect();
        let fan: Vec<Triangle> = (0..COUNT).map(|i| [middle, outer[i], outer[(i + 1) % COUNT]]).collect();
        let all = view.on_device(&gpu, &fan, &[]);
        let mut times = vec![0; all.len()];
        for triangle in &fan {
            let alone = view.on_device(&gpu, &[*triangle], &[]);
            alone.iter().zip(&mut times).for_each(|(shown, times)| *times += usize::from(shown.is_some()));
        }
        let turned: Vec<Triangle> = fan.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let back_faces = view.on_device(&gpu, &turned, &[]);
        assert_eq!(back_faces.iter().flatten().count(), 0, "seed {seed}: a back face shows");
        let more = times.iter().filter(|times| **times > 1).count();
        assert_eq!(more, 0, "seed {seed}: samples of two triangles");
        let (wrong, covered) = judge(&view, &fan, &all);
        let seen = all.iter().flatten().count();
        println!(
            "seed {seed}: near {near_m}, reaches {far} m, {seen} samples shown, {covered} surely, {wrong:?}"
        );
        assert_eq!(wrong, Wrong::default(), "seed {seed}");
        // Every part of the plane this near to the middle is within the fan.
        let of_fan: Vec<usize> = (0..all.len())
            .filter(|i| {
                view.ground_at(view.place_px(*i))
                    .is_some_and(|p| p.distance(middle.as_dvec3()) < 0.3 * f64::from(far))
            })
            .collect();
        let holes = of_fan.iter().filter(|i| all[**i].is_none()).count();
        assert_eq!(holes, 0, "seed {seed}: holes in the fan");
        assert!(of_fan.len() > all.len() / 4, "seed {seed}: too little of the fan is seen: {}", of_fan.len());
    }
}

/// Vertices that are clamped leave a part of the floor uncovered; planes in floats give wrong depths of slivers and of triangles seen
/// edge-on.
#[test]
fn mutants_are_caught() {
    let gpu = afterlight_testkit::gpu();
    let view = View::new(camera(Vec3::Y * 1.7, Vec3::new(0.3, -0.6, 1.0), 1.0, 0.0002), (480, 270), 1);
    let judged = |shaders: &[Shader]| judge(&view, &floor(), &view.on_device(&gpu, &floor(), shaders));
    let (right, covered) = judged(&[]);
    assert_eq!(right, Wrong::default());
    let (wrong, _) = judged(&clamped());
    println!("clamped: {wrong:?} of {covered}");
    assert!(wrong.missed * 50 > covered, "clamped vertices go unseen: {wrong:?} of {covered}");

    let planes = planes();
    let off: usize = (0..16).map(|seed| judge_snapped(&gpu, seed, &planes).1).sum();
    println!("planes: {off} depths off");
    assert!(off > 20, "planes in floats go unseen: {off} depths off");
}

/// `gbuffer-list` with its triangles found in one way or the other, and with shaders in place of its own.
fn list_image(stage: &Stage, settings: &Settings, sets: &[(&str, &str)], shaders: &[Shader]) -> Rgba8Image {
    let list = find("gbuffer-list").expect("known");
    image_of(&mut stage.prepare_shaders(list, settings, &params(list, sets), shaders.iter().cloned()))
}

/// Rasterisation in compute finds what the raster pass finds: triangles before the near plane, near planes that all triangles under the eye
/// reach far out of the image for, triangles of every size, and more of them than the first frame has room for.
#[test]
fn compute_rasterisation_finds_what_the_raster_pass_finds() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let bounds = stage.scene.bounds_ws();
    let floor_m = bounds.center() - Vec3::Y * (0.499 * bounds.size().y);
    let views = [
        ("in a wall", bounds.min + bounds.size() * Vec3::new(0.5, 0.3, 0.002), bounds.center(), 0.05),
        ("on the floor", floor_m, bounds.center(), 0.05),
        ("on the floor, near plane at a millimetre", floor_m, bounds.center(), 0.001),
        ("straight down", bounds.center(), bounds.center() - Vec3::Y, 0.05),
        ("far outside", bounds.center() + bounds.size() * 50.0, bounds.center(), 0.05),
    ];
    for samples in [1, 4] {
        for (what, eye, target, near_m) in views {
            let camera = Camera::look_at(what, eye, target, 1.0, near_m);
            let settings = Settings { samples, ..stage.from(camera, (131, 77), 20) };
            let raster = list_image(&stage, &settings, &[("visibility", "raster")], &[]);
            // Every triangle in tiles takes long on a CPU: one view shows it.
            let sizes: &[&str] = if what == "straight down" { &["1", "16", "64"] } else { &["16"] };
            for small_px in sizes {
                let sets = [("visibility", "compute"), ("small-px", *small_px)];
                let db = psnr(&raster, &list_image(&stage, &settings, &sets, &[]));
                println!("{samples} samples, {what}, small-px={small_px}: {db:.2} dB");
                assert!(
                    db >= min_psnr_db(samples),
                    "{samples} samples, {what}, small-px={small_px}: {db:.2} dB to the raster pass"
                );
            }
        }
    }
}

/// A floor of two triangles under the eye, and far from it: the raster pass's, and not with vertices that are clamped.
#[test]
fn a_floor_of_two_triangles_is_the_raster_passs() {
    let gpu = afterlight_testkit::gpu();
    for (towards, near_m) in [
        (Vec3::new(0.3, -0.6, 1.0), 0.0002),
        (Vec3::new(0.3, -0.1, 1.0), 0.004),
        (Vec3::new(-1.0, -0.05, 0.1), 0.05),
    ] {
        let camera = camera(Vec3::Y * 1.7, towards, 1.0, near_m);
        let stage = Stage::of(&gpu, scene_of(&floor(), &camera, true));
        for samples in [1, 4] {
            let settings = Settings { samples, ..stage.from(camera.clone(), (480, 270), 20) };
            let raster = list_image(&stage, &settings, &[("visibility", "raster")], &[]);
            let compute =
                |shaders: &[Shader]| list_image(&stage, &settings, &[("visibility", "compute")], shaders);
            let db = psnr(&raster, &compute(&[]));
            println!("towards {towards}, near plane at {near_m} m, {samples} samples: {db:.2} dB");
            assert!(
                db >= min_psnr_db(samples),
                "towards {towards}, {near_m} m, {samples} samples: {db:.2} dB"
            );
            if near_m < 0.001 {
                let db = psnr(&raster, &compute(&clamped()));
                println!("clamped: {db:.2} dB");
                assert!(db < 35.0, "clamped vertices go unseen: {db:.2} dB");
            }
        }
    }
}

/// A camera off by two centimetres moves edges by a part of a pixel: the comparisons above must see it.
#[test]
fn a_camera_off_by_two_centimetres_is_caught() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=17000&texture=64");
    let from = |eye: Vec3| {
        let camera = Camera::look_at("view", eye, eye + Vec3::new(1.0, -0.1, 0.2), 1.0, 0.05);
        let settings = Settings { samples: 4, ..stage.from(camera, (131, 77), 20) };
        list_image(&stage, &settings, &[("visibility", "compute")], &[])
    };
    let eye = stage.scene.bounds_ws().center();
    let db = psnr(&from(eye), &from(eye + Vec3::Y * 0.02));
    assert!(db < 40.0, "a mutant within the bound: {db:.2} dB");
}

/// Every technique that can rasterise in compute, made to.
fn in_compute() -> Vec<(&'static dyn Technique, Params)> {
    let mut found = Vec::new();
    for technique in registry().iter().copied() {
        let mut params = params_of(technique);
        if set_param(technique, &mut params, "visibility", "compute").is_ok() {
            found.push((technique, params));
        }
    }
    assert!(found.len() > 2, "{} techniques rasterise in compute", found.len());
    found
}

/// Least PSNR to `forward`, dB (contract).
fn min_psnr_db(samples: u32) -> f64 {
    if samples == 1 { 45.0 } else { 40.0 }
}

fn agree(stage: &Stage, settings: &Settings, what: &str) {
    for samples in [1, 4] {
        let settings = Settings { samples, ..settings.clone() };
        let forward = stage.image(find("forward").expect("known"), &settings);
        for (technique, params) in in_compute() {
            let info = technique.info();
            if !info.samples.contains(&samples) {
                continue;
            }
            let image = image_of(&mut stage.prepare_with(technique, &settings, &params));
            let db = psnr(&forward, &image);
            println!("{what}, {samples} samples: {}: {db:.2} dB", info.id);
            assert!(
                db >= min_psnr_db(samples),
                "{what}, {samples} samples: {}: {db:.2} dB to forward",
                info.id
            );
        }
    }
}

/// Where the camera of the file stands, a floor triangle of 30 m passes under the eye.
#[test]
fn sponza_from_its_own_camera() {
    let gpu = afterlight_testkit::gpu();
    let Some(scenes) = afterlight_testkit::shared_scenes() else { return };
    let stage = Stage::new(&gpu, &scenes.join("sponza/sponza.gltf").to_string_lossy());
    agree(&stage, &stage.settings((320, 180), 20), "sponza");
}
