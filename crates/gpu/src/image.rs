//! Images and their views.

use crate::device::lock;
use crate::format::{aspect_of, is_integer};
use crate::memory::{Heap, Memory, MemoryKind, check_limit};
use crate::{Device, GpuError};
use ash::vk;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex};

/// What a 2D image is to be.
#[derive(Clone, Copy, Debug)]
pub struct ImageDesc<'a> {
    /// Name in errors, captures and reports.
    pub name: &'a str,
    /// Texel format.
    pub format: vk::Format,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// Array layers, at least 1.
    pub layers: u32,
    /// Mip levels, at least 1.
    pub mips: u32,
    /// Samples a pixel: 1, 2, 4, 8, 16.
    pub samples: u32,
    /// Uses, all of them.
    pub usage: vk::ImageUsageFlags,
}

/// How a view presents its image to a shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ViewKind {
    /// `texture2D`, `image2D`, attachments with one layer.
    D2,
    /// `texture2DArray`, `image2DArray`, attachments with layers.
    D2Array,
}

/// Which part of an image a view shows, and how.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct ViewDesc {
    /// How it presents the image.
    pub kind: ViewKind,
    /// Mip levels; an end of `u32::MAX` is the last level.
    pub mips: Range<u32>,
    /// Array layers; an end of `u32::MAX` is the last layer.
    pub layers: Range<u32>,
    /// Aspects; none means all that the format has. A view that is sampled has one alone.
    pub aspect: vk::ImageAspectFlags,
}

impl Default for ViewDesc {
    /// All levels, layers and aspects, as a plain 2D image.
    fn default() -> Self {
        ViewDesc {
            kind: ViewKind::D2,
            mips: 0..u32::MAX,
            layers: 0..u32::MAX,
            aspect: vk::ImageAspectFlags::empty(),
        }
    }
}

/// An image. Cloning shares it; it is freed after the last clone and the last command that uses it.
#[derive(Clone)]
pub struct Image(pub(crate) Arc<ImageInner>);

pub(crate) struct ImageInner {
    device: Device,
    pub raw: vk::Image,
    pub name: String,
    format: vk::Format,
    extent: [u32; 2],
    layers: u32,
    mips: u32,
    samples: u32,
    usage: vk::ImageUsageFlags,
    allocated_bytes: u64,
    memory: Memory,
    views: Mutex<HashMap<ViewDesc, vk::ImageView>>,
}

/// A view of an image, which it keeps alive. Views are made once for each description.
#[derive(Clone)]
pub struct ImageView {
    pub(crate) raw: vk::ImageView,
    pub(crate) image: Image,
    pub(crate) desc: ViewDesc,
}

impl ImageView {
    /// The image that it shows.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Which part, and how.
    pub fn desc(&self) -> &ViewDesc {
        &self.desc
    }
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ImageInner { name, format, extent, layers, mips, samples, .. } = &*self.0;
        write!(
            f,
            "Image({name}: {}×{}×{layers}, {mips} mips, {samples} samples, {format:?})",
            extent[0], extent[1]
        )
    }
}

impl Image {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Its format.
    pub fn format(&self) -> vk::Format {
        self.0.format
    }

    /// Width and height of level 0 in texels.
    pub fn extent(&self) -> [u32; 2] {
        self.0.extent
    }

    /// Width and height of level `mip` in texels, at least 1.
    pub fn mip_extent(&self, mip: u32) -> [u32; 2] {
        self.0.extent.map(|size| size.checked_shr(mip).unwrap_or(0).max(1))
    }

    /// Array layers.
    pub fn layers(&self) -> u32 {
        self.0.layers
    }

    /// Mip levels.
    pub fn mips(&self) -> u32 {
        self.0.mips
    }

    /// Samples a pixel.
    pub fn samples(&self) -> u32 {
        self.0.samples
    }

    /// Its uses.
    pub fn usage(&self) -> vk::ImageUsageFlags {
        self.0.usage
    }

    /// The bytes that it occupies, by the device's memory requirements.
    pub fn allocated_bytes(&self) -> u64 {
        self.0.allocated_bytes
    }

    /// All aspects that its format has.
    pub fn aspect(&self) -> vk::ImageAspectFlags {
        aspect_of(self.0.format)
    }

    /// All of its levels, layers and aspects.
    pub fn full_range(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange {
            aspect_mask: self.aspect(),
            base_mip_level: 0,
            level_count: self.0.mips,
            base_array_layer: 0,
            layer_count: self.0.layers,
        }
    }

    /// Whether both are the same image.
    pub fn same(&self, other: &Image) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// The view of this description, made at its first use.
    ///
    /// # Errors
    /// A driver that has no more views.
    ///
    /// # Panics
    /// If the range is empty or beyond the image, or has several layers in a plain 2D view.
    pub fn view(&self, desc: &ViewDesc) -> Result<ImageView, GpuError> {
        let end = |end: u32, last: u32| if end == u32::MAX { last } else { end };
        let desc = ViewDesc {
            kind: desc.kind,
            mips: desc.mips.start..end(desc.mips.end, self.0.mips),
            layers: desc.layers.start..end(desc.layers.end, self.0.layers),
            aspect: if desc.aspect.is_empty() { self.aspect() } else { desc.aspect },
        };
        assert!(
            !desc.mips.is_empty()
                && !desc.layers.is_empty()
                && desc.mips.end <= self.0.mips
                && desc.layers.end <= self.0.layers
                && (desc.kind == ViewKind::D2Array || desc.layers.len() == 1),
            "view {desc:?} of {self:?}"
        );
        let mut views = lock(&self.0.views);
        let raw = match views.get(&desc) {
            Some(&raw) => raw,
            None => {
                let raw = self.create_view(&desc)?;
                views.insert(desc.clone(), raw);
                raw
            }
        };
        Ok(ImageView { raw, image: self.clone(), desc })
    }

    /// The view of the whole image: an array where it has more than one layer, with all aspects.
    ///
    /// # Errors
    /// As [`Image::view`].
    pub fn full_view(&self) -> Result<ImageView, GpuError> {
        let kind = if self.0.layers > 1 { ViewKind::D2Array } else { ViewKind::D2 };
        self.view(&ViewDesc { kind, ..ViewDesc::default() })
    }

    fn create_view(&self, desc: &ViewDesc) -> Result<vk::ImageView, GpuError> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.0.raw)
            .view_type(match desc.kind {
                ViewKind::D2 => vk::ImageViewType::TYPE_2D,
                ViewKind::D2Array => vk::ImageViewType::TYPE_2D_ARRAY,
            })
            .format(self.0.format)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask: desc.aspect,
                base_mip_level: desc.mips.start,
                level_count: desc.mips.end - desc.mips.start,
                base_array_layer: desc.layers.start,
                layer_count: desc.layers.end - desc.layers.start,
            });
        // SAFETY: the image is alive and the range lies in it.
        let raw = unsafe { self.0.device.0.raw.create_image_view(&info, None) }
            .map_err(GpuError::call("vkCreateImageView"))?;
        self.0.device.set_name(raw, &self.0.name);
        Ok(raw)
    }
}

impl Drop for ImageInner {
    fn drop(&mut self) {
        // SAFETY: encoders, sets and views hold the images they use, so the device is done with it.
        unsafe {
            for (_, view) in lock(&self.views).drain() {
                self.device.0.raw.destroy_image_view(view, None);
            }
            self.device.0.raw.destroy_image(self.raw, None);
        }
        self.memory.free(&self.device);
    }
}

impl Device {
    /// Makes an image in memory of its own. Its layout is undefined.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], [`GpuError::UnsupportedSamples`], [`GpuError::UnsupportedFormat`],
    /// [`GpuError::OutOfMemory`], all with the image's name.
    pub fn create_image(&self, desc: &ImageDesc<'_>) -> Result<Image, GpuError> {
        let raw = self.raw_image(desc)?;
        // SAFETY: the image was just made by this device.
        let needs = unsafe { self.0.raw.get_image_memory_requirements(raw) };
        let placed = self.allocate(desc.name, needs, MemoryKind::DeviceLocal, false).and_then(|allocation| {
            // SAFETY: the allocation was made for these requirements, and belongs to this image alone.
            unsafe { self.0.raw.bind_image_memory(raw, allocation.memory(), allocation.offset()) }
                .map(|()| allocation)
                .map_err(GpuError::of_resource("vkBindImageMemory", desc.name, needs.size))
        });
        match placed {
            Ok(allocation) => Ok(self.image(desc, raw, needs.size, Memory::Own(Some(allocation)))),
            Err(error) => {
                // SAFETY: nobody else has the image.
                unsafe { self.0.raw.destroy_image(raw, None) };
                Err(error)
            }
        }
    }

    /// Makes an image at `offset_bytes` of `heap`. What else lies there at the same time is for the caller to know.
    ///
    /// # Errors
    /// As [`Device::create_image`], and [`GpuError::OutOfRange`] where it does not fit.
    ///
    /// # Panics
    /// If the offset is not aligned or the heap's memory type does not suit (see [`Device::image_requirements`]).
    pub fn create_image_in(
        &self,
        desc: &ImageDesc<'_>,
        heap: &Heap,
        offset_bytes: u64,
    ) -> Result<Image, GpuError> {
        let raw = self.raw_image(desc)?;
        // SAFETY: the image was just made by this device.
        let needs = unsafe { self.0.raw.get_image_memory_requirements(raw) };
        let bound = heap.check_fit(desc.name, needs.into(), offset_bytes).and_then(|()| {
            // SAFETY: offset, alignment and memory type have been checked.
            unsafe { self.0.raw.bind_image_memory(raw, heap.raw(), offset_bytes) }
                .map_err(GpuError::of_resource("vkBindImageMemory", desc.name, needs.size))
        });
        if let Err(error) = bound {
            // SAFETY: nobody else has the image.
            unsafe { self.0.raw.destroy_image(raw, None) };
            return Err(error);
        }
        Ok(self.image(desc, raw, needs.size, Memory::In { _heap: heap.clone() }))
    }

    /// The sample counts that images of `format` with `usage` may have: a bit mask, bit value = count; 0 where the
    /// device has no such images.
    pub fn image_sample_counts(&self, format: vk::Format, usage: vk::ImageUsageFlags) -> u32 {
        self.image_limits(format, usage).map_or(0, |limits| limits.sample_counts.as_raw())
    }

    fn image_limits(
        &self,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
    ) -> Option<vk::ImageFormatProperties> {
        // SAFETY: the physical device belongs to the instance, both alive.
        unsafe {
            self.0.instance.raw.get_physical_device_image_format_properties(
                self.0.physical,
                format,
                vk::ImageType::TYPE_2D,
                vk::ImageTiling::OPTIMAL,
                usage,
                vk::ImageCreateFlags::empty(),
            )
        }
        .ok()
    }

    /// Checks a description against what the device has for this format and use.
    pub(crate) fn check_image(&self, desc: &ImageDesc<'_>) -> Result<(), GpuError> {
        let name = desc.name;
        assert!(
            desc.width > 0 && desc.height > 0 && desc.layers > 0 && desc.mips > 0,
            "{name}: {}×{}, {} layers, {} mips: each must be at least 1",
            desc.width,
            desc.height,
            desc.layers,
            desc.mips
        );
        let Some(limits) = self.image_limits(desc.format, desc.usage) else {
            return Err(GpuError::UnsupportedFormat {
                resource: name.to_owned(),
                format: desc.format,
                usage: desc.usage,
            });
        };
        check_limit(name, "width in texels", desc.width.into(), limits.max_extent.width.into())?;
        check_limit(name, "height in texels", desc.height.into(), limits.max_extent.height.into())?;
        check_limit(name, "layers", desc.layers.into(), limits.max_array_layers.into())?;
        let full_chain = u32::BITS - desc.width.max(desc.height).leading_zeros();
        check_limit(name, "mip levels", desc.mips.into(), limits.max_mip_levels.min(full_chain).into())?;
        let mut counts = limits.sample_counts.as_raw();
        if is_integer(desc.format) && desc.usage.contains(vk::ImageUsageFlags::COLOR_ATTACHMENT) {
            counts &= self.features().sample_counts_integer;
        }
        if desc.samples.is_power_of_two() && counts & desc.samples != 0 {
            return Ok(());
        }
        let supported: Vec<String> = (0..7)
            .map(|bit| 1u32 << bit)
            .filter(|count| counts & count != 0)
            .map(|c| c.to_string())
            .collect();
        Err(GpuError::UnsupportedSamples {
            resource: name.to_owned(),
            found: desc.samples,
            supported: supported.join(", "),
        })
    }

    fn raw_image(&self, desc: &ImageDesc<'_>) -> Result<vk::Image, GpuError> {
        self.check_image(desc)?;
        // SAFETY: the description has been checked against the device's limits.
        let raw = unsafe { self.0.raw.create_image(&image_info(desc), None) }
            .map_err(GpuError::of_resource("vkCreateImage", desc.name, 0))?;
        self.set_name(raw, desc.name);
        Ok(raw)
    }

    fn image(&self, desc: &ImageDesc<'_>, raw: vk::Image, allocated_bytes: u64, memory: Memory) -> Image {
        Image(Arc::new(ImageInner {
            device: self.clone(),
            raw,
            name: desc.name.to_owned(),
            format: desc.format,
            extent: [desc.width, desc.height],
            layers: desc.layers,
            mips: desc.mips,
            samples: desc.samples,
            usage: desc.usage,
            allocated_bytes,
            memory,
            views: Mutex::new(HashMap::new()),
        }))
    }
}

pub(crate) fn image_info(desc: &ImageDesc<'_>) -> vk::ImageCreateInfo<'static> {
    vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(desc.format)
        .extent(vk::Extent3D { width: desc.width, height: desc.height, depth: 1 })
        .mip_levels(desc.mips)
        .array_layers(desc.layers)
        .samples(vk::SampleCountFlags::from_raw(desc.samples))
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(desc.usage)
        .initial_layout(vk::ImageLayout::UNDEFINED)
}
