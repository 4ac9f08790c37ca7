//! Textures in arrays ("buckets") of one size, format and sampler, since not every device can index descriptors freely.
//!
//! A scene with more sizes than a shader has buckets gets its textures resampled up to powers of two, then merged into
//! larger ones, until they fit; a warning says so.

use std::{
    collections::BTreeMap,
    num::NonZero,
    sync::{
        atomic::{AtomicUsize, Ordering},
        mpsc::{Receiver, SyncSender, sync_channel},
    },
};

use afterlight_graph::gpu::{self, vk};
use afterlight_scene::{
    Image, MipMode, Sampler, Scene, SceneError, TextureRef, Wrap,
    texture::{MipChain, TexelFormat, TextureRole, decode},
};

use crate::{
    TechniqueError,
    scene::{
        Progress,
        materials::{image_name, slots},
    },
};

/// Use of a texture.
pub type Role = TextureRole;

/// Buckets that shaders have for each format class: `srgb_textures`, `normal_textures`, `data_textures` in
/// `include/material.glsl`. 28 in all: lavapipe gives a stage 32 samplers.
const BUCKET_LIMITS: [usize; 3] = [12, 8, 8];

/// Formats of the classes.
const FORMATS: [vk::Format; 3] =
    [vk::Format::R8G8B8A8_SRGB, vk::Format::R8G8_UNORM, vk::Format::R8G8B8A8_UNORM];

/// Texels that decoded textures may hold in memory before they are uploaded, in textures.
const DECODED_IN_FLIGHT: usize = 4;

fn class_of(role: Role) -> usize {
    match role {
        Role::BaseColor | Role::Emissive => 0,
        Role::Normal => 1,
        Role::Data => 2,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct BucketKey {
    width: u32,
    height: u32,
    sampler: Sampler,
}

/// One texture: an image in one role with one sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    image: u32,
    role: u8,
    sampler: Sampler,
}

fn role_index(role: Role) -> u8 {
    match role {
        Role::BaseColor => 0,
        Role::Emissive => 1,
        Role::Normal => 2,
        Role::Data => 3,
    }
}

fn role_of(index: u8) -> Role {
    [Role::BaseColor, Role::Emissive, Role::Normal, Role::Data][index as usize]
}

/// Where each texture of a scene lies.
pub struct TextureTable {
    /// Textures of each class and bucket, by layer.
    buckets: [Vec<(BucketKey, Vec<Use>)>; 3],
    places: BTreeMap<Use, u32>,
}

/// The scene's textures on the device.
pub struct UploadedTextures {
    pub set: gpu::DescriptorSet,
    pub bytes: u64,
}

impl TextureTable {
    /// Assigns every texture of the scene's materials a bucket and a layer.
    ///
    /// # Errors
    /// A texture larger than the device takes; more layers of one size than it takes.
    pub fn plan(
        scene: &Scene,
        features: &gpu::Features,
        warnings: &mut Vec<String>,
    ) -> Result<Self, TechniqueError> {
        let mut classes: [BTreeMap<Use, (u32, u32)>; 3] = Default::default();
        for material in &scene.materials {
            for (texture, role) in slots(material) {
                let Some(texture) = texture else { continue };
                let image = &scene.images[texture.image as usize];
                let largest = image.width.max(image.height);
                if largest > features.max_image_dimension_2d {
                    return Err(TechniqueError::TooLarge {
                        what: format!(
                            "{}: width or height in pixels",
                            image_name(&scene.images, texture.image)
                        ),
                        found: largest.into(),
                        limit: features.max_image_dimension_2d.into(),
                    });
                }
                let key = Use { image: texture.image, role: role_index(role), sampler: texture.sampler };
                classes[class_of(role)].insert(key, (image.width, image.height));
            }
        }
        let mut table = Self { buckets: Default::default(), places: BTreeMap::new() };
        for (class, uses) in classes.into_iter().enumerate() {
            let buckets = fit(uses, BUCKET_LIMITS[class], features.max_image_dimension_2d, warnings);
            for (index, (key, layers)) in buckets.iter().enumerate() {
                if layers.len() > features.max_array_layers as usize {
                    return Err(TechniqueError::TooLarge {
                        what: format!("textures of {}×{} pixels", key.width, key.height),
                        found: layers.len() as u64,
                        limit: features.max_array_layers.into(),
                    });
                }
                for (layer, place) in layers.iter().enumerate() {
                    table.places.insert(*place, index as u32 | (layer as u32) << 8);
                }
            }
            table.buckets[class] = buckets;
        }
        Ok(table)
    }

    /// Bucket and layer of a texture, as a material's slot packs them.
    pub fn slot(&self, texture: &TextureRef, role: Role) -> u32 {
        self.places[&Use { image: texture.image, role: role_index(role), sampler: texture.sampler }]
    }

    /// Number of buckets of each class.
    pub fn bucket_counts(&self) -> [u32; 3] {
        [0, 1, 2].map(|c| self.buckets[c].len() as u32)
    }

    /// Decodes all textures in parallel and uploads them.
    ///
    /// # Errors
    /// An image that does not decode, of several the first in the scene's order; the device.
    pub fn upload(
        &self,
        device: &gpu::Device,
        uploader: &mut gpu::Uploader,
        images: &[Image],
        progress: Progress<'_>,
    ) -> Result<UploadedTextures, TechniqueError> {
        let mut arrays: Vec<Vec<gpu::Image>> = Vec::new();
        let mut jobs = Vec::new();
        for (class, buckets) in self.buckets.iter().enumerate() {
            let mut class_arrays = Vec::new();
            for (bucket, (key, layers)) in buckets.iter().enumerate() {
                class_arrays.push(create_array(device, class, key, layers.len() as u32)?);
                jobs.extend((0..).zip(layers).map(|(layer, place)| {
                    let target = Target { class, bucket, layer, place: *place };
                    Job { target, size_px: (key.width, key.height) }
                }));
            }
            arrays.push(class_arrays);
        }
        // Largest first, so that no long decode is left for the end.
        jobs.sort_by_key(|job| std::cmp::Reverse(u64::from(job.size_px.0) * u64::from(job.size_px.1)));
        let (send, receive) = sync_channel(DECODED_IN_FLIGHT);
        let (decoders, total, next) = (decoder_count(jobs.len()), jobs.len(), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for _ in 0..decoders {
                let (jobs, next, send) = (&jobs, &next, send.clone());
                scope.spawn(move || decode_next(jobs, next, images, &send));
            }
            drop(send);
            // The receiver ends with this call, whichever way it returns: decoders that wait for room in the channel then end too.
            upload_decoded(receive, uploader, &arrays, |done| progress(done, total))
        })?;
        self.describe(device, uploader, &arrays)
    }

    fn describe(
        &self,
        device: &gpu::Device,
        uploader: &mut gpu::Uploader,
        arrays: &[Vec<gpu::Image>],
    ) -> Result<UploadedTextures, TechniqueError> {
        let filler =
            create_array(device, 2, &BucketKey { width: 1, height: 1, sampler: Sampler::default() }, 1)?;
        uploader.image(&filler, 0, 0, &[255; 4])?;
        let mut writes = Vec::new();
        for class in 0..3 {
            for index in 0..BUCKET_LIMITS[class] {
                let (image, sampler) = match (arrays[class].get(index), self.buckets[class].get(index)) {
                    (Some(image), Some((key, _))) => (image, key.sampler),
                    _ => (&filler, Sampler::default()),
                };
                let view = image
                    .view(&gpu::ViewDesc { kind: gpu::ViewKind::D2Array, ..gpu::ViewDesc::default() })?;
                writes.push(gpu::SlotWrite {
                    binding: class as u32,
                    element: index as u32,
                    resource: gpu::SlotResource::Combined(view, device.sampler(&sampler_desc(&sampler))?),
                });
            }
        }
        let layout = gpu::SetLayoutDesc {
            slots: (0..3)
                .map(|class| gpu::SlotLayout {
                    binding: class as u32,
                    kind: vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
                    count: BUCKET_LIMITS[class] as u32,
                    stages: vk::ShaderStageFlags::FRAGMENT | vk::ShaderStageFlags::COMPUTE,
                })
                .collect(),
        };
        let bytes = arrays.iter().flatten().map(gpu::Image::allocated_bytes).sum();
        Ok(UploadedTextures { set: device.create_texture_set("scene textures", &layout, &writes)?, bytes })
    }
}

/// The layer of an array that a texture goes to.
#[derive(Clone, Copy)]
struct Target {
    class: usize,
    bucket: usize,
    layer: u32,
    place: Use,
}

/// A texture to be decoded at a size.
struct Job {
    target: Target,
    size_px: (u32, u32),
}

/// A decoded texture, or why there is none.
type Decoded = (Target, Result<MipChain, SceneError>);

/// Threads that decode: one a core. They are no pool's: of a pool, the thread that receives may be the only one.
fn decoder_count(jobs: usize) -> usize {
    std::thread::available_parallelism().map_or(1, NonZero::get).min(jobs)
}

/// Decodes the jobs that no other thread has begun, in their order, as long as someone receives what comes out: a receiver that is
/// gone has met an error of the device.
fn decode_next(jobs: &[Job], next: &AtomicUsize, images: &[Image], send: &SyncSender<Decoded>) {
    while let Some(Job { target, size_px }) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
        let image = &images[target.place.image as usize];
        let decoded = decode(image, role_of(target.place.role), Some(*size_px));
        if send.send((*target, decoded)).is_err() {
            return;
        }
    }
}

/// Uploads textures as they are decoded. After one that did not decode the others are received and dropped, so that the error does
/// not depend on which came first; an error of the device ends the call at once, and the receiver with it.
fn upload_decoded(
    receive: Receiver<Decoded>,
    uploader: &mut gpu::Uploader,
    arrays: &[Vec<gpu::Image>],
    progress: impl Fn(usize),
) -> Result<(), TechniqueError> {
    let mut undecoded: Option<(Use, SceneError)> = None;
    for (done, (Target { class, bucket, layer, place }, decoded)) in (1..).zip(receive) {
        match decoded {
            Ok(chain) if undecoded.is_none() => {
                check_format(class, &chain);
                for (mip, level) in (0..).zip(&chain.levels) {
                    uploader.image(&arrays[class][bucket], mip, layer, level)?;
                }
                progress(done);
            }
            Ok(_) => {}
            Err(error) => {
                if undecoded.as_ref().is_none_or(|(first, _)| place < *first) {
                    undecoded = Some((place, error));
                }
            }
        }
    }
    undecoded.map_or(Ok(()), |(_, error)| Err(error.into()))
}

fn check_format(class: usize, chain: &MipChain) {
    let expected = [TexelFormat::Rgba8Srgb, TexelFormat::Rg8Unorm, TexelFormat::Rgba8Unorm][class];
    assert_eq!(chain.format, expected, "decoded format of class {class}");
}

fn create_array(
    device: &gpu::Device,
    class: usize,
    key: &BucketKey,
    layers: u32,
) -> Result<gpu::Image, gpu::GpuError> {
    device.create_image(&gpu::ImageDesc {
        name: &format!("textures {}×{}", key.width, key.height),
        format: FORMATS[class],
        width: key.width,
        height: key.height,
        layers,
        mips: key.width.max(key.height).ilog2() + 1,
        samples: 1,
        usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
    })
}

fn sampler_desc(s: &Sampler) -> gpu::SamplerDesc {
    let filter = |nearest| if nearest { vk::Filter::NEAREST } else { vk::Filter::LINEAR };
    let wrap = |w| match w {
        Wrap::Repeat => vk::SamplerAddressMode::REPEAT,
        Wrap::Mirror => vk::SamplerAddressMode::MIRRORED_REPEAT,
        Wrap::Clamp => vk::SamplerAddressMode::CLAMP_TO_EDGE,
    };
    gpu::SamplerDesc {
        mag_filter: filter(s.mag_nearest),
        min_filter: filter(s.min_nearest),
        mipmap_mode: if s.mip == MipMode::Linear {
            vk::SamplerMipmapMode::LINEAR
        } else {
            vk::SamplerMipmapMode::NEAREST
        },
        max_lod: if s.mip == MipMode::None { 0.25 } else { vk::LOD_CLAMP_NONE },
        address_u: wrap(s.wrap_u),
        address_v: wrap(s.wrap_v),
        ..gpu::SamplerDesc::default()
    }
}

/// Groups textures by size and sampler into at most `limit` buckets.
fn fit(
    uses: BTreeMap<Use, (u32, u32)>,
    limit: usize,
    max_size: u32,
    warnings: &mut Vec<String>,
) -> Vec<(BucketKey, Vec<Use>)> {
    let group = |sized: &dyn Fn((u32, u32)) -> (u32, u32)| {
        let mut buckets: BTreeMap<BucketKey, Vec<Use>> = BTreeMap::new();
        for (place, size) in &uses {
            let (width, height) = sized(*size);
            buckets.entry(BucketKey { width, height, sampler: place.sampler }).or_default().push(*place);
        }
        buckets
    };
    let mut buckets = group(&|size| size);
    if buckets.len() <= limit {
        return buckets.into_iter().collect();
    }
    let exact = buckets.len();
    let up = |v: u32| v.next_power_of_two().min(max_size);
    buckets = group(&|(w, h)| (up(w), up(h)));
    let mut merged_samplers = false;
    while buckets.len() > limit {
        merged_samplers |= merge_cheapest(&mut buckets);
    }
    warnings.push(format!(
        "textures come in {exact} sizes and samplers: resampled up to {} (shaders have {limit} arrays){}",
        buckets.len(),
        if merged_samplers { "; some are sampled with another's sampler" } else { "" }
    ));
    buckets.into_iter().collect()
}

/// Merges the two buckets whose union adds the fewest texels; samplers differ only where no two are alike. Returns
/// whether they differed.
fn merge_cheapest(buckets: &mut BTreeMap<BucketKey, Vec<Use>>) -> bool {
    let keys: Vec<BucketKey> = buckets.keys().copied().collect();
    let texels = |k: &BucketKey, count: usize| u64::from(k.width) * u64::from(k.height) * count as u64;
    let (_, a, b) = keys
        .iter()
        .enumerate()
        .flat_map(|(i, a)| keys[..i].iter().map(move |b| (a, b)))
        .map(|(a, b)| {
            let union =
                BucketKey { width: a.width.max(b.width), height: a.height.max(b.height), sampler: a.sampler };
            let (na, nb) = (buckets[a].len(), buckets[b].len());
            let added = texels(&union, na + nb) - texels(a, na) - texels(b, nb);
            ((a.sampler != b.sampler, added), *a, *b)
        })
        .min()
        .unwrap_or_else(|| unreachable!("more buckets than the limit, which is at least one"));
    let sampler = if buckets[&a].len() >= buckets[&b].len() { a.sampler } else { b.sampler };
    let key = BucketKey { width: a.width.max(b.width), height: a.height.max(b.height), sampler };
    let layers: Vec<Use> = [a, b].iter().filter_map(|k| buckets.remove(k)).flatten().collect();
    buckets.entry(key).or_default().extend(layers);
    a.sampler != b.sampler
}
