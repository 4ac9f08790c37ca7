//! Pipelines, made once for each key of shaders, constants and state.
//!
//! Layout of every pipeline: set 0 is pushed with each pass, set 1 is an optional long-lived set, and one range of push
//! constants serves all stages. Viewport, scissor, cull mode, front face, stencil reference and depth bias are dynamic.

#[cfg(doc)]
use crate::Features;
use crate::device::{cache_file, lock};
use crate::format::aspect_of;
use crate::memory::check_limit;
use crate::{Device, DeviceInfo, GpuError, SlotLayout, cache};
use ash::vk;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// A shader's code with its specialisation. Its entry point is `main`.
#[derive(Clone, Copy, Debug)]
pub struct ShaderCode<'a> {
    /// Name in errors and captures: `tiled/shade.comp`.
    pub name: &'a str,
    /// SPIR-V words.
    pub spirv: &'a [u32],
    /// Specialisation constants: id and the bits of a 32-bit value.
    pub constants: &'a [(u32, u32)],
}

/// What a compute pipeline is to be.
#[derive(Clone, Copy, Debug)]
pub struct ComputePipelineDesc<'a> {
    /// The shader.
    pub shader: ShaderCode<'a>,
    /// Slots of set 0, pushed.
    pub slots: &'a [SlotLayout],
    /// Slots of set 1, where there is one.
    pub long_lived: Option<&'a [SlotLayout]>,
    /// Bytes of push constants, a multiple of 4.
    pub push_constant_bytes: u32,
    /// Subgroups that it must run in; `None` leaves them to the driver, which may vary them.
    pub subgroup: Option<RequiredSubgroup>,
}

/// Subgroups that a compute pipeline must run in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct RequiredSubgroup {
    /// Invocations of a subgroup: one of those that [`Features::offers_subgroup_size`] tells.
    pub invocations: u32,
    /// Whether all invocations of every subgroup are active; the group's width is then a multiple of `invocations`.
    pub is_full: bool,
}

/// One vertex buffer's layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VertexBinding {
    /// Which vertex buffer.
    pub binding: u32,
    /// Bytes from one element to the next.
    pub stride_bytes: u32,
    /// One element an instance instead of a vertex.
    pub per_instance: bool,
}

/// One vertex attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VertexAttribute {
    /// `layout(location = …)` in the vertex shader.
    pub location: u32,
    /// Which vertex buffer.
    pub binding: u32,
    /// Its format in memory.
    pub format: vk::Format,
    /// Where it lies in an element, in bytes.
    pub offset_bytes: u32,
}

/// Depth test and write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DepthState {
    /// Passes where `fragment compare stored`; reversed Z uses `GREATER`.
    pub compare: vk::CompareOp,
    /// Whether passing fragments write their depth.
    pub write: bool,
}

/// Stencil test of one side of triangles. The reference is dynamic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StencilFace {
    /// Passes where `reference compare stored`, both masked.
    pub compare: vk::CompareOp,
    /// Mask of the comparison.
    pub compare_mask: u32,
    /// Mask of the write.
    pub write_mask: u32,
    /// What happens where both tests pass.
    pub pass: vk::StencilOp,
    /// What happens where the stencil test fails.
    pub fail: vk::StencilOp,
    /// What happens where the depth test fails.
    pub depth_fail: vk::StencilOp,
}

/// Stencil test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StencilState {
    /// Of front faces.
    pub front: StencilFace,
    /// Of back faces.
    pub back: StencilFace,
}

/// Blending and write mask of one colour attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendState {
    /// Channels that are written.
    pub write: vk::ColorComponentFlags,
    /// The equation, `None` where the attachment is overwritten.
    pub equation: Option<BlendEquation>,
}

/// Factors and operations of blending.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendEquation {
    /// Factors of source and target colour.
    pub color: [vk::BlendFactor; 2],
    /// How the colours are joined.
    pub color_op: vk::BlendOp,
    /// Factors of source and target alpha.
    pub alpha: [vk::BlendFactor; 2],
    /// How the alphas are joined.
    pub alpha_op: vk::BlendOp,
}

impl BlendState {
    /// The attachment is overwritten, all channels.
    pub const OVERWRITE: BlendState = BlendState { write: vk::ColorComponentFlags::RGBA, equation: None };
    /// Nothing is written.
    pub const NO_WRITE: BlendState = BlendState { write: vk::ColorComponentFlags::empty(), equation: None };
    /// The fragment is added to the attachment.
    pub const ADD: BlendState = BlendState {
        write: vk::ColorComponentFlags::RGBA,
        equation: Some(BlendEquation {
            color: [vk::BlendFactor::ONE, vk::BlendFactor::ONE],
            color_op: vk::BlendOp::ADD,
            alpha: [vk::BlendFactor::ONE, vk::BlendFactor::ONE],
            alpha_op: vk::BlendOp::ADD,
        }),
    };
    /// The fragment, its colour premultiplied with its alpha, lies over the attachment.
    pub const OVER_PREMULTIPLIED: BlendState = BlendState {
        write: vk::ColorComponentFlags::RGBA,
        equation: Some(BlendEquation {
            color: [vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA],
            color_op: vk::BlendOp::ADD,
            alpha: [vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA],
            alpha_op: vk::BlendOp::ADD,
        }),
    };
}

/// What a raster pipeline is to be.
#[derive(Clone, Copy, Debug)]
pub struct RasterPipelineDesc<'a> {
    /// Vertex shader.
    pub vertex: ShaderCode<'a>,
    /// Tessellation control and evaluation shaders.
    pub tessellation: Option<[ShaderCode<'a>; 2]>,
    /// Control points of a patch; used with tessellation alone.
    pub patch_control_points: u32,
    /// Geometry shader.
    pub geometry: Option<ShaderCode<'a>>,
    /// Fragment shader; `None` for depth and stencil alone.
    pub fragment: Option<ShaderCode<'a>>,
    /// Slots of set 0, pushed.
    pub slots: &'a [SlotLayout],
    /// Slots of set 1, where there is one.
    pub long_lived: Option<&'a [SlotLayout]>,
    /// Bytes of push constants, a multiple of 4.
    pub push_constant_bytes: u32,
    /// Vertex buffers.
    pub vertex_bindings: &'a [VertexBinding],
    /// Vertex attributes.
    pub vertex_attributes: &'a [VertexAttribute],
    /// What the vertices make.
    pub topology: vk::PrimitiveTopology,
    /// Triangles as faces, lines or points.
    pub polygon_mode: vk::PolygonMode,
    /// Depth test; `None` where depth is neither tested nor written.
    pub depth: Option<DepthState>,
    /// Depth beyond the range is clamped instead of clipped.
    pub depth_clamp: bool,
    /// Depth is biased by what [`crate::Encoder::set_depth_bias`] says.
    pub depth_bias: bool,
    /// Stencil test; `None` where stencil is neither tested nor written.
    pub stencil: Option<StencilState>,
    /// One for each colour attachment.
    pub blend: &'a [BlendState],
    /// What the blend factors `CONSTANT_…` are: RGBA.
    pub blend_constants: [f32; 4],
    /// Formats of the colour attachments, in order of location.
    pub color_formats: &'a [vk::Format],
    /// Format of the depth and stencil attachment.
    pub depth_format: Option<vk::Format>,
    /// Samples a pixel.
    pub samples: u32,
    /// Fragment shading once a sample.
    pub sample_shading: bool,
    /// Coverage from the first attachment's alpha.
    pub alpha_to_coverage: bool,
}

/// A pipeline. Cloning is cheap; it lives as long as its device.
#[derive(Clone)]
pub struct Pipeline {
    pub(crate) inner: Arc<PipelineInner>,
    // Keeps the device, and with it the pipeline.
    _device: Device,
}

impl std::fmt::Debug for Pipeline {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Pipeline({})", self.inner.name)
    }
}

impl Pipeline {
    /// The names of its shaders.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// Whether both are the same pipeline.
    pub fn same(&self, other: &Pipeline) -> bool {
        self.inner.raw == other.inner.raw
    }
}

pub(crate) struct PipelineInner {
    pub raw: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub bind_point: vk::PipelineBindPoint,
    pub push_constant_bytes: u32,
    pub push_stages: vk::ShaderStageFlags,
    name: String,
}

/// What distinguishes one pipeline from another.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Key {
    shaders: Vec<ShaderKey>,
    slots: Vec<SlotLayout>,
    long_lived: Option<Vec<SlotLayout>>,
    push_constant_bytes: u32,
    subgroup: Option<RequiredSubgroup>,
    raster: Option<RasterKey>,
}

#[derive(Clone, PartialEq, Eq, Hash)]
struct ShaderKey {
    stage: vk::ShaderStageFlags,
    name: String,
    word_count: usize,
    hash: u64,
    constants: Vec<(u32, u32)>,
}

#[derive(Clone, PartialEq, Eq, Hash)]
struct RasterKey {
    patch_control_points: u32,
    vertex_bindings: Vec<VertexBinding>,
    vertex_attributes: Vec<VertexAttribute>,
    topology: vk::PrimitiveTopology,
    polygon_mode: vk::PolygonMode,
    depth: Option<DepthState>,
    depth_clamp: bool,
    depth_bias: bool,
    stencil: Option<StencilState>,
    blend: Vec<BlendState>,
    blend_constant_bits: [u32; 4],
    color_formats: Vec<vk::Format>,
    depth_format: Option<vk::Format>,
    samples: u32,
    sample_shading: bool,
    alpha_to_coverage: bool,
}

/// All pipelines of a device, and the driver's cache.
pub(crate) struct PipelineStore {
    made: Mutex<HashMap<Key, Arc<PipelineInner>>>,
    layouts: Mutex<HashMap<LayoutKey, vk::PipelineLayout>>,
    driver_cache: vk::PipelineCache,
    file: Option<PathBuf>,
    is_changed: AtomicBool,
}

type LayoutKey = (vk::DescriptorSetLayout, Option<vk::DescriptorSetLayout>, u32, vk::ShaderStageFlags);

impl PipelineStore {
    pub fn new(device: &ash::Device, info: &DeviceInfo, dir: Option<&Path>) -> PipelineStore {
        let file = dir.map(|dir| cache_file(info, dir));
        // A file that is absent, unreadable or damaged means an empty cache: the next save replaces it.
        let stored = file.as_ref().and_then(|path| std::fs::read(path).ok());
        let data = stored.as_deref().and_then(|file| cache::unwrap(file, info)).unwrap_or_default();
        let create = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the device is alive; the data is what this driver wrote, by its header and checksum.
            unsafe { device.create_pipeline_cache(&info, None) }
        };
        PipelineStore {
            made: Mutex::default(),
            layouts: Mutex::default(),
            // Pipelines can be made without a cache too, so a driver that refuses one stops nothing.
            driver_cache: create(data).or_else(|_| create(&[])).unwrap_or_default(),
            file,
            is_changed: AtomicBool::new(false),
        }
    }

    pub fn save(&self, device: &ash::Device, info: &DeviceInfo) -> Result<(), GpuError> {
        let Some(path) = &self.file else { return Ok(()) };
        if self.driver_cache == vk::PipelineCache::null() || !self.is_changed.swap(false, Ordering::Relaxed) {
            return Ok(());
        }
        // SAFETY: the cache is one of this device's; the driver locks it.
        let data = unsafe { device.get_pipeline_cache_data(self.driver_cache) }
            .map_err(GpuError::call("vkGetPipelineCacheData"))?;
        let file = cache::wrap(&data, info);
        debug_assert!(
            cache::unwrap(&file, info).is_some(),
            "the driver's own header differs from its properties"
        );
        cache::write(path, &file)
            .map_err(|e| GpuError::CacheFile { path: path.display().to_string(), reason: e.to_string() })
    }

    pub fn count(&self) -> usize {
        lock(&self.made).len()
    }

    /// # Safety
    /// No pipeline may be in use any more.
    pub unsafe fn destroy(&self, device: &ash::Device) {
        // SAFETY: the caller promises that none is in use.
        unsafe {
            for (_, pipeline) in lock(&self.made).drain() {
                device.destroy_pipeline(pipeline.raw, None);
            }
            for (_, layout) in lock(&self.layouts).drain() {
                device.destroy_pipeline_layout(layout, None);
            }
            device.destroy_pipeline_cache(self.driver_cache, None);
        }
    }
}

impl ShaderKey {
    fn new(stage: vk::ShaderStageFlags, code: &ShaderCode<'_>) -> ShaderKey {
        let mut hasher = DefaultHasher::new();
        code.spirv.hash(&mut hasher);
        ShaderKey {
            stage,
            name: code.name.to_owned(),
            word_count: code.spirv.len(),
            hash: hasher.finish(),
            constants: code.constants.to_vec(),
        }
    }
}

impl Device {
    /// The compute pipeline of this description, made at its first use. May be called from several threads at once.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the shader's name; [`GpuError::MissingFeature`] where the device does not offer the subgroup's size.
    pub fn compute_pipeline(&self, desc: &ComputePipelineDesc<'_>) -> Result<Pipeline, GpuError> {
        let stage = vk::ShaderStageFlags::COMPUTE;
        self.check_subgroup(desc)?;
        let key = Key {
            shaders: vec![ShaderKey::new(stage, &desc.shader)],
            slots: desc.slots.to_vec(),
            long_lived: desc.long_lived.map(<[_]>::to_vec),
            push_constant_bytes: desc.push_constant_bytes,
            subgroup: desc.subgroup,
            raster: None,
        };
        self.pipeline(key, |layout| {
            let mut stages = Stages::new(&self.0.raw);
            stages.add(stage, &desc.shader)?;
            let specials = stages.specialisations();
            let mut info = stages.infos(&specials)[0];
            let mut size = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default();
            if let Some(subgroup) = desc.subgroup {
                size = size.required_subgroup_size(subgroup.invocations);
                info = info.push_next(&mut size);
                if subgroup.is_full {
                    info = info.flags(vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS);
                }
            }
            let create = vk::ComputePipelineCreateInfo::default().stage(info).layout(layout);
            // SAFETY: module, layout and cache are this device's; the pointers live until the call returns.
            unsafe { self.0.raw.create_compute_pipelines(self.0.pipelines.driver_cache, &[create], None) }
                .map_err(|(_, result)| refused(desc.shader.name, "vkCreateComputePipelines", result))
                .map(|made| made[0])
        })
    }

    fn check_subgroup(&self, desc: &ComputePipelineDesc<'_>) -> Result<(), GpuError> {
        match desc.subgroup {
            Some(asked) if !self.features().offers_subgroup_size(asked.invocations) => {
                Err(GpuError::MissingFeature {
                    device: self.info().name.clone(),
                    missing: format!(
                        "subgroups of {}, which {} asks for",
                        asked.invocations, desc.shader.name
                    ),
                })
            }
            _ => Ok(()),
        }
    }

    /// The raster pipeline of this description, made at its first use. May be called from several threads at once.
    ///
    /// # Errors
    /// [`GpuError::Shader`] with the shaders' names; [`GpuError::UnsupportedSamples`].
    ///
    /// # Panics
    /// If there is not one blend state for each colour format.
    pub fn raster_pipeline(&self, desc: &RasterPipelineDesc<'_>) -> Result<Pipeline, GpuError> {
        assert!(
            desc.blend.len() == desc.color_formats.len(),
            "{}: {} blend states for {} colour attachments",
            desc.vertex.name,
            desc.blend.len(),
            desc.color_formats.len()
        );
        self.check_raster(desc)?;
        let shaders = stages_of(desc);
        let key = Key {
            shaders: shaders.iter().map(|(stage, code)| ShaderKey::new(*stage, code)).collect(),
            slots: desc.slots.to_vec(),
            long_lived: desc.long_lived.map(<[_]>::to_vec),
            push_constant_bytes: desc.push_constant_bytes,
            subgroup: None,
            raster: Some(RasterKey {
                patch_control_points: desc.patch_control_points,
                vertex_bindings: desc.vertex_bindings.to_vec(),
                vertex_attributes: desc.vertex_attributes.to_vec(),
                topology: desc.topology,
                polygon_mode: desc.polygon_mode,
                depth: desc.depth,
                depth_clamp: desc.depth_clamp,
                depth_bias: desc.depth_bias,
                stencil: desc.stencil,
                blend: desc.blend.to_vec(),
                blend_constant_bits: desc.blend_constants.map(f32::to_bits),
                color_formats: desc.color_formats.to_vec(),
                depth_format: desc.depth_format,
                samples: desc.samples,
                sample_shading: desc.sample_shading,
                alpha_to_coverage: desc.alpha_to_coverage,
            }),
        };
        self.pipeline(key, |layout| self.create_raster(desc, &shaders, layout))
    }

    /// Looks `key` up, or makes its pipeline with `create`. The lock is not held meanwhile, so that pipelines are made
    /// in parallel; of two that are made at once for one key the first stays.
    fn pipeline(
        &self,
        key: Key,
        create: impl FnOnce(vk::PipelineLayout) -> Result<vk::Pipeline, GpuError>,
    ) -> Result<Pipeline, GpuError> {
        let store = &self.0.pipelines;
        if let Some(inner) = lock(&store.made).get(&key) {
            return Ok(Pipeline { inner: inner.clone(), _device: self.clone() });
        }
        let names: Vec<&str> = key.shaders.iter().map(|s| s.name.as_str()).collect();
        let name = names.join(" + ");
        let push_stages = key.shaders.iter().fold(vk::ShaderStageFlags::empty(), |all, s| all | s.stage);
        let layout = self.pipeline_layout(&name, &key, push_stages)?;
        let raw = create(layout)?;
        self.set_name(raw, &name);
        store.is_changed.store(true, Ordering::Relaxed);
        let bind_point = if key.raster.is_some() {
            vk::PipelineBindPoint::GRAPHICS
        } else {
            vk::PipelineBindPoint::COMPUTE
        };
        let push_constant_bytes = key.push_constant_bytes;
        let mut made = lock(&store.made);
        if let Some(first) = made.get(&key) {
            // SAFETY: nobody else has this pipeline.
            unsafe { self.0.raw.destroy_pipeline(raw, None) };
            return Ok(Pipeline { inner: first.clone(), _device: self.clone() });
        }
        let inner =
            Arc::new(PipelineInner { raw, layout, bind_point, push_constant_bytes, push_stages, name });
        made.insert(key, inner.clone());
        Ok(Pipeline { inner, _device: self.clone() })
    }

    fn pipeline_layout(
        &self,
        name: &str,
        key: &Key,
        stages: vk::ShaderStageFlags,
    ) -> Result<vk::PipelineLayout, GpuError> {
        let features = self.features();
        let pushed_count: u32 = key.slots.iter().map(|s| s.count).sum();
        check_limit(name, "descriptors in set 0", pushed_count.into(), features.max_push_descriptors.into())?;
        let limit = features.max_push_constant_bytes;
        check_limit(name, "bytes of push constants", key.push_constant_bytes.into(), limit.into())?;
        let pushed = self.set_layout(&key.slots, true)?;
        let long_lived = key.long_lived.as_deref().map(|slots| self.set_layout(slots, false)).transpose()?;
        let layout_key = (pushed, long_lived, key.push_constant_bytes, stages);
        let mut layouts = lock(&self.0.pipelines.layouts);
        if let Some(&layout) = layouts.get(&layout_key) {
            return Ok(layout);
        }
        let sets: Vec<_> = std::iter::once(pushed).chain(long_lived).collect();
        let ranges = [vk::PushConstantRange::default().stage_flags(stages).size(key.push_constant_bytes)];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        if key.push_constant_bytes > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        // SAFETY: the set layouts are this device's and live as long as it does.
        let layout = unsafe { self.0.raw.create_pipeline_layout(&info, None) }
            .map_err(GpuError::call("vkCreatePipelineLayout"))?;
        layouts.insert(layout_key, layout);
        Ok(layout)
    }

    fn check_raster(&self, desc: &RasterPipelineDesc<'_>) -> Result<(), GpuError> {
        let features = self.features();
        let missing = [
            (desc.geometry.is_some() && !features.geometry_shader, "geometry shaders"),
            (desc.tessellation.is_some() && !features.tessellation_shader, "tessellation shaders"),
            (desc.sample_shading && !features.sample_rate_shading, "shading once a sample"),
            (desc.depth_clamp && !features.depth_clamp, "depth clamp"),
            (desc.polygon_mode != vk::PolygonMode::FILL && !features.fill_mode_non_solid, "fill modes"),
            (
                desc.blend.windows(2).any(|w| w[0] != w[1]) && !features.independent_blend,
                "independent blending",
            ),
        ];
        match missing.iter().find(|(is_missing, _)| *is_missing) {
            Some((_, what)) => Err(GpuError::Shader {
                name: desc.vertex.name.to_owned(),
                reason: format!("the device {} has no {what}", self.info().name),
            }),
            None => check_limit(
                desc.vertex.name,
                "colour attachments",
                desc.color_formats.len() as u64,
                features.max_color_attachments.into(),
            ),
        }
    }

    fn create_raster(
        &self,
        desc: &RasterPipelineDesc<'_>,
        shaders: &[(vk::ShaderStageFlags, ShaderCode<'_>)],
        layout: vk::PipelineLayout,
    ) -> Result<vk::Pipeline, GpuError> {
        let mut stages = Stages::new(&self.0.raw);
        for (stage, code) in shaders {
            stages.add(*stage, code)?;
        }
        let specials = stages.specialisations();
        let infos = stages.infos(&specials);
        let bindings: Vec<_> = desc.vertex_bindings.iter().map(vertex_binding).collect();
        let attributes: Vec<_> = desc.vertex_attributes.iter().map(vertex_attribute).collect();
        let vertex = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(desc.topology);
        let tessellation = vk::PipelineTessellationStateCreateInfo::default()
            .patch_control_points(desc.patch_control_points.max(1));
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .depth_clamp_enable(desc.depth_clamp)
            .depth_bias_enable(desc.depth_bias)
            .polygon_mode(desc.polygon_mode)
            .line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(desc.samples))
            .sample_shading_enable(desc.sample_shading)
            .min_sample_shading(1.0)
            .alpha_to_coverage_enable(desc.alpha_to_coverage);
        let depth_stencil = depth_stencil(desc);
        let blends: Vec<_> = desc.blend.iter().map(blend_attachment).collect();
        let blend = vk::PipelineColorBlendStateCreateInfo::default()
            .attachments(&blends)
            .blend_constants(desc.blend_constants);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&[
            vk::DynamicState::VIEWPORT,
            vk::DynamicState::SCISSOR,
            vk::DynamicState::CULL_MODE,
            vk::DynamicState::FRONT_FACE,
            vk::DynamicState::STENCIL_REFERENCE,
            vk::DynamicState::DEPTH_BIAS,
        ]);
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(desc.color_formats);
        if let Some(format) = desc.depth_format {
            let aspect = aspect_of(format);
            if aspect.contains(vk::ImageAspectFlags::DEPTH) {
                rendering = rendering.depth_attachment_format(format);
            }
            if aspect.contains(vk::ImageAspectFlags::STENCIL) {
                rendering = rendering.stencil_attachment_format(format);
            }
        }
        let mut create = vk::GraphicsPipelineCreateInfo::default()
            .stages(&infos)
            .vertex_input_state(&vertex)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth_stencil)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout)
            .push_next(&mut rendering);
        if desc.tessellation.is_some() {
            create = create.tessellation_state(&tessellation);
        }
        // SAFETY: modules, layout and cache are this device's; the pointers live until the call returns.
        unsafe { self.0.raw.create_graphics_pipelines(self.0.pipelines.driver_cache, &[create], None) }
            .map_err(|(_, result)| refused(desc.vertex.name, "vkCreateGraphicsPipelines", result))
            .map(|made| made[0])
    }
}

fn stages_of<'a>(desc: &RasterPipelineDesc<'a>) -> Vec<(vk::ShaderStageFlags, ShaderCode<'a>)> {
    let mut stages = vec![(vk::ShaderStageFlags::VERTEX, desc.vertex)];
    if let Some([control, evaluation]) = desc.tessellation {
        stages.push((vk::ShaderStageFlags::TESSELLATION_CONTROL, control));
        stages.push((vk::ShaderStageFlags::TESSELLATION_EVALUATION, evaluation));
    }
    stages.extend(desc.geometry.map(|code| (vk::ShaderStageFlags::GEOMETRY, code)));
    stages.extend(desc.fragment.map(|code| (vk::ShaderStageFlags::FRAGMENT, code)));
    stages
}

fn vertex_binding(b: &VertexBinding) -> vk::VertexInputBindingDescription {
    let rate = if b.per_instance { vk::VertexInputRate::INSTANCE } else { vk::VertexInputRate::VERTEX };
    vk::VertexInputBindingDescription { binding: b.binding, stride: b.stride_bytes, input_rate: rate }
}

fn vertex_attribute(a: &VertexAttribute) -> vk::VertexInputAttributeDescription {
    vk::VertexInputAttributeDescription {
        location: a.location,
        binding: a.binding,
        format: a.format,
        offset: a.offset_bytes,
    }
}

fn depth_stencil(desc: &RasterPipelineDesc<'_>) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    let mut state = vk::PipelineDepthStencilStateCreateInfo::default();
    if let Some(depth) = desc.depth {
        state = state.depth_test_enable(true).depth_write_enable(depth.write).depth_compare_op(depth.compare);
    }
    if let Some(stencil) = desc.stencil {
        state = state
            .stencil_test_enable(true)
            .front(stencil_face(&stencil.front))
            .back(stencil_face(&stencil.back));
    }
    state
}

fn stencil_face(face: &StencilFace) -> vk::StencilOpState {
    vk::StencilOpState {
        fail_op: face.fail,
        pass_op: face.pass,
        depth_fail_op: face.depth_fail,
        compare_op: face.compare,
        compare_mask: face.compare_mask,
        write_mask: face.write_mask,
        reference: 0,
    }
}

fn blend_attachment(blend: &BlendState) -> vk::PipelineColorBlendAttachmentState {
    let state = vk::PipelineColorBlendAttachmentState::default().color_write_mask(blend.write);
    match blend.equation {
        None => state,
        Some(e) => state
            .blend_enable(true)
            .src_color_blend_factor(e.color[0])
            .dst_color_blend_factor(e.color[1])
            .color_blend_op(e.color_op)
            .src_alpha_blend_factor(e.alpha[0])
            .dst_alpha_blend_factor(e.alpha[1])
            .alpha_blend_op(e.alpha_op),
    }
}

fn refused(name: &str, call: &'static str, result: vk::Result) -> GpuError {
    match result {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            GpuError::OutOfMemory { resource: format!("pipeline {name}"), bytes: 0 }
        }
        result => GpuError::Shader { name: name.to_owned(), reason: format!("{call} failed: {result}") },
    }
}

/// The shader modules and specialisations of one pipeline; the modules go when it is made.
struct Stages<'a> {
    device: &'a ash::Device,
    stages: Vec<Stage>,
}

struct Stage {
    flag: vk::ShaderStageFlags,
    module: vk::ShaderModule,
    entries: Vec<vk::SpecializationMapEntry>,
    data: Vec<u8>,
}

impl<'a> Stages<'a> {
    fn new(device: &'a ash::Device) -> Self {
        Stages { device, stages: Vec::new() }
    }

    fn add(&mut self, flag: vk::ShaderStageFlags, code: &ShaderCode<'_>) -> Result<(), GpuError> {
        /// First word of every SPIR-V module.
        const SPIRV_MAGIC: u32 = 0x0723_0203;
        if code.spirv.first() != Some(&SPIRV_MAGIC) {
            return Err(GpuError::Shader {
                name: code.name.to_owned(),
                reason: format!(
                    "no SPIR-V: it begins with {:#010x}, expected {SPIRV_MAGIC:#010x}",
                    code.spirv.first().copied().unwrap_or(0)
                ),
            });
        }
        let info = vk::ShaderModuleCreateInfo::default().code(code.spirv);
        // SAFETY: the code is SPIR-V by its first word and comes from the shader build, which validates it.
        let module = unsafe { self.device.create_shader_module(&info, None) }
            .map_err(|result| refused(code.name, "vkCreateShaderModule", result))?;
        let entries = code.constants.iter().enumerate();
        self.stages.push(Stage {
            flag,
            module,
            entries: entries
                .map(|(i, (id, _))| vk::SpecializationMapEntry {
                    constant_id: *id,
                    offset: 4 * i as u32,
                    size: 4,
                })
                .collect(),
            data: code.constants.iter().flat_map(|(_, bits)| bits.to_ne_bytes()).collect(),
        });
        Ok(())
    }

    /// One for each stage; [`Stages::infos`] points to them.
    fn specialisations(&self) -> Vec<vk::SpecializationInfo<'_>> {
        self.stages
            .iter()
            .map(|s| vk::SpecializationInfo::default().map_entries(&s.entries).data(&s.data))
            .collect()
    }

    fn infos<'s>(
        &self,
        specials: &'s [vk::SpecializationInfo<'s>],
    ) -> Vec<vk::PipelineShaderStageCreateInfo<'s>> {
        let stages = self.stages.iter().zip(specials);
        stages
            .map(|(stage, special)| {
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(stage.flag)
                    .module(stage.module)
                    .name(c"main")
                    .specialization_info(special)
            })
            .collect()
    }
}

impl Drop for Stages<'_> {
    fn drop(&mut self) {
        for stage in &self.stages {
            // SAFETY: pipelines do not need their modules once made.
            unsafe { self.device.destroy_shader_module(stage.module, None) };
        }
    }
}
