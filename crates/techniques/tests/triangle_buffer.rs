//! Attributes from triangle records: a million random triangles against f64, those that reach behind the eye included.

mod common;

use std::{path::Path, sync::Arc};

use afterlight_oracle::{
    packing::{unpack_normal, unpack_tangent},
    tangent::tangent_of,
};
use afterlight_renderer::Renderer;
use afterlight_stages::surfaces::triangles::{self, RecordParams, Tangents};
use afterlight_techniques::{
    Frame, Info, Params, SHADERS, SceneGpu, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    find,
    graph::{
        BufferRole, Graph, ImageHandle, PassRole,
        gpu::{self, vk},
    },
    scene::{
        Aabb, Camera, Image, ImageData, Instance, Material, Mesh, Scene, TextureRef, VertexAttributes,
        rng::SplitMix64,
    },
    shader::Shader,
};
use common::{compiled, source};
use glam::{Affine3A, DMat4, DVec2, DVec3, DVec4, Vec3};

/// Triangles of a draw; every draw is full, so that bits, IDs and places are one.
const DRAW_TRIANGLES: usize = 1024;
const DRAWS: usize = 977;
const SIZE_PX: (u32, u32) = (1920, 1080);
/// Floats that `attributes.comp` finds of a triangle.
const FOUND: usize = 16;
/// Half of the spacing of floats at 1.
const U: f64 = 1.0 / 16_777_216.0;

/// What rasterisers round vertices to, pixels: thinner triangles show by chance, and what they show is as random.
const SNAP_PX: f64 = 1.0 / 256.0;
/// Absolute error of unpacked normals, in units of [`U`].
const UNPACKED: f64 = 4.0;

/// What a triangle is like.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Class {
    /// In front of the eye, from a pixel to larger than the image.
    Front,
    OneBehind,
    TwoBehind,
    /// A ten-thousandth to a tenth as high as wide.
    Sliver,
    /// 200 m to 20 km away, a pixel to 64 large.
    Far,
    /// Seen at 6 degrees to a hundredth of a degree.
    Grazing,
    /// Thinner than what a rasteriser can tell: shows by chance. Not compared.
    EdgeOn,
}

const CLASSES: [Class; 6] =
    [Class::Front, Class::OneBehind, Class::TwoBehind, Class::Sliver, Class::Far, Class::Grazing];

/// A random number in [0, 1).
fn unit(rng: &mut SplitMix64) -> f64 {
    rng.next_f32().into()
}

/// A random number of even logarithm.
fn log_between(rng: &mut SplitMix64, low: f64, high: f64) -> f64 {
    low * (high / low).powf(unit(rng))
}

fn direction(rng: &mut SplitMix64) -> DVec3 {
    loop {
        let v = DVec3::new(unit(rng), unit(rng), unit(rng)) * 2.0 - 1.0;
        if (1e-6..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// The view of the triangles.
struct View {
    camera: Camera,
    clip_from_world: DMat4,
    world_from_view: DMat4,
    /// View coordinates at a distance of 1 m of the image's right and lower edge.
    half: DVec2,
}

impl View {
    fn new() -> Self {
        let eye = Vec3::new(3.1, -2.3, 5.7);
        let camera = Camera::look_at("test", eye, eye + Vec3::new(-0.6, 0.3, -0.8), 1.1, 0.1);
        let aspect = SIZE_PX.0 as f32 / SIZE_PX.1 as f32;
        // What the device is given: screen positions are defined by it.
        let clip_from_world = camera.clip_from_world(aspect).as_dmat4();
        let half_height = (0.55f64).tan();
        Self {
            world_from_view: camera.view_from_world().as_dmat4().inverse(),
            clip_from_world,
            half: DVec2::new(half_height * f64::from(aspect), half_height),
            camera,
        }
    }

    fn ndc(pixel: DVec2) -> DVec2 {
        (pixel + 0.5) * 2.0 / DVec2::new(SIZE_PX.0.into(), SIZE_PX.1.into()) - 1.0
    }
}

/// A triangle of a class that covers a pixel.
struct Triangle {
    position_ws: [Vec3; 3],
    normal: [u32; 3],
    tangent: [u32; 3],
    uv: [[f32; 2]; 3],
    pixel: [u32; 2],
}

/// Corners in view space of a triangle around a point that a ray meets at `distance_m`.
fn corners(rng: &mut SplitMix64, class: Class, ray: DVec3, half: DVec2) -> [DVec3; 3] {
    let distance_m = match class {
        Class::Far => log_between(rng, 200.0, 20_000.0),
        _ => log_between(rng, 0.2, 100.0),
    };
    let pixel_m = distance_m * 2.0 * half.y / f64::from(SIZE_PX.1);
    let size_m = match class {
        Class::Front | Class::Sliver | Class::Grazing | Class::EdgeOn => {
            log_between(rng, pixel_m, 2.0 * distance_m)
        }
        Class::Far => log_between(rng, pixel_m, 64.0 * pixel_m),
        Class::OneBehind | Class::TwoBehind => log_between(rng, 1.5 * distance_m, 30.0 * distance_m),
    };
    let first = direction(rng);
    let mut second = direction(rng);
    if class == Class::Sliver {
        second = (first + second * log_between(rng, 1e-4, 1e-1)) * (0.3 + unit(rng));
    }
    // An edge along the ray, but for the angle.
    if class == Class::Grazing {
        second = ray.normalize() + second * log_between(rng, 2e-4, 1e-1);
    }
    if class == Class::EdgeOn {
        second = ray.normalize() + second * log_between(rng, 1e-12, 1e-6);
    }
    let (first, second) = (first * size_m, second * size_m);
    let (mut b, mut c) = (unit(rng), unit(rng));
    if b + c > 1.0 {
        (b, c) = (1.0 - b, 1.0 - c);
    }
    let corner = ray * distance_m - first * b - second * c;
    [corner, corner + first, corner + second]
}

/// Least height on the screen of a triangle in front of the eye, pixels.
fn height_px(corners: &[DVec3; 3], half: DVec2) -> f64 {
    let size = DVec2::new(SIZE_PX.0.into(), SIZE_PX.1.into());
    let [a, b, c] = corners.map(|p| p.truncate() / -p.z / half * 0.5 * size);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    cross(b - a, c - a).abs() / longest
}

fn triangle(rng: &mut SplitMix64, class: Class, view: &View) -> Triangle {
    let pixel = [SIZE_PX.0, SIZE_PX.1].map(|size| ((unit(rng) * f64::from(size)) as u32).min(size - 1));
    let ndc = View::ndc(DVec2::new(pixel[0].into(), pixel[1].into()));
    let ray = DVec3::new(ndc.x * view.half.x, -ndc.y * view.half.y, -1.0);
    let behind = match class {
        Class::OneBehind => 1,
        Class::TwoBehind => 2,
        _ => 0,
    };
    let has_height = behind == 0 && class != Class::EdgeOn;
    let corners = loop {
        let corners = corners(rng, class, ray, view.half);
        let found = corners.iter().filter(|p| p.z > 0.0).count();
        if found == behind && (!has_height || height_px(&corners, view.half) >= SNAP_PX) {
            break corners;
        }
    };
    let mut bits = || (rng.next_u64() >> 32) as u32;
    let normal = [bits(), bits(), bits()];
    let uv = [(); 3].map(|()| [rng.between(-4.0, 4.0), rng.between(-4.0, 4.0)]);
    Triangle {
        position_ws: corners.map(|p| view.world_from_view.transform_point3(p).as_vec3()),
        normal,
        // Another spread of the same bits: random numbers of their own would move all triangles that follow.
        // A positive x: none of them is marked as missing, for which records pack another direction.
        tangent: normal.map(|bits| (bits.wrapping_mul(0x9e37_79b1) ^ bits >> 15) & !0x8000),
        uv,
        pixel,
    }
}

/// Triangles of all classes in turn.
fn triangles(view: &View, draws: usize, classes: &[Class]) -> Vec<Triangle> {
    let mut rng = SplitMix64::new(7);
    (0..draws * DRAW_TRIANGLES).map(|i| triangle(&mut rng, classes[i % classes.len()], view)).collect()
}

/// A scene of the triangles; with a normal map where the records are to keep tangents.
fn scene_of(triangles: &[Triangle], view: &View, tangents: Tangents) -> Scene {
    let flat = Image {
        name: "flat".to_owned(),
        data: ImageData::Rgba8 { width: 1, height: 1, pixels: Arc::from([128, 128, 255, 255]) },
        width: 1,
        height: 1,
    };
    let uv_transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let normal_map = TextureRef { image: 0, sampler: Default::default(), uv_set: 0, uv_transform };
    let keeps = tangents == Tangents::Vertices;
    let attributes = |t: &Triangle, k: usize| VertexAttributes {
        normal_os_oct: t.normal[k],
        tangent_os_oct: t.tangent[k],
        uv0: t.uv[k].map(f32::to_bits),
        uv1: [0; 2],
        color_rgba8: u32::MAX,
    };
    let bounds_of = |triangles: &[Triangle]| {
        let mut bounds = Aabb::EMPTY;
        triangles.iter().flat_map(|t| t.position_ws).for_each(|p| bounds.extend(p));
        bounds
    };
    let corners = 3 * DRAW_TRIANGLES as u32;
    let mesh = |(i, triangles): (usize, &[Triangle])| Mesh {
        name: String::new(),
        first_index: 0,
        index_count: corners,
        first_vertex: i as u32 * corners,
        vertex_count: corners,
        material: 0,
        bounds_os: bounds_of(triangles),
    };
    Scene {
        positions_os: triangles.iter().flat_map(|t| t.position_ws.map(|p| p.to_array())).collect(),
        attributes: triangles.iter().flat_map(|t| [0, 1, 2].map(|k| attributes(t, k))).collect(),
        indices: (0..corners).collect(),
        meshes: triangles.chunks(DRAW_TRIANGLES).enumerate().map(mesh).collect(),
        instances: (0..triangles.len().div_ceil(DRAW_TRIANGLES) as u32)
            .map(|mesh| Instance { mesh, node: 0, world_from_object: Affine3A::IDENTITY })
            .collect(),
        images: keeps.then_some(flat).into_iter().collect(),
        materials: vec![Material {
            double_sided: true,
            normal_texture: keeps.then_some(normal_map),
            ..Material::default()
        }],
        cameras: vec![view.camera.clone()],
        ..Scene::default()
    }
}

/// Records of all triangles, and what they give at a pixel each.
struct Records {
    /// Pixel of each record's triangle, 2 × 16 bits.
    pixels: Vec<u32>,
    /// A bit a triangle of the scene: whether it has a record.
    bits: Vec<u32>,
}

impl Technique for Records {
    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }

    fn info(&self) -> &Info {
        find("dais").expect("known").info()
    }
    fn predict(&self, _: &Workload, _: &Params) -> Cost {
        Cost::default()
    }
    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let bits = frame.table(graph, "test/bits", BufferRole::TriangleSets, &self.bits)?;
        // A scene without normal maps has the record of derivatives.
        let triangles =
            triangles::store_marked(graph, frame, ("test", RecordParams::default()), bits, false)?;
        let pixels = frame.table(graph, "test/pixels", BufferRole::Counters, &self.pixels)?;
        let found = graph.buffer("test/found", BufferRole::Counters, 4 * (FOUND * self.pixels.len()) as u64);
        let mut pass =
            frame.compute(graph, "test/attributes", PassRole::Upkeep, &frame.shader("test/attributes.comp")?);
        triangles.records.bind(&mut pass);
        pass.read("Pixels", &pixels);
        let found = pass.write("Found", found);
        pass.dispatch([self.pixels.len() as u32 / 128, 1, 1]);
        pass.finish();
        graph.keep(&found);
        let radiance = graph.image(
            "test/radiance",
            BufferRole::Targets,
            frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
        );
        Ok(graph.clear_image("test/clear", PassRole::Shading, radiance, [0.0; 4]))
    }
}

/// Random triangles on a device.
struct Stage<'a> {
    device: &'a gpu::Device,
    view: &'a View,
    triangles: Vec<Triangle>,
    tangents: Tangents,
    uploaded: Arc<SceneGpu>,
    settings: Settings,
}

impl<'a> Stage<'a> {
    fn new(
        device: &'a gpu::Device,
        view: &'a View,
        draws: usize,
        classes: &[Class],
        tangents: Tangents,
    ) -> Self {
        let triangles = triangles(view, draws, classes);
        let scene = scene_of(&triangles, view, tangents);
        let uploaded = SceneGpu::upload(device, &scene, &|_, _| {}).unwrap_or_else(|e| panic!("{e}"));
        let settings = Settings::for_scene(&scene, SIZE_PX.0, SIZE_PX.1);
        Self { device, view, triangles, tangents, uploaded, settings }
    }

    /// Errors with the derivative pass as it is, or with parts of its text replaced.
    fn errors(&self, mutant: &[(&str, &str)]) -> ByClass {
        errors(self.view, &self.triangles, self.tangents, &self.on_device(mutant))
    }

    /// What the device finds of all triangles, [`FOUND`] floats each.
    fn on_device(&self, mutant: &[(&str, &str)]) -> Vec<f32> {
        self.on_device_of(&vec![u32::MAX; self.triangles.len() / 32], mutant)
    }

    /// What the device finds of the triangles whose bits are set, a multiple of 128 of them, in their order.
    fn on_device_of(&self, bits: &[u32], mutant: &[(&str, &str)]) -> Vec<f32> {
        let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
        let mut renderer = Renderer::with_scene(self.device, self.uploaded.clone(), &self.settings)
            .unwrap_or_else(|e| panic!("{e}"));
        let name = "surfaces/triangles/derivatives.comp";
        renderer.add_shaders([
            compiled("test/attributes.comp", &tests.join("attributes.comp.glsl"), &[], &[]),
            compiled(name, &source(&format!("{name}.glsl")), &[], mutant),
        ]);
        let is_set = |i: &usize| bits[i / 32] >> (i % 32) & 1 != 0;
        let pixels = (0..self.triangles.len()).filter(is_set).map(|i| self.triangles[i].pixel);
        let technique = Records { pixels: pixels.map(|[x, y]| x | y << 16).collect(), bits: bits.to_vec() };
        let mut prepared = renderer.prepare(&technique, &Params::default()).unwrap_or_else(|e| panic!("{e}"));
        // Preparing has run the frame that has room for all.
        let bytes = prepared.executor().read_buffer("test/found").unwrap_or_else(|e| panic!("{e}"));
        bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
    }
}

/// A clip position's x, y, w, and the sums of the magnitudes that each is the sum of.
struct Clip {
    at: DVec3,
    terms: DVec3,
}

fn clip(m: &DMat4, p: Vec3) -> Clip {
    let p = p.as_dvec3().extend(1.0);
    let pick = |v: DVec4| DVec3::new(v.x, v.y, v.w);
    let abs = DMat4::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs(), m.w_axis.abs());
    Clip { at: pick(*m * p), terms: pick(abs * p.abs()) }
}

/// A scalar attribute in f64, and how far rounding to floats may move it, in units of [`U`].
#[derive(Clone, Copy)]
struct Exact {
    value: f64,
    slack: f64,
}

/// A triangle's interpolation at a pixel in f64.
///
/// Slack is the first-order effect of what floats lose: each clip coordinate moves by its terms' magnitudes, products and sums
/// by theirs. The part of the clip coordinates is there in any rasteriser of floats as well.
struct Oracle {
    /// Edge functions at the pixel over their sum: perspective-correct barycentric coordinates.
    at: [f64; 3],
    /// Their changes a pixel.
    dx: [f64; 3],
    dy: [f64; 3],
    /// Magnitude of the error of each edge function over their sum, and of its changes.
    edge_slack: [f64; 3],
    change_slack: [f64; 3],
    /// Magnitudes of the products that edge functions and their changes are sums of.
    edge_terms: [f64; 3],
    change_terms: [f64; 3],
    /// Changes a pixel of the sum of edge functions, over it.
    sum_change: f64,
    w: [f64; 3],
    w_terms: [f64; 3],
}

fn cross(a: DVec2, b: DVec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// The anchor of `derivatives.comp.glsl`.
fn anchor_px(c: &[Clip; 3]) -> DVec2 {
    let size = DVec2::new(SIZE_PX.0.into(), SIZE_PX.1.into());
    let seen = c.iter().filter(|c| c.at.z > 0.0);
    let px = |c: &Clip| ((c.at.truncate() / c.at.z * 0.5 + 0.5) * size).clamp(DVec2::ZERO, size);
    (seen.clone().map(px).sum::<DVec2>() / seen.count() as f64).floor()
}

impl Oracle {
    fn new(view: &View, t: &Triangle) -> Option<Self> {
        let c = t.position_ws.map(|p| clip(&view.clip_from_world, p));
        let pixel = DVec2::new(t.pixel[0].into(), t.pixel[1].into());
        let (ndc, anchor) = (View::ndc(pixel), View::ndc(anchor_px(&c)));
        let step = DVec2::new(2.0 / f64::from(SIZE_PX.0), 2.0 / f64::from(SIZE_PX.1));
        let w = [0, 1, 2].map(|i| c[i].at.z);
        let q = [0, 1, 2].map(|i| c[i].at.truncate() - ndc * w[i]);
        let others = [(1, 2), (2, 0), (0, 1)];
        let b = others.map(|(j, k)| cross(q[j], q[k]));
        let sum: f64 = b.iter().sum();
        let det: f64 = (0..3).map(|i| b[i] * w[i]).sum();
        if sum == 0.0 || det == 0.0 {
            return None;
        }
        let bx = others.map(|(j, k)| (w[k] * q[j].y - w[j] * q[k].y) * step.x);
        let by = others.map(|(j, k)| (w[j] * q[k].x - w[k] * q[j].x) * step.y);
        let (sum_dx, sum_dy) = (bx.iter().sum::<f64>() / sum, by.iter().sum::<f64>() / sum);
        let at = b.map(|b| b / sum);

        // Reach of q between anchor and pixel, what it moves by, and the same of w.
        let reach = [0, 1, 2].map(|i| {
            let from_anchor = (ndc - anchor).abs().max_element() * w[i].abs();
            (c[i].at.truncate() - anchor * w[i]).abs().max_element() + from_anchor
        });
        let w_terms = [0, 1, 2].map(|i| c[i].terms.z);
        let moved = [0, 1, 2].map(|i| {
            // Coordinates of pixels are differences to 1.
            c[i].terms.truncate().max_element() + w_terms[i]
        });
        let over_sum = |value: f64| value / sum.abs();
        let pixel_step = step.max_element();
        Some(Self {
            dx: [0, 1, 2].map(|i| bx[i] / sum - at[i] * sum_dx),
            dy: [0, 1, 2].map(|i| by[i] / sum - at[i] * sum_dy),
            at,
            edge_slack: others.map(|(j, k)| over_sum(reach[j] * moved[k] + moved[j] * reach[k])),
            change_slack: others.map(|(j, k)| {
                let of_w = w_terms[k] * reach[j] + w_terms[j] * reach[k];
                over_sum(pixel_step * (of_w + w[k].abs() * moved[j] + w[j].abs() * moved[k]))
            }),
            edge_terms: others.map(|(j, k)| over_sum(2.0 * reach[j] * reach[k])),
            change_terms: others
                .map(|(j, k)| over_sum(pixel_step * (w[k].abs() * reach[j] + w[j].abs() * reach[k]))),
            sum_change: sum_dx.abs().max(sum_dy.abs()),
            w,
            w_terms,
        })
    }

    fn sum(weights: &[f64; 3], of: impl Fn(usize) -> f64) -> f64 {
        (0..3).map(|i| weights[i] * of(i)).sum()
    }

    /// An attribute of which `input` is the error at the vertices, in units of [`U`].
    fn value(&self, a: [f64; 3], input: f64) -> Exact {
        let value = Self::sum(&self.at, |i| a[i]);
        let slack = Self::sum(&self.edge_slack, |i| (a[i] - value).abs())
            + Self::sum(&self.edge_terms, |i| a[i].abs() + value.abs() + input);
        Exact { value, slack }
    }

    /// Changes along x and y.
    fn changes(&self, a: [f64; 3]) -> [Exact; 2] {
        let of = self.value(a, 0.0);
        let of_sum = Self::sum(&self.edge_slack, |_| 1.0) + Self::sum(&self.edge_terms, |_| 1.0);
        let slack = Self::sum(&self.change_slack, |i| (a[i] - of.value).abs())
            + Self::sum(&self.change_terms, |i| a[i].abs() + of.value.abs())
            + of.slack * self.sum_change;
        [self.dx, self.dy].map(|d| {
            let value = Self::sum(&d, |i| a[i]);
            Exact { value, slack: slack + value.abs() * of_sum }
        })
    }

    /// World position; its slack is that of the distance along the ray from the eye.
    fn position(&self, t: &Triangle, eye_ws: DVec3) -> (DVec3, f64) {
        let p = (0..3).map(|i| t.position_ws[i].as_dvec3() * self.at[i]).sum::<DVec3>();
        let w = Self::sum(&self.at, |i| self.w[i]);
        let of_w = Self::sum(&self.edge_slack, |i| (self.w[i] - w).abs())
            + Self::sum(&self.edge_terms, |i| self.w_terms[i] + w.abs());
        (p, of_w / w.abs() * p.distance(eye_ws) + p.length() + eye_ws.length())
    }
}

/// Largest and mean of an error.
#[derive(Clone, Copy, Default)]
struct Errors {
    max: f64,
    sum: f64,
    count: f64,
    /// Largest share of what rounding may do, and the sum of shares.
    share_max: f64,
    share_sum: f64,
}

impl Errors {
    fn add(&mut self, error: f64, scale: f64, slack: f64) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        self.max = self.max.max(error / scale);
        self.sum += error / scale;
        self.count += 1.0;
        self.share_max = self.share_max.max(error / (U * slack));
        self.share_sum += error / (U * slack);
    }
    fn mean(&self) -> f64 {
        self.sum / self.count
    }
}

const ATTRIBUTES: [&str; 6] =
    ["position", "normal", "texture coordinates", "the same, pixels", "their changes", "tangent and sign"];

type ByClass = [[Errors; ATTRIBUTES.len()]; CLASSES.len()];

/// Errors by class and attribute. Positions: over the distance to the eye; normals and texture coordinates: over the range of the
/// attribute's values at the vertices; changes: over their magnitude.
fn errors(view: &View, triangles: &[Triangle], tangents: Tangents, found: &[f32]) -> ByClass {
    let mut errors = [[Errors::default(); ATTRIBUTES.len()]; CLASSES.len()];
    let eye_ws = view.camera.eye_ws().as_dvec3();
    for (index, (t, found)) in triangles.iter().zip(found.chunks_exact(FOUND)).enumerate() {
        let Some(oracle) = Oracle::new(view, t) else { continue };
        let found: Vec<f64> = found.iter().map(|f| f64::from(*f)).collect();
        let [position, normal, uv, shift, changes, tangent] = &mut errors[index % CLASSES.len()];
        let (p, slack) = oracle.position(t, eye_ws);
        position.add(p.distance(DVec3::new(found[0], found[1], found[2])), p.distance(eye_ws), slack);
        let normals = t.normal.map(unpack_normal);
        for axis in 0..3 {
            let a = normals.map(|n| n[axis]);
            let exact = oracle.value(a, UNPACKED);
            normal.add((found[3 + axis] - exact.value).abs(), range(a), exact.slack);
        }
        if tangents == Tangents::Vertices {
            let tangents = [0, 1, 2].map(|k| {
                let (tangent, sign) = unpack_tangent(t.tangent[k]);
                tangent_of(normals[k], tangent).extend(sign)
            });
            for axis in 0..4 {
                let a = tangents.map(|t| t[axis]);
                let exact = oracle.value(a, UNPACKED);
                tangent.add((found[12 + axis] - exact.value).abs(), range(a).max(1e-3), exact.slack);
            }
        }
        for axis in 0..2 {
            let a = t.uv.map(|uv| f64::from(uv[axis]));
            let exact = oracle.value(a, 0.0);
            let error = (found[6 + axis] - exact.value).abs();
            uv.add(error, range(a), exact.slack);
            let slack = exact.slack;
            let exact = oracle.changes(a);
            let magnitude = exact[0].value.hypot(exact[1].value);
            shift.add(error, magnitude, slack);
            let Some(exact) = expected_changes(view, t, a) else { continue };
            let magnitude = exact[0].value.hypot(exact[1].value);
            for (k, exact) in exact.into_iter().enumerate() {
                changes.add((found[8 + 2 * k + axis] - exact.value).abs(), magnitude, exact.slack);
            }
        }
    }
    errors
}

/// Changes of an attribute a pixel: differences within its quad. None where a pixel of the quad is so near the plane's horizon that first-order
/// slack says nothing.
fn expected_changes(view: &View, t: &Triangle, a: [f64; 3]) -> Option<[Exact; 2]> {
    let corner = t.pixel.map(|place| place & !1);
    let value = |x, y| {
        let of_quad = Oracle::new(view, &Triangle { pixel: [corner[0] + x, corner[1] + y], ..*t })?;
        (of_quad.sum_change < 0.25).then(|| of_quad.value(a, 0.0))
    };
    let first = value(0, 0)?;
    let from_first = |of: Exact| Exact { value: of.value - first.value, slack: of.slack + first.slack };
    Some([from_first(value(1, 0)?), from_first(value(0, 1)?)])
}

fn range(a: [f64; 3]) -> f64 {
    a.iter().copied().fold(f64::MIN, f64::max) - a.iter().copied().fold(f64::MAX, f64::min)
}

fn print(what: &str, errors: &ByClass) {
    for (class, errors) in CLASSES.iter().zip(errors) {
        for (attribute, e) in ATTRIBUTES.iter().zip(errors) {
            println!(
                "{what}, {class:?}, {attribute}: max {:.2e}, mean {:.2e}; of what rounding may do {:.3} and {:.4}",
                e.max,
                e.mean(),
                e.share_max,
                e.share_sum / e.count
            );
        }
    }
}

/// Largest share of what rounding may do, and largest mean share, of the attributes of a class.
fn shares(errors: &[Errors; ATTRIBUTES.len()]) -> (f64, f64) {
    let largest = |of: fn(&Errors) -> f64| errors.iter().map(of).fold(0.0, f64::max);
    (largest(|e| e.share_max), largest(|e| e.share_sum / e.count))
}

/// Equations 3 to 5 of the paper, for triangles in front of the eye: barycentric coordinates of projected vertices.
const BY_PROJECTED_VERTICES: (&str, &str) = (
    "return Basis(b * inverse_det, bx * (inverse_det * pixel_ndc.x), by * (inverse_det * pixel_ndc.y));",
    "vec2 s0 = c0.xy / c0.z, s1 = c1.xy / c1.z, s2 = c2.xy / c2.z;
    float inverse_d = 1.0 / cross2(s1 - s0, s2 - s0);
    vec3 dx = vec3(s1.y - s2.y, s2.y - s0.y, s0.y - s1.y) * inverse_d;
    vec3 dy = vec3(s2.x - s1.x, s0.x - s2.x, s1.x - s0.x) * inverse_d;
    vec3 at = vec3(1.0, 0.0, 0.0) + dx * (ndc.x - s0.x) + dy * (ndc.y - s0.y);
    return Basis(at / w, dx / w * pixel_ndc.x, dy / w * pixel_ndc.y);",
);
const ANCHOR_AT_CENTER: (&str, &str) =
    ("vec2 anchor = anchor_px(c0, c1, c2);", "vec2 anchor = vec2(frame.size_px / 2u);");
/// Without the mean of the vertices where rounding leaves nothing.
const NEVER_FLAT: (&str, &str) = ("!(abs(det) > ROUNDING * dot(lost, abs(w)))", "false");
const SIGN_SWAPPED: (&str, &str) = ("by * (inverse_det * pixel_ndc.y)", "by * (inverse_det * -pixel_ndc.y)");

/// Most that errors may be of what rounding may do, and most of their mean: measured 1.9 and 0.13 on lavapipe.
const MAX_SHARES: (f64, f64) = (3.0, 0.2);

fn agrees_with_f64(tangents: Tangents, draws: usize) {
    let gpu = afterlight_testkit::gpu();
    let view = View::new();
    let stage = Stage::new(&gpu, &view, draws, &CLASSES, tangents);
    let found = stage.errors(&[]);
    print(&format!("{tangents:?}"), &found);
    // The last attribute is the tangent.
    let attributes = ATTRIBUTES.len() - usize::from(tangents == Tangents::Derivatives);
    let least = 100.0 * draws as f64;
    for (class, errors) in CLASSES.iter().zip(&found) {
        let (max, mean) = shares(errors);
        assert!(max < MAX_SHARES.0, "{tangents:?}, {class:?}: {max} of what rounding may do");
        assert!(mean < MAX_SHARES.1, "{tangents:?}, {class:?}: {mean} of what rounding may do on average");
        assert!(errors[..attributes].iter().all(|e| e.count > least), "{tangents:?}, {class:?}");
    }
}

#[test]
fn attributes_of_a_million_triangles_agree_with_f64() {
    agrees_with_f64(Tangents::Derivatives, DRAWS);
}

/// Records that keep tangents, of a quarter of a million triangles.
#[test]
fn tangents_and_normals_of_vertices_agree_with_f64() {
    agrees_with_f64(Tangents::Vertices, DRAWS / 4);
}

/// Draws of [`sparse_bits`]: four blocks and a part of a fifth.
const SPARSE_DRAWS: usize = 130;

/// Bits of which whole blocks have none, and two others 640 each: at the ends of blocks and words, and at random.
fn sparse_bits() -> Vec<u32> {
    const WORDS_A_BLOCK: usize = 1024;
    let mut rng = SplitMix64::new(3);
    let mut bits = vec![0u32; SPARSE_DRAWS * DRAW_TRIANGLES / 32];
    for block in [1, 3] {
        let words = &mut bits[block * WORDS_A_BLOCK..][..WORDS_A_BLOCK];
        (words[0], words[7], words[WORDS_A_BLOCK - 1]) = (0x8000_0001, u32::MAX, 0xc000_0000);
        while words.iter().map(|w| w.count_ones()).sum::<u32>() < 640 {
            let place = (rng.next_u64() % (32 * WORDS_A_BLOCK as u64)) as usize;
            words[place / 32] |= 1 << (place % 32);
        }
    }
    bits
}

/// A record is found for each bit that is set, whatever bits are not: the place of a triangle and the triangle of a place.
#[test]
fn sparse_bits_lead_to_their_triangles() {
    let gpu = afterlight_testkit::gpu();
    let view = View::new();
    let stage = Stage::new(&gpu, &view, SPARSE_DRAWS, &[Class::Front], Tangents::Derivatives);
    let bits = sparse_bits();
    let is_set = |i: &usize| bits[i / 32] >> (i % 32) & 1 != 0;
    let all = stage.on_device(&[]);
    let expected: Vec<f32> =
        (0..stage.triangles.len()).filter(is_set).flat_map(|i| all[i * FOUND..][..FOUND].to_vec()).collect();
    assert_eq!(expected.len(), 1280 * FOUND);
    assert!(stage.on_device_of(&bits, &[]) == expected, "records of other triangles");
    // The triangle after the one that stands there.
    let off = [("visible_triangle(index)", "visible_triangle(index) ^ 1u")];
    assert!(stage.on_device_of(&bits, &off) != expected, "records of other triangles go unseen");
}

/// What the comparison sees: a sign, and the paper's extrapolation to the image's centre, which gives far and narrow triangles
/// another surface.
#[test]
fn other_records_are_caught() {
    let gpu = afterlight_testkit::gpu();
    let view = View::new();
    let stage = Stage::new(&gpu, &view, 64, &CLASSES, Tangents::Derivatives);
    let caught = |what: &str, mutant: &[(&str, &str)], classes: &[Class]| {
        let found = stage.errors(mutant);
        print(what, &found);
        for (class, errors) in CLASSES.iter().zip(&found).filter(|(class, _)| classes.contains(class)) {
            assert!(shares(errors).0 > MAX_SHARES.0, "{what}, {class:?} goes unseen");
        }
    };
    caught("a sign swapped", &[SIGN_SWAPPED], &CLASSES);
    let in_front = [Class::Front, Class::Sliver, Class::Far, Class::Grazing];
    caught("anchor at the centre", &[ANCHOR_AT_CENTER, NEVER_FLAT], &in_front);
    caught("the paper's", &[ANCHOR_AT_CENTER, BY_PROJECTED_VERTICES, NEVER_FLAT], &in_front);
    caught("projected vertices", &[BY_PROJECTED_VERTICES, NEVER_FLAT], &[]);
}

/// Triangles that show by chance alone give numbers; without the mean of their vertices some give none.
#[test]
fn triangles_edge_on_give_numbers() {
    let gpu = afterlight_testkit::gpu();
    let view = View::new();
    for tangents in [Tangents::Derivatives, Tangents::Vertices] {
        let stage = Stage::new(&gpu, &view, 8, &[Class::EdgeOn], tangents);
        let not_finite = |mutant| stage.on_device(mutant).iter().filter(|f| !f.is_finite()).count();
        assert_eq!(not_finite(&[]), 0);
        assert!(not_finite(&[NEVER_FLAT]) > 0, "infinite records go unseen");
    }
}

/// The derivative pass starts a thread for each triangle that shows, in whole groups, and counting a group for each 32 draws, whatever the
/// scene has besides.
#[test]
fn no_more_threads_start_than_triangles_show() {
    let gpu = afterlight_testkit::gpu();
    let stage = common::Stage::new(&gpu, "builtin:colonnade?triangles=60000");
    let draws = stage.uploaded.draw_count() as u64;
    for (id, samples) in [("dais", 1), ("dais-list", 4)] {
        let settings = Settings { samples, ..stage.settings((160, 90), 0) };
        let mut prepared = stage.prepare(find(id).expect("known"), &settings);
        let report = prepared.run_counted().unwrap_or_else(|e| panic!("{e}"));
        let counters = prepared.counters().unwrap_or_else(|e| panic!("{e}"));
        let shown = u64::from(counters.iter().find(|c| c.name == "triangles").expect("counted").needed);
        let threads = |pass: &str| {
            let pass = report.pass(&format!("{id}/{pass}")).unwrap_or_else(|| panic!("found no pass {pass}"));
            pass.statistics.map(|counted| counted.compute_invocations)
        };
        let Some(found) = threads("derivatives") else {
            let found = format!("{} counts no invocations", gpu.info().name);
            return afterlight_testkit::skip(afterlight_testkit::Need::Statistics, &found);
        };
        println!("{id}: {found} threads for {shown} triangles of {} draws", draws);
        assert!(shown > 500 && shown < stage.scene.triangle_count() / 2, "{id}: {shown} triangles show");
        assert_eq!(found, shown.next_multiple_of(128), "{id}");
        assert_eq!(threads("count"), Some(256 * draws.div_ceil(32)), "{id}");
        assert_eq!(threads("scan"), Some(256), "{id}");
    }
}
