//! Quads in the plane z = 0, each with a material of its own, as a glTF file made by a test, and what is known of them without a
//! loader: texture coordinates and colours at a place, texels.

use std::path::Path;

use afterlight_image::{Rgba8Image, encode_png};
use afterlight_techniques::scene::{LoadOptions, Scene, load_bytes, rng::SplitMix64};
use glam::{DVec2, DVec3, DVec4};
use serde_json::{Value, json};

/// Width and height of every image, texels.
pub const IMAGE_SIZE: usize = 4;

/// Images of every file, by their index in it.
pub const COLOR: usize = 0;
pub const METAL_ROUGH: usize = 1;
pub const NORMAL: usize = 2;
pub const OCCLUSION: usize = 3;
pub const EMISSION: usize = 4;
const IMAGE_COUNT: usize = 5;

/// How a texture is wrapped along one axis: glTF's name and number, and the texel in [0, size) of any whole one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

impl Wrap {
    fn gltf(self) -> u32 {
        match self {
            Self::Repeat => 10497,
            Self::Mirror => 33648,
            Self::Clamp => 33071,
        }
    }

    fn texel(self, i: i64) -> usize {
        let n = IMAGE_SIZE as i64;
        let i = match self {
            Self::Repeat => i.rem_euclid(n),
            Self::Mirror if i.div_euclid(n).rem_euclid(2) == 1 => n - 1 - i.rem_euclid(n),
            Self::Mirror => i.rem_euclid(n),
            Self::Clamp => i.clamp(0, n - 1),
        };
        i as usize
    }
}

/// Eight bytes at random.
fn random_bytes(seed: u64) -> [u8; 8] {
    SplitMix64::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)).next_u64().to_le_bytes()
}

/// Texels that no two channels and no two images share. Those of the normal map are vectors up to 45° off the axis, of length 1 to within
/// 2e-5 (three bytes come no nearer than 1.5e-5), so that it does not matter whether one reads z or finds it from x and y.
pub fn texel_bytes(image: usize, x: usize, y: usize) -> [u8; 4] {
    let place = ((image * IMAGE_SIZE + y) * IMAGE_SIZE + x) as u64;
    if image != NORMAL {
        let [r, g, b, a, ..] = random_bytes(place);
        return [r, g, b, a];
    }
    let texels = (0..1 << 16).map(|attempt: u64| {
        let [r, g, a, ..] = random_bytes(place + (attempt << 32));
        let xy = DVec2::new(f64::from(r / 2 + 64), f64::from(g / 2 + 64)) / 127.5 - 1.0;
        let z = ((1.0 + (1.0 - xy.length_squared()).sqrt()) * 127.5).round();
        [r / 2 + 64, g / 2 + 64, z as u8, a]
    });
    let vector = |t: [u8; 4]| DVec3::new(t[0].into(), t[1].into(), t[2].into()) / 127.5 - 1.0;
    let mut unit = texels.filter(|texel| (vector(*texel).length() - 1.0).abs() < 2e-5);
    unit.next().expect("about one attempt in fifty")
}

/// The nearest texel at coordinates, channels in [0, 1] as the file has them; `None` near the edges of texels, where rounding decides.
pub fn texel(image: usize, uv: DVec2, wrap: [Wrap; 2]) -> Option<DVec4> {
    let place = uv * IMAGE_SIZE as f64;
    let to_edge = (place - place.round()).abs();
    let [x, y] = [wrap[0].texel(place.x.floor() as i64), wrap[1].texel(place.y.floor() as i64)];
    (to_edge.min_element() > 0.01)
        .then(|| DVec4::from_array(texel_bytes(image, x, y).map(|b| f64::from(b) / 255.0)))
}

/// The vector of a texel of the normal map.
pub fn texel_vector(texel: DVec4) -> DVec3 {
    texel.truncate() * 2.0 - 1.0
}

/// A texture with a sampler of nearest texels, as materials name it.
pub fn texture(image: usize, wrap: [Wrap; 2]) -> Value {
    let place = |w: Wrap| WRAPS.iter().position(|x| *x == w).expect("one of three");
    json!({ "index": image * 9 + place(wrap[0]) * 3 + place(wrap[1]) })
}

/// A texture with glTF's default sampler: linear and repeated.
pub fn linear_texture(image: usize) -> Value {
    json!({ "index": 9 * IMAGE_COUNT + image })
}

/// Repeats along both axes, as glTF does by default.
pub const REPEAT: [Wrap; 2] = [Wrap::Repeat; 2];

/// A quad of 2 × 2 m about a centre, its front towards +z.
#[derive(Clone)]
pub struct Quad {
    pub material: Value,
    pub center: [f32; 2],
    /// Whether its corners have colours: see [`vertex_color`].
    pub colored: bool,
    /// Whether its node mirrors it along x.
    pub mirrored: bool,
}

impl Quad {
    /// A quad at the origin, without colours.
    pub fn new(material: Value) -> Self {
        Self { material, center: [0.0; 2], colored: false, mirrored: false }
    }
}

/// Texture coordinates of a place of a quad, in metres from its centre along its own axes. The first set runs right and down, as images
/// do; the second is turned and reaches beyond [0, 1].
pub fn uv(place_os: DVec2) -> [DVec2; 2] {
    let DVec2 { x, y } = place_os;
    [DVec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y), DVec2::new(0.25 + 0.75 * y, 0.5 + 0.625 * x)]
}

/// Linear colour of a place of a coloured quad, an affine function of it, so that it does not matter how the quad is cut in triangles.
pub fn vertex_color(place_os: DVec2) -> DVec4 {
    let of = |at: f64, x: f64, y: f64| (at + x * place_os.x + y * place_os.y) / 255.0;
    DVec4::new(of(150.0, 100.0, 0.0), of(128.0, -30.0, 90.0), of(100.0, 20.0, -70.0), of(140.0, 60.0, 50.0))
}

/// The glTF file of some quads, binary.
pub fn glb(quads: &[Quad]) -> Vec<u8> {
    let mut bin = Vec::new();
    let mut views = Vec::new();
    let mut add = |bytes: &[u8]| {
        bin.resize(bin.len().next_multiple_of(4), 0);
        views.push(json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len() }));
        bin.extend_from_slice(bytes);
        views.len() - 1
    };
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(DVec2::from_array);
    let floats =
        |values: Vec<f64>| -> Vec<u8> { values.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect() };
    let uvs = |set: usize| floats(corners.iter().flat_map(|c| uv(*c)[set].to_array()).collect());
    let colors = corners
        .iter()
        .flat_map(|c| vertex_color(*c).to_array().map(|v| (v * 255.0).round() as u8))
        .collect::<Vec<_>>();
    let accessors = [
        ("VEC3", 5126, 4, add(&floats(corners.iter().flat_map(|c| [c.x, c.y, 0.0]).collect()))),
        ("VEC3", 5126, 4, add(&floats(vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]))),
        ("VEC2", 5126, 4, add(&uvs(0))),
        ("VEC2", 5126, 4, add(&uvs(1))),
        ("VEC4", 5121, 4, add(&colors)),
        ("SCALAR", 5121, 6, add(&[0, 1, 2, 0, 2, 3])),
    ];
    let accessors: Vec<Value> = accessors
        .into_iter()
        .map(|(shape, component, count, view)| {
            let mut accessor =
                json!({ "bufferView": view, "componentType": component, "count": count, "type": shape });
            if component == 5121 && shape == "VEC4" {
                accessor["normalized"] = json!(true);
            }
            accessor
        })
        .collect();
    let images: Vec<Value> =
        (0..IMAGE_COUNT).map(|i| json!({ "bufferView": add(&png(i)), "mimeType": "image/png" })).collect();

    let samplers: Vec<Value> = (0..9)
        .map(|i| json!({ "magFilter": 9728, "minFilter": 9728, "wrapS": WRAPS[i / 3].gltf(), "wrapT": WRAPS[i % 3].gltf() }))
        .collect();
    let nearest = (0..9 * IMAGE_COUNT).map(|i| json!({ "source": i / 9, "sampler": i % 9 }));
    let linear = (0..IMAGE_COUNT).map(|i| json!({ "source": i }));
    let textures: Vec<Value> = nearest.chain(linear).collect();
    let mesh = |(i, quad): (usize, &Quad)| {
        let mut attributes = json!({ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TEXCOORD_1": 3 });
        if quad.colored {
            attributes["COLOR_0"] = json!(4);
        }
        json!({ "primitives": [{ "attributes": attributes, "indices": 5, "material": i }] })
    };
    let node = |(i, quad): (usize, &Quad)| {
        let [x, y] = quad.center;
        json!({ "mesh": i, "translation": [x, y, 0.0], "scale": [if quad.mirrored { -1.0 } else { 1.0 }, 1.0, 1.0] })
    };
    let document = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_texture_transform", "KHR_materials_emissive_strength", "KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{ "nodes": (0..quads.len()).collect::<Vec<_>>() }],
        "nodes": quads.iter().enumerate().map(node).collect::<Vec<_>>(),
        "meshes": quads.iter().enumerate().map(mesh).collect::<Vec<_>>(),
        "materials": quads.iter().map(|quad| quad.material.clone()).collect::<Vec<_>>(),
        "textures": textures,
        "samplers": samplers,
        "images": images,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": bin.len() }],
    });
    binary(&document, bin)
}

fn pixels(image: usize) -> Vec<u8> {
    let places = (0..IMAGE_SIZE).flat_map(|y| (0..IMAGE_SIZE).map(move |x| (x, y)));
    places.flat_map(|(x, y)| texel_bytes(image, x, y)).collect()
}

fn png(image: usize) -> Vec<u8> {
    let size = IMAGE_SIZE as u32;
    let image = Rgba8Image { width: size, height: size, pixels: pixels(image) };
    encode_png(&image).unwrap_or_else(|e| panic!("{e}"))
}

/// Header, JSON, binary chunk (glTF 2.0, section 4.4).
pub fn binary(document: &Value, mut bin: Vec<u8>) -> Vec<u8> {
    let mut text = serde_json::to_vec(document).expect("JSON");
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((12 + 8 + text.len() as u32 + 8 + bin.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bin)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

/// Loads the file of some quads.
pub fn load(quads: &[Quad]) -> Scene {
    let scene = load_bytes(Path::new("quads.glb"), &glb(quads), &LoadOptions::default());
    let scene = scene.unwrap_or_else(|e| panic!("{e}"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene
}

/// The scene with its images as pixels, which the ray caster reads; it does not decode files.
pub fn with_pixels(mut scene: Scene) -> Scene {
    use afterlight_techniques::scene::ImageData;
    for image in &mut scene.images {
        let digits: String = image.name.chars().filter(char::is_ascii_digit).collect();
        let index: usize = digits.parse().unwrap_or_else(|_| panic!("{}: expected images[N]", image.name));
        let size = IMAGE_SIZE as u32;
        image.data = ImageData::Rgba8 { width: size, height: size, pixels: pixels(index).into() };
    }
    scene
}
