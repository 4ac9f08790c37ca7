//! Every input of a material against its closed form (ladder step c): a glTF file made here, drawn by `forward`, against glTF 2.0,
//! section 3.9, and appendix B evaluated in f64 from the numbers in the file. The ray caster of `oracle` is held to the same, and
//! every technique to `forward`. For each input the shader is changed where it reads it, or the number in the file is: both must show.

mod common;

use afterlight_image::Rgba8Image;
use afterlight_oracle::{
    brdf::{self, Surface},
    raster::{RayScene, pixel_ray},
    tonemap::linear_from_srgb,
};
use afterlight_techniques::{
    Params, Settings, find, registry,
    scene::{Camera, Light, LightKind, Material, Projection, Scene},
    shader::Shader,
};
use common::{
    Stage, compiled_variant, image_of, least_db_of_four_lights, psnr,
    quads::{
        self, COLOR, EMISSION, METAL_ROUGH, NORMAL, OCCLUSION, Quad, REPEAT, Wrap, texel, texel_vector,
        texture, uv, vertex_color,
    },
    radiance_of,
};
use glam::{DVec2, DVec3, DVec4, Vec3};
use serde_json::{Value, json};

/// Width and height of the images, pixels: 2.5 pixels a texel and edge of the second set of coordinates at the least.
const SIZE: [u32; 2] = [60, 60];

/// Largest relative error without colour textures: 16-bit floats, which lavapipe cuts off instead of rounding (2^-10). Measured: 0.00092.
const TOLERANCE: f64 = 0.0012;

/// The same with them: a device may decode sRGB with an error of half a step of 8 bits. Measured on lavapipe: 0.0037.
const COLOR_TOLERANCE: f64 = 0.005;

/// The same where texels are blended: a device's weights have 8 bits. Measured: 0.0045.
const LINEAR_TOLERANCE: f64 = 0.006;

/// Largest relative error of the ray caster: normals and tangents are kept to 1.5e-4. Measured: 1e-5.
const RAYS_TOLERANCE: f64 = 2e-5;

/// What a mutant has to exceed, in tolerances.
const SEEN: f64 = 5.0;

/// What a place of a quad is, by glTF.
#[derive(Clone, Copy)]
struct Look {
    base: DVec3,
    /// Share of the pixel that shows the quad and not the background.
    alpha: f64,
    metallic: f64,
    roughness: f64,
    /// On the side that is seen.
    normal_ws: DVec3,
    occlusion: f64,
    emission: DVec3,
    unlit: bool,
}

/// That of [`plain`].
const PLAIN: Look = Look {
    base: DVec3::ONE,
    alpha: 1.0,
    metallic: 0.0,
    roughness: 0.6,
    normal_ws: DVec3::Z,
    occlusion: 1.0,
    emission: DVec3::ZERO,
    unlit: false,
};

/// A material with some properties beside a white base colour that is no metal.
fn plain(properties: Value) -> Value {
    merged(json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.6 } }), &properties)
}

fn merged(mut to: Value, from: &Value) -> Value {
    for (key, value) in from.as_object().into_iter().flatten() {
        let both = to[key].is_object() && value.is_object();
        to[key] = if both { merged(to[key].take(), value) } else { value.clone() };
    }
    to
}

/// One input, or several of a kind, of a material.
struct Input {
    name: &'static str,
    quad: Quad,
    /// By the place on the quad, metres from its centre; `None` where rounding decides.
    look: fn(DVec2) -> Option<Look>,
    eye_ws: Vec3,
    /// Largest relative error.
    tolerance: f64,
    /// Variant of the shader that draws it.
    shader: &'static str,
    /// Header, text in it, what stands there in the mutant.
    shader_mutants: Vec<[String; 3]>,
    /// Changed properties of the material.
    file_mutants: Vec<Value>,
}

const FORWARD: &str = "surfaces/depth_first/forward.frag";
const FORWARD_MASK: &str = "surfaces/depth_first/forward.frag#mask";
const BLEND: &str = "compose/transparent/blend.frag";

const BEFORE: Vec3 = Vec3::new(0.4, 0.3, 2.6);
const BEHIND: Vec3 = Vec3::new(0.4, 0.3, -2.6);

impl Input {
    fn new(name: &'static str, material: Value, look: fn(DVec2) -> Option<Look>) -> Self {
        let names = |texture: &str| material.to_string().contains(texture);
        let colors = names("baseColorTexture") || names("emissiveTexture");
        let tolerance = if colors { COLOR_TOLERANCE } else { TOLERANCE };
        let quad = Quad::new(material);
        Self {
            name,
            quad,
            look,
            eye_ws: BEFORE,
            tolerance,
            shader: FORWARD,
            shader_mutants: Vec::new(),
            file_mutants: Vec::new(),
        }
    }

    /// Adds a changed `material.glsl`.
    fn mutant(mut self, from: &str, to: &str) -> Self {
        self.shader_mutants.push(["material.glsl", from, to].map(str::to_owned));
        self
    }

    /// Adds a material with other properties.
    fn other(mut self, properties: Value) -> Self {
        self.file_mutants.push(properties);
        self
    }
}

/// sRGB colour and linear alpha of a texel, linear.
fn colors(texel: DVec4) -> DVec4 {
    let [r, g, b] = texel.truncate().to_array().map(linear_from_srgb);
    DVec4::new(r, g, b, texel.w)
}

/// A normal of the map in world space: x along `right`, y along `up`, scaled.
fn mapped(texel: DVec4, scale: f64, right: DVec3, up: DVec3) -> DVec3 {
    let n = texel_vector(texel);
    (scale * n.x * right + scale * n.y * up + n.z * DVec3::Z).normalize()
}

/// KHR_texture_transform: scale, then a turn counter-clockwise as one sees the image, whose v runs down, then offset.
fn transformed(uv: DVec2, t: ([f64; 2], f64, [f64; 2])) -> DVec2 {
    let (offset, rotation_rad, scale) = t;
    let p = uv * DVec2::from_array(scale);
    let (sin, cos) = rotation_rad.sin_cos();
    DVec2::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x) + DVec2::from_array(offset)
}

/// Transforms of the five textures, in the order of `quads`' images.
const TRANSFORMS: [([f64; 2], f64, [f64; 2]); 5] = [
    ([0.3, 0.15], 0.4, [1.25, 0.75]),
    ([-0.2, 0.4], -0.7, [0.9, 1.3]),
    ([0.05, -0.35], 1.9, [1.1, 0.8]),
    ([0.7, 0.6], 2.7, [-0.8, 1.2]),
    ([-0.45, 0.25], -1.3, [0.7, -0.9]),
];

fn with_transform(image: usize) -> Value {
    let (offset, rotation, scale) = TRANSFORMS[image];
    let transform = json!({ "offset": offset, "rotation": rotation, "scale": scale });
    merged(texture(image, REPEAT), &json!({ "extensions": { "KHR_texture_transform": transform } }))
}

fn factors() -> Input {
    let pbr = |factors: Value| json!({ "pbrMetallicRoughness": factors });
    let material = pbr(
        json!({ "baseColorFactor": [0.8, 0.5, 0.3, 1.0], "metallicFactor": 0.4, "roughnessFactor": 0.5 }),
    );
    let look = |_| Some(Look { base: DVec3::new(0.8, 0.5, 0.3), metallic: 0.4, roughness: 0.5, ..PLAIN });
    Input::new("factors", material, look)
        .mutant("color = m.base_color_factor;", "color = m.base_color_factor * vec4(1.0, 0.98, 1.0, 1.0);")
        .mutant("s.metallic = m.metallic_factor;", "s.metallic = 0.95 * m.metallic_factor;")
        .mutant("s.roughness = m.roughness_factor;", "s.roughness = 0.95 * m.roughness_factor;")
        .other(pbr(json!({ "baseColorFactor": [0.8, 0.5, 0.32, 1.0] })))
        .other(pbr(json!({ "metallicFactor": 0.38 })))
        .other(pbr(json!({ "roughnessFactor": 0.52 })))
}

/// glTF 2.0, section 5.19 and 5.22: white, a metal, rough.
fn defaults() -> Input {
    let look = |_| Some(Look { metallic: 1.0, roughness: 1.0, ..PLAIN });
    Input::new("defaults", json!({}), look)
        .other(json!({ "pbrMetallicRoughness": { "metallicFactor": 0.97 } }))
        .other(json!({ "pbrMetallicRoughness": { "roughnessFactor": 0.95 } }))
}

fn base_color_texture() -> Input {
    let material = plain(json!({ "pbrMetallicRoughness": {
        "baseColorFactor": [0.9, 0.8, 0.7, 1.0], "baseColorTexture": texture(COLOR, REPEAT) } }));
    let look = |at| {
        let texel = colors(texel(COLOR, uv(at)[0], REPEAT)?);
        Some(Look { base: DVec3::new(0.9, 0.8, 0.7) * texel.truncate(), ..PLAIN })
    };
    let sampled = "sample_srgb(m.base_color_slot, coordinates_for(p, m, m.base_color_slot, 0u))";
    Input::new("base colour texture", material, look)
        .mutant(sampled, &format!("{sampled}.grba"))
        .mutant(sampled, &format!("mix(vec4(1.0), {sampled}, 0.9)"))
        .other(json!({ "pbrMetallicRoughness": { "baseColorTexture": texture(EMISSION, REPEAT) } }))
}

fn metallic_roughness_texture() -> Input {
    let material = json!({ "pbrMetallicRoughness": {
        "metallicFactor": 0.9, "roughnessFactor": 0.95, "metallicRoughnessTexture": texture(METAL_ROUGH, REPEAT) } });
    let look = |at| {
        let texel = texel(METAL_ROUGH, uv(at)[0], REPEAT)?;
        Some(Look { metallic: 0.9 * texel.z, roughness: 0.95 * texel.y, ..PLAIN })
    };
    Input::new("metallic-roughness texture", material, look)
        .mutant("s.roughness *= orm.y;", "s.roughness *= orm.x;")
        .mutant("s.roughness *= orm.y;", "s.roughness *= mix(1.0, orm.y, 0.9);")
        .mutant("s.metallic *= orm.z;", "s.metallic *= orm.x;")
        .mutant("s.metallic *= orm.z;", "s.metallic *= mix(1.0, orm.z, 0.9);")
        .other(json!({ "pbrMetallicRoughness": { "metallicRoughnessTexture": texture(OCCLUSION, REPEAT) } }))
}

/// Mutants of the normal map that show wherever there is one.
fn with_normal_mutants(input: Input) -> Input {
    input
        .mutant("vec3 bitangent = p.tangent_ws.w", "vec3 bitangent = -p.tangent_ws.w")
        .mutant("m.normal_slot, 2u)) * 2.0 - 1.0", "m.normal_slot, 2u)).yx * 2.0 - 1.0")
        .mutant("xy *= m.normal_scale;", "xy *= 0.9 * m.normal_scale;")
}

fn normal_texture() -> Input {
    let material =
        plain(json!({ "normalTexture": merged(texture(NORMAL, REPEAT), &json!({ "scale": 0.7 })) }));
    let look = |at| {
        let normal_ws = mapped(texel(NORMAL, uv(at)[0], REPEAT)?, 0.7, DVec3::X, DVec3::Y);
        Some(Look { normal_ws, ..PLAIN })
    };
    with_normal_mutants(Input::new("normal texture", material, look))
        .mutant("+ z * p.normal_ws;", "+ p.normal_ws;")
        .other(json!({ "normalTexture": { "scale": 0.66 } }))
}

fn occlusion_texture() -> Input {
    let material =
        plain(json!({ "occlusionTexture": merged(texture(OCCLUSION, REPEAT), &json!({ "strength": 0.8 })) }));
    let look = |at| {
        let texel = texel(OCCLUSION, uv(at)[0], REPEAT)?;
        Some(Look { occlusion: 1.0 + 0.8 * (texel.x - 1.0), ..PLAIN })
    };
    Input::new("occlusion texture", material, look)
        .mutant("1.0 + m.occlusion_strength *", "1.0 + 0.9 * m.occlusion_strength *")
        .mutant("m.occlusion_slot, 3u)).x", "m.occlusion_slot, 3u)).y")
        .mutant("s.occlusion = 1.0 + ", "s.emission *= 1.0 + ")
        .other(json!({ "occlusionTexture": { "strength": 0.76 } }))
}

fn emission() -> Input {
    let material = plain(json!({
        "emissiveFactor": [0.2, 0.9, 0.1],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 6.0 } } }));
    let look = |_| Some(Look { emission: 6.0 * DVec3::new(0.2, 0.9, 0.1), ..PLAIN });
    Input::new("emission", material, look)
        .mutant("s.emission = m.emissive_factor;", "s.emission = 0.98 * m.emissive_factor;")
        .mutant("s.emission = m.emissive_factor;", "s.emission = min(m.emissive_factor, vec3(1.0));")
        .other(json!({ "emissiveFactor": [0.25, 0.9, 0.1] }))
        .other(json!({ "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 5.9 } } }))
}

fn emissive_texture() -> Input {
    let material =
        plain(json!({ "emissiveFactor": [1.0, 0.8, 0.6], "emissiveTexture": texture(EMISSION, REPEAT) }));
    let look = |at| {
        let texel = colors(texel(EMISSION, uv(at)[0], REPEAT)?);
        Some(Look { emission: DVec3::new(1.0, 0.8, 0.6) * texel.truncate(), ..PLAIN })
    };
    Input::new("emissive texture", material, look)
        .mutant("m.emissive_slot, 4u)).rgb", "m.emissive_slot, 4u)).brg")
        .mutant("s.emission *= sample_srgb", "s.emission *= 0.9 * sample_srgb")
        .other(json!({ "emissiveTexture": texture(COLOR, REPEAT) }))
}

/// A material of all five textures, and its look by the coordinates of each.
fn five_textures(of: fn(usize) -> Value) -> Value {
    json!({
        "pbrMetallicRoughness": { "baseColorTexture": of(COLOR), "metallicRoughnessTexture": of(METAL_ROUGH) },
        "normalTexture": of(NORMAL),
        "occlusionTexture": of(OCCLUSION),
        "emissiveFactor": [1.0, 1.0, 1.0],
        "emissiveTexture": of(EMISSION),
    })
}

fn look_of_five(uv_of: impl Fn(usize) -> DVec2, [right, up]: [DVec3; 2]) -> Option<Look> {
    let texel = |image| texel(image, uv_of(image), REPEAT);
    let metal_rough = texel(METAL_ROUGH)?;
    Some(Look {
        base: colors(texel(COLOR)?).truncate(),
        metallic: metal_rough.z,
        roughness: metal_rough.y,
        normal_ws: mapped(texel(NORMAL)?, 1.0, right, up),
        occlusion: texel(OCCLUSION)?.x,
        emission: colors(texel(EMISSION)?).truncate(),
        ..PLAIN
    })
}

/// Names of the five slots in `material.glsl`, in their order.
const SLOTS: [&str; 5] = ["base_color", "metallic_roughness", "normal", "occlusion", "emissive"];

fn texture_transforms() -> Input {
    let look = |at| look_of_five(|image| transformed(uv(at)[0], TRANSFORMS[image]), [DVec3::X, DVec3::Y]);
    let mut input = Input::new("texture transforms", five_textures(with_transform), look)
        .mutant("row0 = uv_transforms[(m.uv_transform + index) * 2u].xyz", "row0 = vec3(1.0, 0.0, 0.0)")
        .mutant("dot(row1, vec3(at.uv, 1.0))", "dot(row1, vec3(at.uv, 0.0))");
    for (place, slot) in SLOTS.iter().enumerate() {
        let other = (place + 1) % 5;
        input = input.mutant(&format!("m.{slot}_slot, {place}u)"), &format!("m.{slot}_slot, {other}u)"));
    }
    // One texture's transform left out of the file: the loader reads those of the maps of normals and occlusion on a way of their own.
    for property in ["normalTexture", "occlusionTexture", "emissiveTexture"] {
        input = input
            .other(json!({ property: { "extensions": { "KHR_texture_transform": { "rotation": 0.0 } } } }));
    }
    input
}

fn texture_coordinate_sets() -> Input {
    // The base colour's set is the transform's, which goes before its own.
    let on_second = |image| {
        let set = match image {
            COLOR => json!({ "texCoord": 0, "extensions": { "KHR_texture_transform": { "texCoord": 1 } } }),
            _ => json!({ "texCoord": 1 }),
        };
        merged(texture(image, REPEAT), &set)
    };
    // u runs up, so x of the map does; v runs right, so y of the map, which is up in the image, runs left.
    let look = |at| look_of_five(|_| uv(at)[1], [DVec3::Y, DVec3::NEG_X]);
    let mut input = Input::new("texture coordinate sets", five_textures(on_second), look)
        .mutant("(slot & (1u << 24)) != 0u", "false");
    for (place, slot) in SLOTS.iter().enumerate() {
        let on_first = format!("coordinates_for(p, m, m.{slot}_slot & ~(1u << 24), {place}u)");
        input = input.mutant(&format!("coordinates_for(p, m, m.{slot}_slot, {place}u)"), &on_first);
    }
    for property in ["normalTexture", "occlusionTexture", "emissiveTexture"] {
        input = input.other(json!({ property: { "texCoord": 0 } }));
    }
    input
}

fn vertex_colors() -> Input {
    let material = plain(json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.9, 0.8, 0.7, 1.0] } }));
    let look = |at| Some(Look { base: DVec3::new(0.9, 0.8, 0.7) * vertex_color(at).truncate(), ..PLAIN });
    let mut input = Input::new("vertex colours", material, look)
        .mutant("color *= p.color;", "color *= p.color.grba;")
        .mutant("color *= p.color;", "color *= mix(vec4(1.0), p.color, 0.98);");
    input.quad.colored = true;
    input
}

const BASE_WRAP: [Wrap; 2] = [Wrap::Mirror, Wrap::Clamp];
const DATA_WRAP: [Wrap; 2] = [Wrap::Clamp, Wrap::Repeat];
const EMISSION_WRAP: [Wrap; 2] = [Wrap::Repeat, Wrap::Mirror];
/// From [0, 1] to [-0.9, 1.9].
const WIDER: ([f64; 2], f64, [f64; 2]) = ([-0.9, -0.9], 0.0, [2.8, 2.8]);

fn wrap_modes() -> Input {
    let wrapped = |image, wrap| {
        let transform = json!({ "offset": WIDER.0, "scale": WIDER.2 });
        merged(texture(image, wrap), &json!({ "extensions": { "KHR_texture_transform": transform } }))
    };
    let base = |wrap| json!({ "pbrMetallicRoughness": { "baseColorTexture": wrapped(COLOR, wrap) } });
    let occlusion = |wrap| json!({ "occlusionTexture": wrapped(OCCLUSION, wrap) });
    let emission =
        |wrap| json!({ "emissiveFactor": [1.0, 1.0, 1.0], "emissiveTexture": wrapped(EMISSION, wrap) });
    let material = [occlusion(DATA_WRAP), emission(EMISSION_WRAP)].iter().fold(base(BASE_WRAP), merged);
    let look = |at| {
        let uv = transformed(uv(at)[0], WIDER);
        Some(Look {
            base: colors(texel(COLOR, uv, BASE_WRAP)?).truncate(),
            occlusion: texel(OCCLUSION, uv, DATA_WRAP)?.x,
            emission: colors(texel(EMISSION, uv, EMISSION_WRAP)?).truncate(),
            ..PLAIN
        })
    };
    let mut input = Input::new("wrap modes", plain(material), look)
        .mutant("vec3(at.uv, float(", "vec3(fract(at.uv), float(")
        .mutant("vec3(at.uv, float(", "vec3(clamp(at.uv, 0.0, 1.0), float(");
    for [u, v] in [[Wrap::Clamp, Wrap::Clamp], [Wrap::Mirror, Wrap::Mirror], [Wrap::Repeat, Wrap::Repeat]] {
        for other in [[u, BASE_WRAP[1]], [BASE_WRAP[0], v]].into_iter().filter(|w| *w != BASE_WRAP) {
            input = input.other(base(other));
        }
    }
    input.other(occlusion(REPEAT)).other(emission(REPEAT))
}

/// The blend of four texels whose centres surround a place (Vulkan 1.3, section 16.9.3).
fn linear(image: usize, uv: DVec2, wrap: [Wrap; 2]) -> Option<DVec4> {
    let place = uv * quads::IMAGE_SIZE as f64 - 0.5;
    let (first, t) = (place.floor(), place - place.floor());
    let at = |x: f64, y: f64| texel(image, (first + DVec2::new(x, y) + 0.5) / quads::IMAGE_SIZE as f64, wrap);
    let upper = at(0.0, 0.0)?.lerp(at(1.0, 0.0)?, t.x);
    Some(upper.lerp(at(0.0, 1.0)?.lerp(at(1.0, 1.0)?, t.x), t.y))
}

fn linear_filter() -> Input {
    let occlusion = |texture| plain(json!({ "occlusionTexture": texture }));
    let look = |at| Some(Look { occlusion: linear(OCCLUSION, uv(at)[0], REPEAT)?.x, ..PLAIN });
    let mut input = Input::new("a linear filter", occlusion(quads::linear_texture(OCCLUSION)), look)
        .mutant("vec3 uvw = vec3(at.uv, float(", "vec3 uvw = vec3(at.uv + 0.0625, float(")
        .other(occlusion(texture(OCCLUSION, REPEAT)));
    input.tolerance = LINEAR_TOLERANCE;
    input
}

fn double_sided() -> Input {
    let material = plain(json!({ "doubleSided": true, "normalTexture": texture(NORMAL, REPEAT) }));
    let look = |at| {
        let normal_ws = -mapped(texel(NORMAL, uv(at)[0], REPEAT)?, 1.0, DVec3::X, DVec3::Y);
        Some(Look { normal_ws, ..PLAIN })
    };
    let mut input = Input::new("double-sided from behind", material, look)
        .mutant("p.front_facing ? n : -n", "n")
        .mutant("p.front_facing ? n : -n", "p.front_facing ? n : n - 2.0 * dot(n, p.normal_ws) * p.normal_ws")
        .other(json!({ "doubleSided": false }));
    input.eye_ws = BEHIND;
    input
}

fn single_sided() -> Input {
    let look = |_| Some(Look { alpha: 0.0, ..PLAIN });
    let mut input =
        Input::new("single-sided from behind", plain(json!({})), look).other(json!({ "doubleSided": true }));
    input.eye_ws = BEHIND;
    input
}

fn mirrored() -> Input {
    let material = plain(json!({ "normalTexture": texture(NORMAL, REPEAT) }));
    // The place is the quad's own: what is right in the file is left in the world.
    let look = |at| {
        let normal_ws = mapped(texel(NORMAL, uv(at)[0], REPEAT)?, 1.0, DVec3::NEG_X, DVec3::Y);
        Some(Look { normal_ws, ..PLAIN })
    };
    let mut input = with_normal_mutants(Input::new("a mirrored normal map", material, look))
        .mutant("p.tangent_ws.w * cross", "abs(p.tangent_ws.w) * cross");
    input.quad.mirrored = true;
    input
}

fn alpha_properties() -> Value {
    plain(json!({ "pbrMetallicRoughness": {
        "baseColorFactor": [0.9, 0.8, 0.7, 0.95], "baseColorTexture": texture(COLOR, REPEAT) } }))
}

/// Base colour and alpha of [`alpha_properties`] on a coloured quad.
fn alpha_color(at: DVec2) -> Option<DVec4> {
    let texel = colors(texel(COLOR, uv(at)[0], REPEAT)?);
    Some(DVec4::new(0.9, 0.8, 0.7, 0.95) * texel * vertex_color(at))
}

fn masked(at: DVec2, cutoff: f64) -> Option<Look> {
    let color = alpha_color(at)?;
    let alpha = if color.w >= cutoff { 1.0 } else { 0.0 };
    ((color.w - cutoff).abs() > 1e-3).then_some(Look { base: color.truncate(), alpha, ..PLAIN })
}

fn alpha_cutoff() -> Input {
    let material = merged(alpha_properties(), &json!({ "alphaMode": "MASK", "alphaCutoff": 0.25 }));
    let mut input = Input::new("alpha cutoff", material, |at| masked(at, 0.25))
        .mutant("color *= p.color;", "color.rgb *= p.color.rgb;")
        .mutant("vec4 color = m.base_color_factor;", "vec4 color = vec4(m.base_color_factor.rgb, 1.2);")
        .mutant("m.base_color_slot, 0u));", "m.base_color_slot, 0u)); color.a = m.base_color_factor.a;")
        .other(json!({ "alphaCutoff": 0.28 }))
        .other(json!({ "alphaMode": "OPAQUE" }))
        .other(json!({ "alphaMode": "BLEND" }));
    let tested = ["surface_in.glsl", "base.a < m.alpha_cutoff", "base.a < 0.5"];
    input.shader_mutants.push(tested.map(str::to_owned));
    input.shader = FORWARD_MASK;
    input.quad.colored = true;
    input
}

/// glTF 2.0, section 5.19.10: the cutoff is 0.5 where none is given.
fn default_alpha_cutoff() -> Input {
    let material = merged(alpha_properties(), &json!({ "alphaMode": "MASK" }));
    let mut input = Input::new("alpha cutoff by default", material, |at| masked(at, 0.5))
        .other(json!({ "alphaCutoff": 0.4 }));
    input.shader = FORWARD_MASK;
    input.quad.colored = true;
    input
}

/// glTF 2.0, section 3.9.4: a cutoff above 1 leaves nothing.
fn cutoff_above_one() -> Input {
    let material = plain(json!({ "alphaMode": "MASK", "alphaCutoff": 1.5 }));
    let look = |_| Some(Look { alpha: 0.0, ..PLAIN });
    Input::new("alpha cutoff above 1", material, look).other(json!({ "alphaCutoff": 1.0 }))
}

fn blended() -> Input {
    let material = merged(alpha_properties(), &json!({ "alphaMode": "BLEND" }));
    let look = |at| {
        let color = alpha_color(at)?;
        Some(Look { base: color.truncate(), alpha: color.w, ..PLAIN })
    };
    let mut input = Input::new("blended", material, look)
        .mutant("color *= p.color;", "color.rgb *= p.color.rgb;")
        .mutant("vec4 color = m.base_color_factor;", "vec4 color = vec4(m.base_color_factor.rgb, 1.0);")
        .mutant("m.base_color_slot, 0u));", "m.base_color_slot, 0u)); color.a = m.base_color_factor.a;")
        .other(json!({ "alphaMode": "OPAQUE" }));
    input.shader = BLEND;
    input.quad.colored = true;
    input
}

/// glTF 2.0, section 3.9.4: alpha of an opaque material is ignored.
fn opaque() -> Input {
    let look = |at| {
        let color = alpha_color(at)?;
        Some(Look { base: color.truncate(), ..PLAIN })
    };
    let mut input = Input::new("alpha of an opaque material", alpha_properties(), look)
        .mutant(
            "vec4 color = m.base_color_factor;",
            "vec4 color = m.base_color_factor * m.base_color_factor.a;",
        )
        .other(json!({ "alphaMode": "BLEND" }));
    input.quad.colored = true;
    input
}

fn unlit() -> Input {
    let material = merged(
        alpha_properties(),
        &json!({ "emissiveFactor": [0.3, 0.2, 0.1], "extensions": { "KHR_materials_unlit": {} } }),
    );
    let look = |at| {
        let color = alpha_color(at)?;
        Some(Look { base: color.truncate(), unlit: true, ..PLAIN })
    };
    let mut input = Input::new("unlit", material, look)
        .mutant("s.unlit = (m.flags & MATERIAL_UNLIT) != 0u;", "s.unlit = false;")
        .other(json!({ "extensions": Value::Null }));
    input.quad.colored = true;
    input
}

fn inputs() -> Vec<Input> {
    vec![
        factors(),
        defaults(),
        base_color_texture(),
        metallic_roughness_texture(),
        normal_texture(),
        occlusion_texture(),
        emission(),
        emissive_texture(),
        texture_transforms(),
        texture_coordinate_sets(),
        vertex_colors(),
        wrap_modes(),
        linear_filter(),
        double_sided(),
        single_sided(),
        mirrored(),
        alpha_cutoff(),
        default_alpha_cutoff(),
        cutoff_above_one(),
        blended(),
        opaque(),
        unlit(),
    ]
}

/// Which of [`inputs`] a field of a material is held by. A new field does not compile until it is named here.
fn held_by(material: &Material) -> Vec<&'static str> {
    let Material {
        name: _,
        base_color_factor: _,
        base_color_texture: _,
        metallic_factor: _,
        roughness_factor: _,
        metallic_roughness_texture: _,
        normal_texture: _,
        normal_scale: _,
        occlusion_texture: _,
        occlusion_strength: _,
        emissive_factor: _,
        emissive_texture: _,
        alpha_mode: _,
        double_sided: _,
        unlit: _,
    } = material;
    vec![
        "factors",
        "base colour texture",
        "metallic-roughness texture",
        "normal texture",
        "occlusion texture",
        "emission",
        "emissive texture",
        "alpha cutoff",
        "blended",
        "alpha of an opaque material",
        "double-sided from behind",
        "single-sided from behind",
        "unlit",
    ]
}

#[test]
fn every_field_of_a_material_has_an_input() {
    let names: Vec<&str> = inputs().iter().map(|input| input.name).collect();
    for field in held_by(&Material::default()) {
        assert!(names.contains(&field), "{field}: found none, expected one of {names:?}");
    }
}

/// A sun and a lamp, both to the side, to either side of the plane: normals, roughness and metalness all show. Ambient light is about
/// as bright, so that occlusion shows as well.
fn settings(stage: &Stage, eye_ws: Vec3, size_px: [u32; 2]) -> Settings {
    let mut settings = stage.settings((size_px[0], size_px[1]), 0);
    settings.camera = Camera::look_at("view", eye_ws, Vec3::ZERO, 0.9, 0.1);
    let side = eye_ws.z.signum();
    let sun = Light {
        kind: LightKind::Directional,
        position_ws: Vec3::ZERO,
        direction_ws: Vec3::new(0.5, -0.4, -side).normalize(),
        intensity: Vec3::new(1.0, 1.1, 1.2),
        range_m: f32::INFINITY,
    };
    let position_ws = Vec3::new(-0.9, 1.1, 0.9 * side);
    let lamp = Light { kind: LightKind::Point, position_ws, intensity: Vec3::new(1.2, 1.0, 0.8), ..sun };
    settings.lights = vec![sun, lamp];
    settings.environment.ambient_radiance = Vec3::new(0.5, 0.45, 0.4);
    settings.environment.background_radiance = Vec3::new(0.3, 0.6, 0.9);
    settings
}

/// Radiance of the pixels whose place is on the quad and not at its edge, or beside it.
fn closed_form(input: &Input, settings: &Settings) -> Vec<Option<DVec3>> {
    let background = settings.environment.background_radiance.as_dvec3();
    let ambient = settings.environment.ambient_radiance.as_dvec3();
    let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]));
    pixels
        .map(|pixel| {
            let ray = pixel_ray(&settings.camera, pixel, SIZE);
            let position_ws = ray.origin_ws - ray.direction_ws * (ray.origin_ws.z / ray.direction_ws.z);
            let from_edge = 1.0 - position_ws.truncate().abs().max_element();
            if from_edge < 0.02 {
                return (from_edge < -0.02).then_some(background);
            }
            let mirror = if input.quad.mirrored { -1.0 } else { 1.0 };
            let look = (input.look)(DVec2::new(mirror * position_ws.x, position_ws.y))?;
            let surface = Surface {
                position_ws,
                normal_ws: look.normal_ws,
                base_color: look.base,
                metallic: look.metallic,
                roughness: look.roughness,
                occlusion: look.occlusion,
                emission: look.emission,
                unlit: look.unlit,
            };
            let to_eye = -ray.direction_ws.normalize();
            let radiance = brdf::shade(&surface, to_eye, &settings.lights, ambient);
            Some(look.alpha * radiance + (1.0 - look.alpha) * background)
        })
        .collect()
}

/// Largest relative error of the pixels that have a closed form.
fn worst(found: impl IntoIterator<Item = DVec3>, expected: &[Option<DVec3>]) -> f64 {
    let errors = found.into_iter().zip(expected).filter_map(|(found, expected)| {
        let expected = (*expected)?;
        Some((found - expected).abs().max_element() / (expected.max_element() + 0.05))
    });
    errors.fold(0.0, |worst, error| if error.is_nan() { f64::INFINITY } else { worst.max(error) })
}

fn drawn(stage: &Stage, settings: &Settings, shader: Option<Shader>) -> Vec<DVec3> {
    let settings = Settings { keep_hdr: true, ..settings.clone() };
    let forward = find("forward").expect("a technique");
    let image = radiance_of(&mut stage.prepare_shaders(forward, &settings, &Params::default(), shader));
    image.iter().map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into())).collect()
}

/// The same by rays, in f64.
fn cast(scene: Scene, settings: &Settings) -> Vec<DVec3> {
    let mut scene = quads::with_pixels(scene);
    scene.environment = settings.environment;
    let rays = RayScene::new(&scene);
    let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]));
    pixels.map(|pixel| rays.shade_pixel(&settings.lights, &settings.camera, pixel, SIZE)).collect()
}

#[test]
fn every_input_is_its_closed_form() {
    let gpu = afterlight_testkit::gpu();
    let mut wrong = Vec::new();
    for input in inputs() {
        let scene = quads::load(std::slice::from_ref(&input.quad));
        let stage = Stage::of(&gpu, scene.clone());
        let settings = settings(&stage, input.eye_ws, SIZE);
        let expected = closed_form(&input, &settings);
        let compared = expected.iter().flatten().count();
        assert!(compared > 1500, "{}: {compared} pixels have a closed form", input.name);
        let by_device = worst(drawn(&stage, &settings, None), &expected);
        let by_rays = worst(cast(scene, &settings), &expected);
        println!("{}: {compared} pixels, relative error {by_device:.5}, of rays {by_rays:.6}", input.name);
        if !(by_device <= input.tolerance && by_rays <= RAYS_TOLERANCE) {
            wrong.push(format!("{}: forward {by_device:.5}, rays {by_rays:.5}", input.name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_changed_shader_shows() {
    let gpu = afterlight_testkit::gpu();
    let mut unseen = Vec::new();
    for input in inputs().iter().filter(|input| !input.shader_mutants.is_empty()) {
        let stage = Stage::of(&gpu, quads::load(std::slice::from_ref(&input.quad)));
        let settings = settings(&stage, input.eye_ws, SIZE);
        let expected = closed_form(input, &settings);
        for [header, from, to] in &input.shader_mutants {
            let mutant = compiled_variant(input.shader, header, &[(from, to)]);
            let error = worst(drawn(&stage, &settings, Some(mutant)), &expected);
            println!("{}: {to} for {from}: {error:.4}", input.name);
            if error <= SEEN * input.tolerance {
                unseen.push(format!("{}: {to} for {from}: {error:.5}", input.name));
            }
        }
    }
    assert!(unseen.is_empty(), "mutants that no pixel shows:\n{}", unseen.join("\n"));
}

#[test]
fn a_changed_file_shows() {
    let gpu = afterlight_testkit::gpu();
    let mut unseen = Vec::new();
    for input in inputs() {
        for properties in &input.file_mutants {
            let material = merged(input.quad.material.clone(), properties);
            let stage = Stage::of(&gpu, quads::load(&[Quad { material, ..input.quad.clone() }]));
            let settings = settings(&stage, input.eye_ws, SIZE);
            let error = worst(drawn(&stage, &settings, None), &closed_form(&input, &settings));
            println!("{}: {properties}: {error:.4}", input.name);
            if error <= SEEN * input.tolerance {
                unseen.push(format!("{}: {properties}: {error:.5}", input.name));
            }
        }
    }
    assert!(unseen.is_empty(), "changes that no pixel shows:\n{}", unseen.join("\n"));
}

/// The inputs that are seen from before in one scene, each a quad in a cell of the image.
struct Sheet {
    stage: Stage,
    settings: Settings,
    inputs: Vec<Input>,
}

impl Sheet {
    /// Cells side by side.
    const ACROSS: usize = 5;
    /// Width and height of a cell, pixels.
    const CELL_PX: usize = 24;
    /// Distance of the centres of quads, m.
    const STEP_M: f32 = 2.4;
    /// Distance of the eye, m.
    const EYE_M: f32 = 10.0;

    fn new(gpu: &afterlight_techniques::graph::gpu::Device) -> Self {
        let inputs: Vec<Input> = inputs().into_iter().filter(|input| input.eye_ws == BEFORE).collect();
        let down = inputs.len().div_ceil(Self::ACROSS);
        let from_middle = |i: usize, count: usize| Self::STEP_M * (i as f32 - 0.5 * (count as f32 - 1.0));
        let placed = |(i, input): (usize, &Input)| {
            let (x, y) = (from_middle(i % Self::ACROSS, Self::ACROSS), -from_middle(i / Self::ACROSS, down));
            Quad { center: [x, y], ..input.quad.clone() }
        };
        let quads: Vec<Quad> = inputs.iter().enumerate().map(placed).collect();
        let stage = Stage::of(gpu, quads::load(&quads));
        assert!(stage.uploaded.warnings.is_empty(), "{:?}", stage.uploaded.warnings);
        let size_px = [Self::ACROSS, down].map(|cells| (cells * Self::CELL_PX) as u32);
        let mut settings = settings(&stage, Vec3::new(0.0, 0.0, Self::EYE_M), size_px);
        let half_height_m = 0.5 * Self::STEP_M * down as f32;
        settings.camera.projection =
            Projection::Perspective { fov_y_rad: 2.0 * (half_height_m / Self::EYE_M).atan(), near_m: 0.1 };
        // The lamp reaches every quad.
        settings.lights[1].intensity *= 20.0;
        settings.lights[1].position_ws.z = 4.0;
        Self { stage, settings, inputs }
    }

    /// PSNR of each cell, dB, with the name of its input.
    fn compared(&self, reference: &Rgba8Image, image: &Rgba8Image) -> Vec<(&'static str, f64)> {
        let cell = |image: &Rgba8Image, i: usize| {
            let start = |y: usize| 4 * (y * image.width as usize + i % Self::ACROSS * Self::CELL_PX);
            let rows = (i / Self::ACROSS * Self::CELL_PX..).take(Self::CELL_PX);
            let pixels = rows.flat_map(|y| image.pixels[start(y)..][..4 * Self::CELL_PX].to_vec()).collect();
            Rgba8Image { width: Self::CELL_PX as u32, height: Self::CELL_PX as u32, pixels }
        };
        let cells = self.inputs.iter().enumerate();
        cells.map(|(i, input)| (input.name, psnr(&cell(reference, i), &cell(image, i)))).collect()
    }
}

/// Each quad is compared on its own, so that no wrong one hides among many that are right.
#[test]
fn every_technique_shows_every_input() {
    let gpu = afterlight_testkit::gpu();
    let sheet = Sheet::new(&gpu);
    let forward = find("forward").expect("a technique");
    let mut wrong = Vec::new();
    for samples in [1, 4] {
        let settings = Settings { samples, ..sheet.settings.clone() };
        let reference = sheet.stage.image(forward, &settings);
        for technique in registry().iter().filter(|t| t.info().samples.contains(&samples)) {
            let info = technique.info();
            let least_db = least_db_of_four_lights(*technique, &Params::default(), samples);
            let cells = sheet.compared(&reference, &sheet.stage.image(*technique, &settings));
            let least = cells.iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("inputs");
            println!("{}, {samples} samples: at least {:.2} dB, of {}", info.id, least.1, least.0);
            for (name, db) in cells.iter().filter(|cell| cell.1 < least_db) {
                wrong.push(format!("{}, {samples} samples: {name}: {db:.2} dB to forward", info.id));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The mutants of the test above: a G-buffer that loses a part of one input is seen in that input's cell.
#[test]
fn a_technique_that_reads_an_input_wrongly_is_seen() {
    let gpu = afterlight_testkit::gpu();
    let sheet = Sheet::new(&gpu);
    let forward = sheet.stage.image(find("forward").expect("a technique"), &sheet.settings);
    for (name, from, to) in [
        ("occlusion texture", "1.0 + m.occlusion_strength *", "1.0 + 0.9 * m.occlusion_strength *"),
        ("metallic-roughness texture", "s.roughness *= orm.y;", "s.roughness *= mix(1.0, orm.y, 0.9);"),
        ("metallic-roughness texture", "s.metallic *= orm.z;", "s.metallic *= mix(1.0, orm.z, 0.9);"),
        ("normal texture", "xy *= m.normal_scale;", "xy *= 0.8 * m.normal_scale;"),
        ("emission", "s.emission = m.emissive_factor;", "s.emission = 0.9 * m.emissive_factor;"),
        ("emissive texture", "s.emission *= sample_srgb", "s.emission *= 0.9 * sample_srgb"),
        ("vertex colours", "color *= p.color;", "color *= mix(vec4(1.0), p.color, 0.9);"),
        ("texture coordinate sets", "m.occlusion_slot, 3u)", "m.occlusion_slot & ~(1u << 24), 3u)"),
        ("texture transforms", "m.emissive_slot, 4u)", "m.emissive_slot, 3u)"),
    ] {
        let shader = "surfaces/gbuffer/gbuffer.frag";
        let mutant = compiled_variant(shader, "material.glsl", &[(from, to)]);
        let deferred = find("deferred").expect("a technique");
        let mut prepared =
            sheet.stage.prepare_shaders(deferred, &sheet.settings, &Params::default(), [mutant]);
        let cells = sheet.compared(&forward, &image_of(&mut prepared));
        let (_, db) = cells.iter().find(|cell| cell.0 == name).expect("a cell");
        println!("{name}: {to} for {from}: {db:.2} dB");
        assert!(*db < 50.0, "{name}: {to} for {from} goes unseen: {db:.2} dB");
    }
}
