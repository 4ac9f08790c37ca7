//! Materials, textures, samplers and images.

use std::{collections::BTreeMap, path::Path, sync::Arc};

use gltf::json::{
    self, Index, Root, Value,
    extensions::texture::TextureTransform,
    material::AlphaMode as JsonAlphaMode,
    texture::{MagFilter, MinFilter, WrappingMode},
    validation::Checked,
};
use rayon::prelude::*;
use serde::Deserialize;

use super::{accessor::Accessors, buffers::decode_data_uri};
use crate::{
    AlphaMode, Image, ImageData, Material, MipMode, Sampler, SceneError, TextureRef, Wrap, load, texture,
};

/// What the materials of a file become.
pub(super) struct Materials {
    pub(super) materials: Vec<Material>,
    pub(super) images: Vec<Image>,
}

/// One use of a texture in a material, before its image has its place in the scene.
struct Use<'a> {
    texture: Index<json::Texture>,
    tex_coord: u32,
    transform: Option<TextureTransform>,
    at: &'a str,
}

/// Converts all materials and the images that they use.
pub(super) fn convert(
    accessors: &Accessors,
    root: &Root,
    warnings: &mut Vec<String>,
) -> Result<Materials, SceneError> {
    let mut converter = Converter { file: accessors.file, root, used: BTreeMap::new(), warnings };
    let materials = root
        .materials
        .iter()
        .enumerate()
        .map(|(i, m)| converter.material(i, m))
        .collect::<Result<Vec<_>, _>>()?;
    let used = converter.used;
    // images keep the file's order, whatever the order in which materials name them
    let order: BTreeMap<usize, u32> = used.keys().copied().zip(0..).collect();
    let images = used.keys().copied().collect::<Vec<_>>();
    let images =
        images.par_iter().map(|&i| convert_image(accessors, root, i)).collect::<Result<Vec<_>, _>>()?;
    let mut materials = materials;
    for material in &mut materials {
        for texture in textures_mut(material) {
            texture.image = order.get(&(texture.image as usize)).copied().unwrap_or(0);
        }
    }
    Ok(Materials { materials, images })
}

fn textures_mut(m: &mut Material) -> impl Iterator<Item = &mut TextureRef> {
    [
        &mut m.base_color_texture,
        &mut m.metallic_roughness_texture,
        &mut m.normal_texture,
        &mut m.occlusion_texture,
        &mut m.emissive_texture,
    ]
    .into_iter()
    .flatten()
}

struct Converter<'a> {
    file: &'a Path,
    root: &'a Root,
    /// Indices of the images in use.
    used: BTreeMap<usize, ()>,
    warnings: &'a mut Vec<String>,
}

impl Converter<'_> {
    fn material(&mut self, index: usize, m: &json::Material) -> Result<Material, SceneError> {
        let at = format!("materials[{index}]");
        let pbr = &m.pbr_metallic_roughness;
        let extensions = m.extensions.as_ref();
        let strength =
            extensions.and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |s| s.emissive_strength.0);
        let alpha_mode = match m.alpha_mode {
            Checked::Valid(JsonAlphaMode::Opaque) => AlphaMode::Opaque,
            Checked::Valid(JsonAlphaMode::Mask) => {
                AlphaMode::Mask { cutoff: m.alpha_cutoff.map_or(0.5, |c| c.0) }
            }
            Checked::Valid(JsonAlphaMode::Blend) => AlphaMode::Blend,
            Checked::Invalid => {
                let expected = "OPAQUE, MASK or BLEND";
                return Err(SceneError::invalid(
                    self.file,
                    format!("{at}.alphaMode"),
                    "an unknown name",
                    expected,
                ));
            }
        };
        let material = Material {
            name: m.name.clone().unwrap_or_else(|| at.clone()),
            base_color_factor: pbr.base_color_factor.0,
            base_color_texture: self.info(&at, "baseColorTexture", pbr.base_color_texture.as_ref())?,
            metallic_factor: pbr.metallic_factor.0,
            roughness_factor: pbr.roughness_factor.0,
            metallic_roughness_texture: self.info(
                &at,
                "metallicRoughnessTexture",
                pbr.metallic_roughness_texture.as_ref(),
            )?,
            normal_texture: match &m.normal_texture {
                None => None,
                Some(t) => {
                    let others = t.extensions.as_ref().and_then(|e| e.others.get(TRANSFORM));
                    let transform = self.transform(&at, others)?;
                    self.texture(
                        &at,
                        Use { texture: t.index, tex_coord: t.tex_coord, transform, at: "normalTexture" },
                    )?
                }
            },
            normal_scale: m.normal_texture.as_ref().map_or(1.0, |t| t.scale),
            occlusion_texture: match &m.occlusion_texture {
                None => None,
                Some(t) => {
                    let others = t.extensions.as_ref().and_then(|e| e.others.get(TRANSFORM));
                    let transform = self.transform(&at, others)?;
                    self.texture(
                        &at,
                        Use { texture: t.index, tex_coord: t.tex_coord, transform, at: "occlusionTexture" },
                    )?
                }
            },
            occlusion_strength: m.occlusion_texture.as_ref().map_or(1.0, |t| t.strength.0),
            emissive_factor: m.emissive_factor.0.map(|c| c * strength),
            emissive_texture: self.info(&at, "emissiveTexture", m.emissive_texture.as_ref())?,
            alpha_mode,
            double_sided: m.double_sided,
            unlit: extensions.is_some_and(|e| e.unlit.is_some()),
        };
        self.check_factors(&at, &material)?;
        Ok(material)
    }

    fn check_factors(&self, at: &str, m: &Material) -> Result<(), SceneError> {
        let cutoff = if let AlphaMode::Mask { cutoff } = m.alpha_mode { cutoff } else { 0.0 };
        let unit = m.base_color_factor.iter().chain([
            &m.metallic_factor,
            &m.roughness_factor,
            &m.occlusion_strength,
        ]);
        if let Some(bad) = unit.into_iter().find(|f| !(0.0..=1.0).contains(*f)) {
            return Err(SceneError::invalid(self.file, at, format!("the factor {bad}"), "0 to 1"));
        }
        let bad_emission = m.emissive_factor.iter().find(|f| !(f.is_finite() && **f >= 0.0));
        if let Some(bad) = bad_emission.or([&cutoff].into_iter().find(|f| !(f.is_finite() && **f >= 0.0))) {
            return Err(SceneError::invalid(self.file, at, bad.to_string(), "a finite number, 0 or more"));
        }
        if !m.normal_scale.is_finite() {
            return Err(SceneError::invalid(
                self.file,
                at,
                m.normal_scale.to_string(),
                "a finite normal scale",
            ));
        }
        Ok(())
    }

    fn info(
        &mut self,
        at: &str,
        name: &str,
        info: Option<&json::texture::Info>,
    ) -> Result<Option<TextureRef>, SceneError> {
        let Some(info) = info else { return Ok(None) };
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.clone());
        self.texture(at, Use { texture: info.index, tex_coord: info.tex_coord, transform, at: name })
    }

    fn transform(&self, at: &str, value: Option<&Value>) -> Result<Option<TextureTransform>, SceneError> {
        let read = |v| TextureTransform::deserialize(v);
        value.map(read).transpose().map_err(|e| {
            SceneError::invalid(
                self.file,
                format!("{at} {TRANSFORM}"),
                e.to_string(),
                "the extension's properties",
            )
        })
    }

    fn texture(&mut self, material: &str, u: Use) -> Result<Option<TextureRef>, SceneError> {
        let at = || format!("{material}.{}", u.at);
        // resolved by the reference checks
        let texture = &self.root.textures[u.texture.value()];
        let image = texture.source.value();
        if image >= self.root.images.len() {
            self.warnings.push(format!("{}: a texture without a PNG or JPEG source is left out", at()));
            return Ok(None);
        }
        let uv_transform = u.transform.as_ref().map_or(IDENTITY, matrix);
        if !uv_transform.iter().flatten().all(|v| v.is_finite()) {
            return Err(SceneError::invalid(
                self.file,
                at(),
                "a texture transform that overflows",
                "finite numbers",
            ));
        }
        let mut uv_set = u.transform.and_then(|t| t.tex_coord).unwrap_or(u.tex_coord);
        if uv_set > 1 {
            self.warnings
                .push(format!("{}: texture coordinate set {uv_set} is not kept, set 0 is used", at()));
            uv_set = 0;
        }
        let sampler = match &texture.sampler {
            None => Sampler::default(),
            Some(s) => self.sampler(s.value())?,
        };
        self.used.insert(image, ());
        Ok(Some(TextureRef { image: image as u32, sampler, uv_set, uv_transform }))
    }

    fn sampler(&self, index: usize) -> Result<Sampler, SceneError> {
        let s = &self.root.samplers[index];
        let wrong = |p: &str| {
            SceneError::invalid(
                self.file,
                format!("samplers[{index}].{p}"),
                "an unknown number",
                "a value of glTF 2.0",
            )
        };
        let wrap = |w: Checked<WrappingMode>, p: &str| match w {
            Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
            Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::Mirror),
            Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::Clamp),
            Checked::Invalid => Err(wrong(p)),
        };
        let (min_nearest, mip) = match s.min_filter {
            None => (false, MipMode::Linear),
            Some(Checked::Invalid) => return Err(wrong("minFilter")),
            Some(Checked::Valid(filter)) => match filter {
                MinFilter::Nearest => (true, MipMode::None),
                MinFilter::Linear => (false, MipMode::None),
                MinFilter::NearestMipmapNearest => (true, MipMode::Nearest),
                MinFilter::LinearMipmapNearest => (false, MipMode::Nearest),
                MinFilter::NearestMipmapLinear => (true, MipMode::Linear),
                MinFilter::LinearMipmapLinear => (false, MipMode::Linear),
            },
        };
        let mag_nearest = match s.mag_filter {
            Some(Checked::Invalid) => return Err(wrong("magFilter")),
            filter => filter == Some(Checked::Valid(MagFilter::Nearest)),
        };
        let (wrap_u, wrap_v) = (wrap(s.wrap_s, "wrapS")?, wrap(s.wrap_t, "wrapT")?);
        Ok(Sampler { mag_nearest, min_nearest, mip, wrap_u, wrap_v })
    }
}

const TRANSFORM: &str = "KHR_texture_transform";
const IDENTITY: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// Translation · rotation · scale of KHR_texture_transform; the rotation is counter-clockwise on
/// the image's plane, where v points down.
fn matrix(t: &TextureTransform) -> [[f32; 3]; 2] {
    let (sin, cos) = t.rotation.0.sin_cos();
    let ([sx, sy], [ox, oy]) = (t.scale.0, t.offset.0);
    [[cos * sx, sin * sy, ox], [-sin * sx, cos * sy, oy]]
}

/// Media types of images.
const IMAGE_TYPES: &[&str] = &["image/png", "image/jpeg"];

fn convert_image(accessors: &Accessors, root: &Root, index: usize) -> Result<Image, SceneError> {
    let file = accessors.file;
    let json = &root.images[index];
    let at = format!("images[{index}]");
    let source = match (&json.uri, &json.buffer_view) {
        (Some(_), Some(_)) | (None, None) => {
            let found = if json.uri.is_some() { "uri and bufferView" } else { "neither uri nor bufferView" };
            return Err(SceneError::invalid(file, at, found, "one of them"));
        }
        (Some(uri), None) if uri.starts_with("data:") => {
            ImageData::Encoded(decode_data_uri(file, &at, uri, IMAGE_TYPES)?.into())
        }
        (Some(uri), None) => ImageData::File(load::resolve_uri(file, uri).ok_or_else(|| {
            SceneError::invalid(
                file,
                format!("{at}.uri"),
                format!("{uri:?}"),
                "a relative file name or a data URI",
            )
        })?),
        (None, Some(view)) => match accessors.views.get(view.value()) {
            Some(Some(bytes)) => ImageData::Encoded(Arc::from(&**bytes)),
            _ => return Err(SceneError::invalid(file, at, "a buffer without data", "a PNG or JPEG image")),
        },
    };
    let name = match (&source, &json.name) {
        (ImageData::File(path), _) => path.display().to_string(),
        (_, Some(name)) => format!("{at} ({})", crate::error::one_line(name)),
        _ => at,
    };
    texture::open(file, name, source)
}
