//! Descriptors, through which shaders read and write resources: those pushed with each pass (set 0) and long-lived sets (set 1).

use crate::device::lock;
use crate::memory::check_limit;
use crate::{Buffer, Device, GpuError, ImageView, Sampler};
use ash::vk;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// One binding of a set, as shaders declare it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SlotLayout {
    /// `binding = …` in the shader.
    pub binding: u32,
    /// What is bound.
    pub kind: vk::DescriptorType,
    /// Elements of the array; 1 where it is none.
    pub count: u32,
    /// Stages that use it. A pipeline takes a long-lived set only with equal slots, stages included: it is given
    /// [`DescriptorSet::slots`].
    pub stages: vk::ShaderStageFlags,
}

/// The bindings of a long-lived set.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct SetLayoutDesc {
    /// Its bindings.
    pub slots: Vec<SlotLayout>,
}

/// What is bound to one element of a slot.
#[derive(Clone)]
pub enum SlotResource {
    /// A uniform buffer's range; `bytes` of `u64::MAX` reach to its end.
    UniformBuffer {
        /// The buffer.
        buffer: Buffer,
        /// Where the range begins, in bytes.
        offset: u64,
        /// Its length, in bytes.
        bytes: u64,
    },
    /// A storage buffer's range; `bytes` of `u64::MAX` reach to its end.
    StorageBuffer {
        /// The buffer.
        buffer: Buffer,
        /// Where the range begins, in bytes.
        offset: u64,
        /// Its length, in bytes.
        bytes: u64,
    },
    /// An image without a sampler (`texture2D`).
    SampledImage {
        /// The view.
        view: ImageView,
        /// The layout that the image is in when it is read.
        layout: vk::ImageLayout,
    },
    /// An image with its sampler (`sampler2D`).
    CombinedImageSampler {
        /// The view.
        view: ImageView,
        /// The sampler.
        sampler: Sampler,
        /// The layout that the image is in when it is read.
        layout: vk::ImageLayout,
    },
    /// An image with its sampler (`sampler2D`), in the layout `SHADER_READ_ONLY_OPTIMAL` when it is read.
    Combined(ImageView, Sampler),
    /// An image that is written or read texel by texel, in the layout `GENERAL`.
    StorageImage {
        /// The view: one level.
        view: ImageView,
    },
    /// A sampler alone.
    Sampler {
        /// The sampler.
        sampler: Sampler,
    },
}

/// Binds `resource` to an element of a slot.
#[derive(Clone)]
pub struct SlotWrite {
    /// `binding = …` in the shader.
    pub binding: u32,
    /// Element of the slot's array; 0 where it is none.
    pub element: u32,
    /// What is bound.
    pub resource: SlotResource,
}

/// Descriptor writes made ready once and pushed any number of times. It keeps its resources alive. Cloning shares it.
#[derive(Clone)]
pub struct PushSet(pub(crate) Arc<PushSetInner>);

pub(crate) struct PushSetInner {
    /// They point into `_infos`, whose heap memory does not move.
    pub writes: Vec<vk::WriteDescriptorSet<'static>>,
    _infos: Infos,
    _keep: Vec<SlotWrite>,
}

// SAFETY: the pointers in `writes` lead to memory that this value owns and never changes.
unsafe impl Send for PushSetInner {}
// SAFETY: as above.
unsafe impl Sync for PushSetInner {}

struct Infos {
    _buffers: Vec<vk::DescriptorBufferInfo>,
    _images: Vec<vk::DescriptorImageInfo>,
}

/// A long-lived descriptor set. It keeps its resources alive. Cloning shares it.
#[derive(Clone)]
pub struct DescriptorSet(pub(crate) Arc<DescriptorSetInner>);

pub(crate) struct DescriptorSetInner {
    device: Device,
    pool: vk::DescriptorPool,
    pub raw: vk::DescriptorSet,
    slots: Box<[SlotLayout]>,
    _keep: Vec<SlotWrite>,
}

impl DescriptorSet {
    /// Its bindings: what a pipeline that uses the set gives as `long_lived`.
    pub fn slots(&self) -> &[SlotLayout] {
        &self.0.slots
    }
}

impl Drop for DescriptorSetInner {
    fn drop(&mut self) {
        // SAFETY: encoders hold the sets that they bind, so the device is done with it; the pool frees the set.
        unsafe { self.device.0.raw.destroy_descriptor_pool(self.pool, None) };
    }
}

impl Device {
    /// Makes descriptor writes ready to be pushed to set 0.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] for a buffer range beyond what a shader can reach, [`GpuError::OutOfRange`].
    pub fn push_set(&self, writes: &[SlotWrite]) -> Result<PushSet, GpuError> {
        let (writes_raw, infos) = self.prepare(writes, vk::DescriptorSet::null())?;
        Ok(PushSet(Arc::new(PushSetInner { writes: writes_raw, _infos: infos, _keep: writes.to_vec() })))
    }

    /// Makes a long-lived set, for set 1: a scene's textures, say. Every element of every slot must be written.
    ///
    /// # Errors
    /// As [`Device::push_set`]; [`GpuError::Shader`] where an element is not written or has the wrong kind.
    pub fn create_texture_set(
        &self,
        name: &str,
        desc: &SetLayoutDesc,
        writes: &[SlotWrite],
    ) -> Result<DescriptorSet, GpuError> {
        check_complete(name, &desc.slots, writes)?;
        let layout = self.set_layout(&desc.slots, false)?;
        let mut sizes: HashMap<vk::DescriptorType, u32> = HashMap::new();
        for slot in &desc.slots {
            *sizes.entry(slot.kind).or_default() += slot.count;
        }
        let sizes: Vec<_> = sizes
            .into_iter()
            .map(|(kind, count)| vk::DescriptorPoolSize::default().ty(kind).descriptor_count(count))
            .collect();
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the device is alive; so for every call of this function.
        let pool = unsafe { self.0.raw.create_descriptor_pool(&info, None) }
            .map_err(GpuError::call("vkCreateDescriptorPool"))?;
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: the pool was made for one set of this layout.
        let made = unsafe { self.0.raw.allocate_descriptor_sets(&info) }
            .map_err(GpuError::call("vkAllocateDescriptorSets"))
            .and_then(|sets| self.prepare(writes, sets[0]).map(|prepared| (sets[0], prepared)));
        match made {
            Ok((raw, (writes_raw, infos))) => {
                // SAFETY: the writes point into `infos`, alive here; the set is not yet in use.
                unsafe { self.0.raw.update_descriptor_sets(&writes_raw, &[]) };
                drop(infos);
                self.set_name(raw, name);
                Ok(DescriptorSet(Arc::new(DescriptorSetInner {
                    device: self.clone(),
                    pool,
                    raw,
                    slots: desc.slots.as_slice().into(),
                    _keep: writes.to_vec(),
                })))
            }
            Err(error) => {
                // SAFETY: nobody else has the pool.
                unsafe { self.0.raw.destroy_descriptor_pool(pool, None) };
                Err(error)
            }
        }
    }

    fn prepare(
        &self,
        writes: &[SlotWrite],
        set: vk::DescriptorSet,
    ) -> Result<(Vec<vk::WriteDescriptorSet<'static>>, Infos), GpuError> {
        let mut buffers = vec![vk::DescriptorBufferInfo::default(); writes.len()];
        let mut images = vec![vk::DescriptorImageInfo::default(); writes.len()];
        for (i, write) in writes.iter().enumerate() {
            match &write.resource {
                SlotResource::UniformBuffer { buffer, offset, bytes } => {
                    let limit = self.features().max_uniform_buffer_range;
                    buffers[i] = buffer_info(buffer, *offset, *bytes, limit)?;
                }
                SlotResource::StorageBuffer { buffer, offset, bytes } => {
                    let limit = self.features().max_storage_buffer_range;
                    buffers[i] = buffer_info(buffer, *offset, *bytes, limit)?;
                }
                SlotResource::SampledImage { view, layout } => {
                    images[i] = vk::DescriptorImageInfo::default().image_view(view.raw).image_layout(*layout);
                }
                SlotResource::CombinedImageSampler { view, sampler, layout } => {
                    images[i] = vk::DescriptorImageInfo::default()
                        .image_view(view.raw)
                        .sampler(sampler.raw)
                        .image_layout(*layout);
                }
                SlotResource::Combined(view, sampler) => {
                    images[i] = vk::DescriptorImageInfo::default()
                        .image_view(view.raw)
                        .sampler(sampler.raw)
                        .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
                }
                SlotResource::StorageImage { view } => {
                    images[i] = vk::DescriptorImageInfo::default()
                        .image_view(view.raw)
                        .image_layout(vk::ImageLayout::GENERAL);
                }
                SlotResource::Sampler { sampler } => {
                    images[i] = vk::DescriptorImageInfo::default().sampler(sampler.raw);
                }
            }
        }
        let raw = writes
            .iter()
            .enumerate()
            .map(|(i, write)| vk::WriteDescriptorSet {
                dst_set: set,
                dst_binding: write.binding,
                dst_array_element: write.element,
                descriptor_count: 1,
                descriptor_type: write.resource.kind(),
                p_image_info: &images[i],
                p_buffer_info: &buffers[i],
                ..Default::default()
            })
            .collect();
        Ok((raw, Infos { _buffers: buffers, _images: images }))
    }
}

impl SlotResource {
    /// The descriptor type of a slot that takes it.
    pub fn kind(&self) -> vk::DescriptorType {
        match self {
            SlotResource::UniformBuffer { .. } => vk::DescriptorType::UNIFORM_BUFFER,
            SlotResource::StorageBuffer { .. } => vk::DescriptorType::STORAGE_BUFFER,
            SlotResource::SampledImage { .. } => vk::DescriptorType::SAMPLED_IMAGE,
            SlotResource::CombinedImageSampler { .. } | SlotResource::Combined(..) => {
                vk::DescriptorType::COMBINED_IMAGE_SAMPLER
            }
            SlotResource::StorageImage { .. } => vk::DescriptorType::STORAGE_IMAGE,
            SlotResource::Sampler { .. } => vk::DescriptorType::SAMPLER,
        }
    }
}

fn buffer_info(
    buffer: &Buffer,
    offset: u64,
    bytes: u64,
    limit: u64,
) -> Result<vk::DescriptorBufferInfo, GpuError> {
    let info = vk::DescriptorBufferInfo::default().buffer(buffer.0.raw).offset(offset);
    if bytes == u64::MAX {
        buffer.check_range(offset, 0)?;
        check_limit(buffer.name(), "bytes bound to a shader", buffer.bytes() - offset, limit)?;
        return Ok(info.range(vk::WHOLE_SIZE));
    }
    buffer.check_range(offset, bytes)?;
    check_limit(buffer.name(), "bytes bound to a shader", bytes, limit)?;
    // An empty range cannot be bound; the buffer itself is never empty on the device.
    Ok(if bytes == 0 { info.offset(0).range(vk::WHOLE_SIZE) } else { info.range(bytes) })
}

fn check_complete(name: &str, slots: &[SlotLayout], writes: &[SlotWrite]) -> Result<(), GpuError> {
    for slot in slots {
        for element in 0..slot.count {
            let written: Vec<_> =
                writes.iter().filter(|w| w.binding == slot.binding && w.element == element).collect();
            let fault = match written[..] {
                [one] if one.resource.kind() == slot.kind => continue,
                [one] => format!("is written with {:?}, expected {:?}", one.resource.kind(), slot.kind),
                [] => "is not written".to_owned(),
                _ => "is written twice".to_owned(),
            };
            return Err(GpuError::Shader {
                name: name.to_owned(),
                reason: format!("binding {} element {element} {fault}", slot.binding),
            });
        }
    }
    let stray = writes.iter().find(|w| !slots.iter().any(|s| s.binding == w.binding && w.element < s.count));
    match stray {
        Some(w) => Err(GpuError::Shader {
            name: name.to_owned(),
            reason: format!("binding {} element {} is written, the layout has none", w.binding, w.element),
        }),
        None => Ok(()),
    }
}

/// Set layouts by their slots, and whether they are pushed.
#[derive(Default)]
pub(crate) struct SetLayoutCache(Mutex<HashMap<(Vec<SlotLayout>, bool), vk::DescriptorSetLayout>>);

impl SetLayoutCache {
    pub fn get(
        &self,
        device: &ash::Device,
        slots: &[SlotLayout],
        push: bool,
    ) -> Result<vk::DescriptorSetLayout, GpuError> {
        let mut sorted = slots.to_vec();
        sorted.sort_by_key(|s| s.binding);
        let mut layouts = lock(&self.0);
        if let Some(&layout) = layouts.get(&(sorted.clone(), push)) {
            return Ok(layout);
        }
        let bindings: Vec<_> = sorted
            .iter()
            .map(|s| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(s.binding)
                    .descriptor_type(s.kind)
                    .descriptor_count(s.count)
                    .stage_flags(s.stages)
            })
            .collect();
        let flags = if push {
            vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR
        } else {
            vk::DescriptorSetLayoutCreateFlags::empty()
        };
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings).flags(flags);
        // SAFETY: the device is alive; push descriptors are required of every device.
        let layout = unsafe { device.create_descriptor_set_layout(&info, None) }
            .map_err(GpuError::call("vkCreateDescriptorSetLayout"))?;
        layouts.insert((sorted, push), layout);
        Ok(layout)
    }

    /// # Safety
    /// No layout may be in use any more.
    pub unsafe fn destroy(&self, device: &ash::Device) {
        for (_, layout) in lock(&self.0).drain() {
            // SAFETY: the caller promises that none is in use.
            unsafe { device.destroy_descriptor_set_layout(layout, None) };
        }
    }
}
