//! What a device is and what it can do, as plain data.

use crate::adopt::{Adopted, missing_of_opened};
use ash::{khr, vk};

/// Which device it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Place in the loader's order, from 0; what `--device INDEX` takes.
    pub index: u32,
    /// The device's name as the driver gives it.
    pub name: String,
    /// The driver's name and version.
    pub driver: String,
    /// The Vulkan version of the device, `major.minor.patch`.
    pub api: String,
    /// `cpu`, `discrete`, `integrated`, `virtual` or `other`.
    pub kind: &'static str,
    /// PCI vendor, or a Khronos vendor id.
    pub vendor_id: u32,
    /// The vendor's id of the device.
    pub device_id: u32,
    /// Identifies device and driver build for the pipeline cache (`pipelineCacheUUID`).
    pub pipeline_cache_uuid: [u8; 16],
}

macro_rules! features {
    ($($(#[doc = $doc:literal])+ $name:ident: $type:ty,)*) => {
        /// What a device can do: every field is detected, none assumed from a name. Booleans that are true are enabled.
        #[derive(Clone, Debug, Default, PartialEq)]
        #[non_exhaustive]
        pub struct Features { $($(#[doc = $doc])+ pub $name: $type,)* }
    };
}

features! {
    /// Sample counts of floating-point and normalised colour attachments: a bit mask, bit value = count.
    sample_counts_color: u32,
    /// Sample counts of depth attachments: a bit mask, bit value = count.
    sample_counts_depth: u32,
    /// Sample counts of stencil attachments: a bit mask, bit value = count.
    sample_counts_stencil: u32,
    /// Sample counts of integer colour attachments: a bit mask, bit value = count.
    sample_counts_integer: u32,
    /// Sample counts of storage images: a bit mask, bit value = count.
    sample_counts_storage: u32,
    /// Samples stand where the specification's table of standard locations has them.
    standard_sample_locations: bool,
    /// `VK_EXT_post_depth_coverage`.
    post_depth_coverage: bool,
    /// `VK_KHR_fragment_shader_barycentric`.
    fragment_barycentric: bool,
    /// `VK_EXT_mesh_shader`: mesh shaders.
    mesh_shader: bool,
    /// `VK_EXT_mesh_shader`: task shaders.
    task_shader: bool,
    /// `VK_KHR_fragment_shading_rate`: a rate a pipeline.
    fragment_shading_rate: bool,
    /// `VK_KHR_fragment_shading_rate`: a rate image.
    fragment_shading_rate_attachment: bool,
    /// Smallest texel of a shading-rate image, in pixels; 0 without one.
    fragment_shading_rate_texel_px: [u32; 2],
    /// `VK_EXT_fragment_shader_interlock` with pixel granularity.
    fragment_interlock_pixel: bool,
    /// `VK_EXT_fragment_shader_interlock` with sample granularity.
    fragment_interlock_sample: bool,
    /// Run-time arrays, non-uniform indexing of sampled images and partly bound sets, all three.
    descriptor_indexing: bool,
    /// Invocations in a subgroup.
    subgroup_size: u32,
    /// The smallest subgroup that a pipeline may ask for.
    min_subgroup_size: u32,
    /// The largest subgroup that a pipeline may ask for.
    max_subgroup_size: u32,
    /// Which subgroup operations there are.
    subgroup_operations: vk::SubgroupFeatureFlags,
    /// In which stages subgroup operations are.
    subgroup_stages: vk::ShaderStageFlags,
    /// A compute pipeline can require a subgroup size, and that subgroups are full.
    subgroup_size_control: bool,
    /// Pipeline-statistics queries.
    pipeline_statistics: bool,
    /// Nanoseconds in a timestamp tick.
    timestamp_period_ns: f32,
    /// Valid bits of a timestamp on the queue in use; 0 where it has none.
    timestamp_valid_bits: u32,
    /// `VK_KHR_push_descriptor`.
    push_descriptor: bool,
    /// Descriptors that a pushed set may have.
    max_push_descriptors: u32,
    /// Bytes of push constants.
    max_push_constant_bytes: u32,
    /// Indirect draws whose count is in a buffer.
    draw_indirect_count: bool,
    /// More than one draw in an indirect call.
    multi_draw_indirect: bool,
    /// Indirect draws with a first instance other than 0.
    draw_indirect_first_instance: bool,
    /// `gl_DrawID`, `gl_BaseInstance`, `gl_BaseVertex`.
    shader_draw_parameters: bool,
    /// Geometry shaders, and `gl_PrimitiveID` in fragment shaders.
    geometry_shader: bool,
    /// Tessellation shaders.
    tessellation_shader: bool,
    /// Blend state of its own for each attachment.
    independent_blend: bool,
    /// Blending with a second source colour.
    dual_source_blend: bool,
    /// Fragment shading once a sample.
    sample_rate_shading: bool,
    /// Depth clamped instead of clipped.
    depth_clamp: bool,
    /// Depth bias with a clamp.
    depth_bias_clamp: bool,
    /// Lines and points as fill mode.
    fill_mode_non_solid: bool,
    /// Anisotropic filtering.
    sampler_anisotropy: bool,
    /// The largest anisotropy.
    max_sampler_anisotropy: f32,
    /// Minimum and maximum filters.
    sampler_filter_minmax: bool,
    /// Stores and atomics in fragment shaders.
    fragment_stores_and_atomics: bool,
    /// Stores and atomics in vertex, tessellation and geometry shaders.
    vertex_stores_and_atomics: bool,
    /// Multisampled storage images.
    storage_image_multisample: bool,
    /// Storage image reads without a format in the shader.
    storage_image_read_without_format: bool,
    /// Storage image writes without a format in the shader.
    storage_image_write_without_format: bool,
    /// The extended set of storage image formats.
    storage_image_extended_formats: bool,
    /// Sampled images indexed by dynamically uniform values.
    sampled_image_array_dynamic_indexing: bool,
    /// Storage buffers indexed by dynamically uniform values.
    storage_buffer_array_dynamic_indexing: bool,
    /// Clip distances in shaders.
    shader_clip_distance: bool,
    /// Cull distances in shaders.
    shader_cull_distance: bool,
    /// 64-bit integers in shaders.
    shader_int64: bool,
    /// 16-bit integers in shaders.
    shader_int16: bool,
    /// 8-bit integers in shaders.
    shader_int8: bool,
    /// 16-bit floats in shaders.
    shader_float16: bool,
    /// 64-bit floats in shaders.
    shader_float64: bool,
    /// 16-bit values in storage buffers.
    storage_buffer_16bit: bool,
    /// 8-bit values in storage buffers.
    storage_buffer_8bit: bool,
    /// 64-bit atomics on buffers.
    buffer_int64_atomics: bool,
    /// 64-bit atomics on shared memory.
    shared_int64_atomics: bool,
    /// Scalar block layout.
    scalar_block_layout: bool,
    /// Discard that keeps helper invocations.
    demote_to_helper_invocation: bool,
    /// `gl_Layer` written by vertex shaders.
    shader_output_layer: bool,
    /// Buffer addresses in shaders.
    buffer_device_address: bool,
    /// Block-compressed textures BC1 to BC7.
    texture_compression_bc: bool,
    /// Depth and stencil aspects in layouts of their own.
    separate_depth_stencil_layouts: bool,
    /// Largest width or height of a 2D image, in texels.
    max_image_dimension_2d: u32,
    /// Most layers of an image.
    max_array_layers: u32,
    /// Most colour attachments.
    max_color_attachments: u32,
    /// Bytes of a storage buffer that a shader can reach through one binding.
    max_storage_buffer_range: u64,
    /// Bytes of a uniform buffer that a shader can reach through one binding.
    max_uniform_buffer_range: u64,
    /// Largest buffer, in bytes.
    max_buffer_bytes: u64,
    /// Largest single allocation, in bytes.
    max_allocation_bytes: u64,
    /// Sampled images that one stage may use.
    max_sampled_images_per_stage: u32,
    /// Samplers that one stage may use.
    max_samplers_per_stage: u32,
    /// Storage buffers that one stage may use.
    max_storage_buffers_per_stage: u32,
    /// Storage images that one stage may use.
    max_storage_images_per_stage: u32,
    /// Workgroup memory, in bytes.
    max_shared_memory_bytes: u32,
    /// Invocations in a workgroup.
    max_workgroup_invocations: u32,
    /// Workgroup size along each axis.
    max_workgroup_size: [u32; 3],
    /// Workgroups of a dispatch along each axis.
    max_workgroup_count: [u32; 3],
    /// Draws of one indirect call.
    max_draw_indirect_count: u32,
    /// Alignment of uniform buffer offsets, in bytes.
    min_uniform_offset_bytes: u64,
    /// Alignment of storage buffer offsets, in bytes.
    min_storage_offset_bytes: u64,
    /// Buffers and images in the same memory page of this size must not be neighbours, in bytes.
    buffer_image_granularity_bytes: u64,
    /// The largest device-local heap, in bytes.
    device_local_heap_bytes: u64,
    /// Device-local memory that the host can map is the only device-local memory (CPU devices, integrated GPUs).
    unified_memory: bool,
}

impl Features {
    /// Whether `samples` a pixel exist for colour (`integer`: integer colour) and depth together.
    pub fn supports_samples(&self, samples: u32, integer: bool) -> bool {
        let color = if integer { self.sample_counts_integer } else { self.sample_counts_color };
        samples.is_power_of_two() && color & self.sample_counts_depth & samples != 0
    }

    /// Whether a compute pipeline can require subgroups of that many invocations.
    pub fn offers_subgroup_size(&self, invocations: u32) -> bool {
        self.subgroup_size_control
            && invocations.is_power_of_two()
            && (self.min_subgroup_size..=self.max_subgroup_size).contains(&invocations)
    }

    /// Sizes of subgroups that a compute pipeline can require, ascending.
    pub fn subgroup_sizes(&self) -> Vec<u32> {
        (0..=7).map(|log2| 1 << log2).filter(|size| self.offers_subgroup_size(*size)).collect()
    }
}

/// The features to enable, kept together since they are chained by pointers.
#[derive(Clone)]
pub(crate) struct Enable {
    pub core: vk::PhysicalDeviceFeatures,
    pub v11: vk::PhysicalDeviceVulkan11Features<'static>,
    pub v12: vk::PhysicalDeviceVulkan12Features<'static>,
    pub v13: vk::PhysicalDeviceVulkan13Features<'static>,
    pub shading_rate: vk::PhysicalDeviceFragmentShadingRateFeaturesKHR<'static>,
    pub barycentric: vk::PhysicalDeviceFragmentShaderBarycentricFeaturesKHR<'static>,
    pub mesh: vk::PhysicalDeviceMeshShaderFeaturesEXT<'static>,
    pub interlock: vk::PhysicalDeviceFragmentShaderInterlockFeaturesEXT<'static>,
    pub extensions: Vec<&'static std::ffi::CStr>,
}

/// All that was found out about one physical device.
pub(crate) struct Detected {
    pub info: DeviceInfo,
    pub features: Features,
    pub missing: Vec<&'static str>,
    pub enable: Enable,
    pub queue_family: u32,
}

macro_rules! take {
    ($from:expr, $to:expr; $($field:ident),* $(,)?) => { $($to.$field = $from.$field;)* };
}

/// Examines `physical`: properties, features, extensions, queues.
pub(crate) fn detect(instance: &ash::Instance, physical: vk::PhysicalDevice, index: u32) -> Detected {
    let extensions = device_extensions(instance, physical);
    let has = |name: &std::ffi::CStr| extensions.iter().any(|e| e.as_c_str() == name);
    detect_with(instance, physical, index, &has, None)
}

/// Examines a device that was opened already: what was not enabled is not there.
///
/// # Safety
/// The handles are alive and belong together; every structure in the chain of features is what its `sType` says.
pub(crate) unsafe fn detect_opened(adopted: &Adopted<'_>) -> Detected {
    let has = |name: &std::ffi::CStr| adopted.extensions.contains(&name);
    // SAFETY: the caller promises that the chain is valid.
    let opened = unsafe { OpenedFeatures::of(adopted.features) };
    let mut detected = detect_with(&adopted.instance, adopted.physical, 0, &has, Some(&opened));
    detected.queue_family = adopted.queue_family;
    // SAFETY: the physical device belongs to the instance.
    let families = unsafe { adopted.instance.get_physical_device_queue_family_properties(adopted.physical) };
    let family = families.get(adopted.queue_family as usize);
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    if !family.is_some_and(|family| family.queue_flags.contains(wanted)) {
        detected.missing.push("graphics and compute on the queue");
    }
    detected.features.timestamp_valid_bits = family.map_or(0, |family| family.timestamp_valid_bits);
    detected
}

/// The features that a device was opened with.
#[derive(Default)]
struct OpenedFeatures {
    core: vk::PhysicalDeviceFeatures,
    v11: vk::PhysicalDeviceVulkan11Features<'static>,
    v12: vk::PhysicalDeviceVulkan12Features<'static>,
    v13: vk::PhysicalDeviceVulkan13Features<'static>,
    shading_rate: vk::PhysicalDeviceFragmentShadingRateFeaturesKHR<'static>,
    barycentric: vk::PhysicalDeviceFragmentShaderBarycentricFeaturesKHR<'static>,
    mesh: vk::PhysicalDeviceMeshShaderFeaturesEXT<'static>,
    interlock: vk::PhysicalDeviceFragmentShaderInterlockFeaturesEXT<'static>,
}

impl OpenedFeatures {
    /// # Safety
    /// Every structure in the chain is what its `sType` says.
    unsafe fn of(features: &vk::PhysicalDeviceFeatures2<'_>) -> OpenedFeatures {
        let mut opened = OpenedFeatures { core: features.features, ..OpenedFeatures::default() };
        let mut next = features.p_next.cast::<vk::BaseInStructure<'_>>().cast_const();
        macro_rules! copy {
            ($($field:ident: $type:ident),* $(,)?) => {
                // SAFETY: the caller promises that `next` is null or a structure of the type that it says. What is copied has its own end
                // of the chain.
                unsafe {
                    while let Some(base) = next.as_ref() {
                        match base.s_type {
                            $(<vk::$type<'_> as vk::TaggedStructure>::STRUCTURE_TYPE => {
                                opened.$field = *next.cast::<vk::$type<'static>>();
                                opened.$field.p_next = std::ptr::null_mut();
                            })*
                            _ => {}
                        }
                        next = base.p_next;
                    }
                }
            };
        }
        copy!(
            v11: PhysicalDeviceVulkan11Features,
            v12: PhysicalDeviceVulkan12Features,
            v13: PhysicalDeviceVulkan13Features,
            shading_rate: PhysicalDeviceFragmentShadingRateFeaturesKHR,
            barycentric: PhysicalDeviceFragmentShaderBarycentricFeaturesKHR,
            mesh: PhysicalDeviceMeshShaderFeaturesEXT,
            interlock: PhysicalDeviceFragmentShaderInterlockFeaturesEXT,
        );
        opened
    }
}

impl Enable {
    /// The features as a chain for `VkDeviceCreateInfo::pNext`.
    pub fn chain(&mut self) -> vk::PhysicalDeviceFeatures2<'_> {
        let has = |name: &std::ffi::CStr| self.extensions.contains(&name);
        let (rate, barycentric) =
            (has(khr::fragment_shading_rate::NAME), has(khr::fragment_shader_barycentric::NAME));
        let (mesh, interlock) =
            (has(ash::ext::mesh_shader::NAME), has(ash::ext::fragment_shader_interlock::NAME));
        // What an earlier chain has linked is linked anew.
        let none = std::ptr::null_mut();
        (self.v11.p_next, self.v12.p_next, self.v13.p_next) = (none, none, none);
        (self.shading_rate.p_next, self.barycentric.p_next) = (none, none);
        (self.mesh.p_next, self.interlock.p_next) = (none, none);
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .features(self.core)
            .push_next(&mut self.v11)
            .push_next(&mut self.v12)
            .push_next(&mut self.v13);
        if rate {
            features = features.push_next(&mut self.shading_rate);
        }
        if barycentric {
            features = features.push_next(&mut self.barycentric);
        }
        if mesh {
            features = features.push_next(&mut self.mesh);
        }
        if interlock {
            features = features.push_next(&mut self.interlock);
        }
        features
    }
}

/// Examines `physical`, whose extensions `has` tells; where it was opened already, of its features those that are enabled.
fn detect_with(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    index: u32,
    has: &dyn Fn(&std::ffi::CStr) -> bool,
    opened: Option<&OpenedFeatures>,
) -> Detected {
    // SAFETY: `physical` was enumerated from `instance`, which is alive; so for every query of this function.
    let base = unsafe { instance.get_physical_device_properties(physical) };
    let is_13 = base.api_version >= vk::API_VERSION_1_3;

    let mut missing = Vec::new();
    if !is_13 {
        missing.push("Vulkan 1.3");
    }
    if !has(khr::push_descriptor::NAME) {
        missing.push("VK_KHR_push_descriptor");
    }

    let mut p11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut p12 = vk::PhysicalDeviceVulkan12Properties::default();
    let mut p13 = vk::PhysicalDeviceVulkan13Properties::default();
    let mut push = vk::PhysicalDevicePushDescriptorPropertiesKHR::default();
    let mut rate_properties = vk::PhysicalDeviceFragmentShadingRatePropertiesKHR::default();
    let mut f11 = vk::PhysicalDeviceVulkan11Features::default();
    let mut f12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut f13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut shading_rate = vk::PhysicalDeviceFragmentShadingRateFeaturesKHR::default();
    let mut barycentric = vk::PhysicalDeviceFragmentShaderBarycentricFeaturesKHR::default();
    let mut mesh = vk::PhysicalDeviceMeshShaderFeaturesEXT::default();
    let mut interlock = vk::PhysicalDeviceFragmentShaderInterlockFeaturesEXT::default();
    let mut core = vk::PhysicalDeviceFeatures::default();
    if is_13 {
        let mut properties = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut p11)
            .push_next(&mut p12)
            .push_next(&mut p13);
        if has(khr::push_descriptor::NAME) {
            properties = properties.push_next(&mut push);
        }
        if has(khr::fragment_shading_rate::NAME) {
            properties = properties.push_next(&mut rate_properties);
        }
        // SAFETY: the chained structures are those of Vulkan 1.3 or of extensions that the device lists.
        unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut f11)
            .push_next(&mut f12)
            .push_next(&mut f13);
        if has(khr::fragment_shading_rate::NAME) {
            features = features.push_next(&mut shading_rate);
        }
        if has(khr::fragment_shader_barycentric::NAME) {
            features = features.push_next(&mut barycentric);
        }
        if has(ash::ext::mesh_shader::NAME) {
            features = features.push_next(&mut mesh);
        }
        if has(ash::ext::fragment_shader_interlock::NAME) {
            features = features.push_next(&mut interlock);
        }
        // SAFETY: as above.
        unsafe { instance.get_physical_device_features2(physical, &mut features) };
        core = features.features;
    }
    if let Some(opened) = opened {
        core = opened.core;
        (f11, f12, f13) = (opened.v11, opened.v12, opened.v13);
        (shading_rate, barycentric) = (opened.shading_rate, opened.barycentric);
        (mesh, interlock) = (opened.mesh, opened.interlock);
        missing.extend(missing_of_opened(&f12, &f13));
    }

    let operations = vk::SubgroupFeatureFlags::ARITHMETIC | vk::SubgroupFeatureFlags::BALLOT;
    if is_13
        && !(p11.subgroup_supported_operations.contains(operations)
            && p11.subgroup_supported_stages.contains(vk::ShaderStageFlags::COMPUTE))
    {
        missing.push("subgroup arithmetic and ballots in compute shaders");
    }

    // SAFETY: `physical` belongs to `instance`.
    let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let queue_family = families.iter().position(|f| f.queue_flags.contains(wanted));
    if queue_family.is_none() {
        missing.push("a queue with graphics and compute");
    }
    let timestamp_valid_bits = queue_family.map_or(0, |f| families[f].timestamp_valid_bits);
    let queue_family = queue_family.unwrap_or(0) as u32;

    let enable = choose(&core, &f11, &f12, &f13, shading_rate, barycentric, mesh, interlock, has);
    // SAFETY: `physical` belongs to `instance`.
    let memory = unsafe { instance.get_physical_device_memory_properties(physical) };
    let info = DeviceInfo {
        index,
        name: c_text(&base.device_name),
        driver: if is_13 {
            format!("{} {}", c_text(&p12.driver_name), c_text(&p12.driver_info)).trim().to_owned()
        } else {
            format!("{:#x}", base.driver_version)
        },
        api: format!(
            "{}.{}.{}",
            vk::api_version_major(base.api_version),
            vk::api_version_minor(base.api_version),
            vk::api_version_patch(base.api_version)
        ),
        kind: match base.device_type {
            vk::PhysicalDeviceType::CPU => "cpu",
            vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
            vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
            vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
            _ => "other",
        },
        vendor_id: base.vendor_id,
        device_id: base.device_id,
        pipeline_cache_uuid: base.pipeline_cache_uuid,
    };
    let limits = &base.limits;
    let on = |b: vk::Bool32| b == vk::TRUE;
    let local = vk::MemoryPropertyFlags::DEVICE_LOCAL;
    let visible = vk::MemoryPropertyFlags::HOST_VISIBLE;
    let types = memory.memory_types_as_slice();
    let features = Features {
        sample_counts_color: limits.framebuffer_color_sample_counts.as_raw(),
        sample_counts_depth: limits.framebuffer_depth_sample_counts.as_raw(),
        sample_counts_stencil: limits.framebuffer_stencil_sample_counts.as_raw(),
        sample_counts_integer: p12.framebuffer_integer_color_sample_counts.as_raw(),
        sample_counts_storage: limits.storage_image_sample_counts.as_raw(),
        standard_sample_locations: on(limits.standard_sample_locations),
        post_depth_coverage: has(ash::ext::post_depth_coverage::NAME),
        fragment_barycentric: on(enable.barycentric.fragment_shader_barycentric),
        mesh_shader: on(enable.mesh.mesh_shader),
        task_shader: on(enable.mesh.task_shader),
        fragment_shading_rate: on(enable.shading_rate.pipeline_fragment_shading_rate),
        fragment_shading_rate_attachment: on(enable.shading_rate.attachment_fragment_shading_rate),
        fragment_shading_rate_texel_px: [
            rate_properties.min_fragment_shading_rate_attachment_texel_size.width,
            rate_properties.min_fragment_shading_rate_attachment_texel_size.height,
        ],
        fragment_interlock_pixel: on(enable.interlock.fragment_shader_pixel_interlock),
        fragment_interlock_sample: on(enable.interlock.fragment_shader_sample_interlock),
        descriptor_indexing: on(enable.v12.runtime_descriptor_array),
        subgroup_size: p11.subgroup_size,
        min_subgroup_size: p13.min_subgroup_size,
        max_subgroup_size: p13.max_subgroup_size,
        subgroup_operations: p11.subgroup_supported_operations,
        subgroup_stages: p11.subgroup_supported_stages,
        subgroup_size_control: on(enable.v13.subgroup_size_control)
            && on(enable.v13.compute_full_subgroups)
            && p13.required_subgroup_size_stages.contains(vk::ShaderStageFlags::COMPUTE),
        pipeline_statistics: on(enable.core.pipeline_statistics_query),
        timestamp_period_ns: limits.timestamp_period,
        timestamp_valid_bits,
        push_descriptor: has(khr::push_descriptor::NAME),
        max_push_descriptors: push.max_push_descriptors,
        max_push_constant_bytes: limits.max_push_constants_size,
        draw_indirect_count: on(enable.v12.draw_indirect_count),
        multi_draw_indirect: on(enable.core.multi_draw_indirect),
        draw_indirect_first_instance: on(enable.core.draw_indirect_first_instance),
        shader_draw_parameters: on(enable.v11.shader_draw_parameters),
        geometry_shader: on(enable.core.geometry_shader),
        tessellation_shader: on(enable.core.tessellation_shader),
        independent_blend: on(enable.core.independent_blend),
        dual_source_blend: on(enable.core.dual_src_blend),
        sample_rate_shading: on(enable.core.sample_rate_shading),
        depth_clamp: on(enable.core.depth_clamp),
        depth_bias_clamp: on(enable.core.depth_bias_clamp),
        fill_mode_non_solid: on(enable.core.fill_mode_non_solid),
        sampler_anisotropy: on(enable.core.sampler_anisotropy),
        max_sampler_anisotropy: limits.max_sampler_anisotropy,
        sampler_filter_minmax: on(enable.v12.sampler_filter_minmax),
        fragment_stores_and_atomics: on(enable.core.fragment_stores_and_atomics),
        vertex_stores_and_atomics: on(enable.core.vertex_pipeline_stores_and_atomics),
        storage_image_multisample: on(enable.core.shader_storage_image_multisample),
        storage_image_read_without_format: on(enable.core.shader_storage_image_read_without_format),
        storage_image_write_without_format: on(enable.core.shader_storage_image_write_without_format),
        storage_image_extended_formats: on(enable.core.shader_storage_image_extended_formats),
        sampled_image_array_dynamic_indexing: on(enable.core.shader_sampled_image_array_dynamic_indexing),
        storage_buffer_array_dynamic_indexing: on(enable.core.shader_storage_buffer_array_dynamic_indexing),
        shader_clip_distance: on(enable.core.shader_clip_distance),
        shader_cull_distance: on(enable.core.shader_cull_distance),
        shader_int64: on(enable.core.shader_int64),
        shader_int16: on(enable.core.shader_int16),
        shader_int8: on(enable.v12.shader_int8),
        shader_float16: on(enable.v12.shader_float16),
        shader_float64: on(enable.core.shader_float64),
        storage_buffer_16bit: on(enable.v11.storage_buffer16_bit_access),
        storage_buffer_8bit: on(enable.v12.storage_buffer8_bit_access),
        buffer_int64_atomics: on(enable.v12.shader_buffer_int64_atomics),
        shared_int64_atomics: on(enable.v12.shader_shared_int64_atomics),
        scalar_block_layout: on(enable.v12.scalar_block_layout),
        demote_to_helper_invocation: on(enable.v13.shader_demote_to_helper_invocation),
        shader_output_layer: on(enable.v12.shader_output_layer),
        buffer_device_address: on(enable.v12.buffer_device_address),
        texture_compression_bc: on(enable.core.texture_compression_bc),
        separate_depth_stencil_layouts: on(enable.v12.separate_depth_stencil_layouts),
        max_image_dimension_2d: limits.max_image_dimension2_d,
        max_array_layers: limits.max_image_array_layers,
        max_color_attachments: limits.max_color_attachments,
        max_storage_buffer_range: u64::from(limits.max_storage_buffer_range),
        max_uniform_buffer_range: u64::from(limits.max_uniform_buffer_range),
        max_buffer_bytes: p13.max_buffer_size,
        max_allocation_bytes: p11.max_memory_allocation_size,
        max_sampled_images_per_stage: limits.max_per_stage_descriptor_sampled_images,
        max_samplers_per_stage: limits.max_per_stage_descriptor_samplers,
        max_storage_buffers_per_stage: limits.max_per_stage_descriptor_storage_buffers,
        max_storage_images_per_stage: limits.max_per_stage_descriptor_storage_images,
        max_shared_memory_bytes: limits.max_compute_shared_memory_size,
        max_workgroup_invocations: limits.max_compute_work_group_invocations,
        max_workgroup_size: limits.max_compute_work_group_size,
        max_workgroup_count: limits.max_compute_work_group_count,
        max_draw_indirect_count: limits.max_draw_indirect_count,
        min_uniform_offset_bytes: limits.min_uniform_buffer_offset_alignment,
        min_storage_offset_bytes: limits.min_storage_buffer_offset_alignment,
        buffer_image_granularity_bytes: limits.buffer_image_granularity,
        device_local_heap_bytes: memory
            .memory_heaps_as_slice()
            .iter()
            .filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
            .map(|h| h.size)
            .max()
            .unwrap_or(0),
        unified_memory: types
            .iter()
            .filter(|t| t.property_flags.contains(local))
            .all(|t| t.property_flags.contains(visible)),
    };
    Detected { info, features, missing, enable, queue_family }
}

/// Of what the device has, what the workbench uses.
fn choose(
    core: &vk::PhysicalDeviceFeatures,
    f11: &vk::PhysicalDeviceVulkan11Features<'_>,
    f12: &vk::PhysicalDeviceVulkan12Features<'_>,
    f13: &vk::PhysicalDeviceVulkan13Features<'_>,
    shading_rate: vk::PhysicalDeviceFragmentShadingRateFeaturesKHR<'_>,
    barycentric: vk::PhysicalDeviceFragmentShaderBarycentricFeaturesKHR<'_>,
    mesh: vk::PhysicalDeviceMeshShaderFeaturesEXT<'_>,
    interlock: vk::PhysicalDeviceFragmentShaderInterlockFeaturesEXT<'_>,
    has: &dyn Fn(&std::ffi::CStr) -> bool,
) -> Enable {
    let mut enable = Enable {
        core: vk::PhysicalDeviceFeatures::default(),
        v11: vk::PhysicalDeviceVulkan11Features::default(),
        v12: vk::PhysicalDeviceVulkan12Features::default(),
        v13: vk::PhysicalDeviceVulkan13Features::default(),
        shading_rate: vk::PhysicalDeviceFragmentShadingRateFeaturesKHR::default(),
        barycentric: vk::PhysicalDeviceFragmentShaderBarycentricFeaturesKHR::default(),
        mesh: vk::PhysicalDeviceMeshShaderFeaturesEXT::default(),
        interlock: vk::PhysicalDeviceFragmentShaderInterlockFeaturesEXT::default(),
        extensions: Vec::new(),
    };
    take!(core, enable.core;
        full_draw_index_uint32, independent_blend, geometry_shader, tessellation_shader, sample_rate_shading, dual_src_blend,
        multi_draw_indirect, draw_indirect_first_instance, depth_clamp, depth_bias_clamp, fill_mode_non_solid,
        sampler_anisotropy, texture_compression_bc, pipeline_statistics_query, vertex_pipeline_stores_and_atomics,
        fragment_stores_and_atomics, shader_storage_image_extended_formats, shader_storage_image_multisample,
        shader_storage_image_read_without_format, shader_storage_image_write_without_format,
        shader_uniform_buffer_array_dynamic_indexing, shader_sampled_image_array_dynamic_indexing,
        shader_storage_buffer_array_dynamic_indexing, shader_storage_image_array_dynamic_indexing,
        shader_clip_distance, shader_cull_distance, shader_float64, shader_int64, shader_int16);
    take!(f11, enable.v11; storage_buffer16_bit_access, uniform_and_storage_buffer16_bit_access, shader_draw_parameters);
    take!(f12, enable.v12;
        draw_indirect_count, storage_buffer8_bit_access, uniform_and_storage_buffer8_bit_access,
        shader_buffer_int64_atomics, shader_shared_int64_atomics, shader_float16, shader_int8, sampler_filter_minmax,
        scalar_block_layout, uniform_buffer_standard_layout, shader_subgroup_extended_types,
        separate_depth_stencil_layouts, host_query_reset, timeline_semaphore, buffer_device_address,
        shader_output_layer, shader_output_viewport_index);
    let indexing = [
        f12.runtime_descriptor_array,
        f12.shader_sampled_image_array_non_uniform_indexing,
        f12.descriptor_binding_partially_bound,
    ];
    if indexing.iter().all(|&b| b == vk::TRUE) {
        take!(f12, enable.v12;
            runtime_descriptor_array, shader_sampled_image_array_non_uniform_indexing,
            descriptor_binding_partially_bound);
    }
    take!(f13, enable.v13;
        dynamic_rendering, synchronization2, maintenance4, subgroup_size_control, compute_full_subgroups,
        shader_demote_to_helper_invocation, shader_terminate_invocation);

    enable.extensions.push(khr::push_descriptor::NAME);
    if has(ash::ext::post_depth_coverage::NAME) {
        enable.extensions.push(ash::ext::post_depth_coverage::NAME);
    }
    if shading_rate.pipeline_fragment_shading_rate == vk::TRUE {
        take!(shading_rate, enable.shading_rate;
            pipeline_fragment_shading_rate, primitive_fragment_shading_rate, attachment_fragment_shading_rate);
        enable.extensions.push(khr::fragment_shading_rate::NAME);
    }
    if barycentric.fragment_shader_barycentric == vk::TRUE {
        take!(barycentric, enable.barycentric; fragment_shader_barycentric);
        enable.extensions.push(khr::fragment_shader_barycentric::NAME);
    }
    if mesh.mesh_shader == vk::TRUE {
        take!(mesh, enable.mesh; mesh_shader, task_shader);
        enable.extensions.push(ash::ext::mesh_shader::NAME);
    }
    if interlock.fragment_shader_pixel_interlock == vk::TRUE
        || interlock.fragment_shader_sample_interlock == vk::TRUE
    {
        take!(interlock, enable.interlock; fragment_shader_pixel_interlock, fragment_shader_sample_interlock);
        enable.extensions.push(ash::ext::fragment_shader_interlock::NAME);
    }
    enable
}

/// Names of the device's extensions; empty where the driver fails to list them.
fn device_extensions(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Vec<std::ffi::CString> {
    // SAFETY: `physical` belongs to `instance`.
    let listed = unsafe { instance.enumerate_device_extension_properties(physical) }.unwrap_or_default();
    listed.iter().filter_map(|e| e.extension_name_as_c_str().ok().map(Into::into)).collect()
}

/// Text of a fixed array of C characters, up to its end or its first zero.
fn c_text(chars: &[std::ffi::c_char]) -> String {
    let bytes: Vec<u8> = chars.iter().take_while(|&&c| c != 0).map(|&c| c as u8).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_need_color_and_depth() {
        let features = Features {
            sample_counts_color: 5,
            sample_counts_depth: 5,
            sample_counts_integer: 1,
            ..Features::default()
        };
        assert!(features.supports_samples(4, false));
        assert!(!features.supports_samples(4, true));
        assert!(!features.supports_samples(2, false));
        assert!(!features.supports_samples(3, false));
        assert!(!features.supports_samples(0, false));
    }

    #[test]
    fn subgroup_sizes_are_powers_of_two_between_the_ends() {
        let mut features = Features { min_subgroup_size: 8, max_subgroup_size: 32, ..Features::default() };
        assert!(features.subgroup_sizes().is_empty(), "no size can be required");
        features.subgroup_size_control = true;
        assert_eq!(features.subgroup_sizes(), [8, 16, 32]);
        assert!(!features.offers_subgroup_size(24) && !features.offers_subgroup_size(0));
    }
}
