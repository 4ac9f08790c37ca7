//! A scene on the device: vertices, draws, materials, textures.

pub mod blended;
pub mod deformed;
pub mod draw_list;
pub mod draws;
pub mod lights;
#[cfg(test)]
mod limit_tests;
mod materials;
mod pieces;
pub mod placed;
mod textures;

use std::sync::Arc;

use afterlight_graph::gpu::{self, vk};
use afterlight_scene::Scene;

pub use self::draws::{BUCKETS, Bucket, DRAW_TRIANGLES, DrawInfo, TextureFetches};
use self::{
    blended::Blended,
    deformed::{DeformedGpu, PosedShapes},
    draws::DrawTable,
    materials::{material_records, uses_uv1},
    pieces::compact_pieces,
    placed::{DrawSource, Placed},
    textures::TextureTable,
};
use crate::{
    TechniqueError,
    upload::{record_image, upload_slice},
};

/// A scene uploaded once and shared by all techniques. Draws with alpha blending stand apart, after the others: techniques do not
/// see them, the stage for transparent surfaces draws them.
pub struct SceneGpu {
    /// Positions of vertices, object space, 12 bytes each.
    pub positions: gpu::Buffer,
    /// Other attributes of vertices, 28 bytes each.
    pub attributes: gpu::Buffer,
    /// Indices of triangles, 32 bits each.
    pub indices: gpu::Buffer,
    /// One `DrawData` a draw, those with alpha blending last: the vertex stream of instances.
    pub draws: gpu::Buffer,
    /// The same, four texels a draw, for compute.
    pub draw_data: gpu::Image,
    /// One `DrawBounds` a draw, two texels: what the device chooses draws by.
    pub draw_bounds: gpu::Image,
    /// One `BlendedTriangle` a triangle with alpha blending.
    pub blended_triangles: gpu::Buffer,
    /// Eight texels a material.
    pub materials: gpu::Image,
    /// Materials of the scene, those that no draw has included.
    pub material_count: u32,
    /// Rows of texture transforms.
    pub uv_transforms: gpu::Buffer,
    /// The scene's textures.
    pub texture_set: gpu::DescriptorSet,
    /// Specialization constants that fit the scene, by name.
    pub constants: Vec<(&'static str, u32)>,
    /// Whether a surface that is not unlit emits light.
    pub has_emission: bool,
    /// Name of the node, and of the material, of each draw.
    pub draw_names: Vec<[Arc<str>; 2]>,
    /// Where its surfaces stand in the pose that it was uploaded in.
    pub rest: Placed,
    /// What skins and morph targets deform; `None` where nothing does.
    pub deformed: Option<DeformedGpu>,
    /// What each draw is a piece of.
    pub draw_sources: Vec<DrawSource>,
    /// First draw of each bucket; one more entry for the end.
    pub bucket_first: [u32; BUCKETS + 1],
    /// Triangles that techniques draw: those without alpha blending.
    pub triangle_count: u64,
    /// Vertices in memory.
    pub vertex_count: u64,
    /// Bytes on the device, textures included.
    pub bytes: u64,
    /// What was changed or left out, a line each.
    pub warnings: Vec<String>,
}

/// Reports progress of an upload: steps done, steps in all.
pub type Progress<'a> = &'a (dyn Fn(usize, usize) + Sync);

impl SceneGpu {
    /// Uploads a scene; textures are decoded in parallel, a few at a time.
    ///
    /// # Errors
    /// An image that does not decode or is larger than the device takes; too many draws; the device.
    pub fn upload(
        device: &gpu::Device,
        scene: &Scene,
        progress: Progress<'_>,
    ) -> Result<Arc<Self>, TechniqueError> {
        let mut uploader = device.uploader()?;
        let mut warnings = Vec::new();
        let (indices, mut pieces) = compact_pieces(scene);
        // Pieces of a deformed mesh are bounded by what holds all of its shape, as in every other pose.
        let rest_bounds_os = scene.deformed_bounds_os(&scene.shaped);
        for (instance, bounds_os) in &rest_bounds_os {
            pieces[scene.instances[*instance as usize].mesh as usize].fill(*bounds_os);
        }
        let draws = DrawTable::new(scene, &pieces)?;
        let bounds = draws.bounds();
        let blended = Blended::new(
            scene,
            &indices,
            &draws.data[draws.infos.len()..],
            &draws.blended,
            draws.infos.len(),
        );
        let blended_triangles = blended::records(&blended, &draws.blended);
        let table = TextureTable::plan(scene, device.features(), &mut warnings)?;
        let (materials, transforms) = material_records(&scene.materials, &table);

        let positions = upload_slice(device, &mut uploader, "scene positions", &scene.positions_os)?;
        let attributes = upload_slice(device, &mut uploader, "scene attributes", &scene.attributes)?;
        let indices = upload_slice(device, &mut uploader, "scene indices", &indices)?;
        let draw_buffer = upload_slice(device, &mut uploader, "scene draws", &draws.data)?;
        let uint4 = vk::Format::R32G32B32A32_UINT;
        let draw_data = record_image(device, &mut uploader, "scene draw records", &draws.data, 4, uint4)?;
        let draw_bounds = record_image(device, &mut uploader, "scene draw bounds", &bounds, 2, uint4)?;
        let blended_triangles =
            upload_slice(device, &mut uploader, "scene blended triangles", &blended_triangles)?;
        let materials = record_image(device, &mut uploader, "scene materials", &materials, 8, uint4)?;
        let uv_transforms = upload_slice(device, &mut uploader, "scene texture transforms", &transforms)?;
        let deformed = DeformedGpu::upload(device, &mut uploader, scene, rest_bounds_os)?;
        let textures = table.upload(device, &mut uploader, &scene.images, progress)?;
        uploader.finish()?;

        let [srgb, normal, data] = table.bucket_counts();
        let constants = vec![
            ("SRGB_BUCKETS", srgb),
            ("NORMAL_BUCKETS", normal),
            ("DATA_BUCKETS", data),
            ("HAS_UV1", u32::from(uses_uv1(&scene.materials))),
            ("HAS_VERTEX_COLOR", u32::from(scene.attributes.iter().any(|a| a.color_rgba8 != u32::MAX))),
            ("HAS_UV_TRANSFORM", u32::from(!transforms.is_empty())),
        ];
        let buffers = [&positions, &attributes, &indices, &draw_buffer, &uv_transforms, &blended_triangles];
        let images = [&draw_data, &draw_bounds, &materials].map(gpu::Image::allocated_bytes);
        let shapes = deformed.as_ref().map_or(0, DeformedGpu::bytes);
        Ok(Arc::new(Self {
            bytes: buffers.iter().map(|b| b.allocated_bytes()).sum::<u64>()
                + images.iter().sum::<u64>()
                + textures.bytes
                + shapes,
            texture_set: textures.set,
            material_count: scene.materials.len() as u32,
            has_emission: scene.materials.iter().any(|m| !m.unlit && m.emissive_factor != [0.0; 3]),
            draw_names: draws.names,
            constants,
            triangle_count: draws.infos.iter().map(|d| u64::from(d.index_count / 3)).sum(),
            vertex_count: scene.positions_os.len() as u64,
            draw_sources: draws.sources,
            rest: Placed::new(draws.data, draws.infos, blended, PosedShapes::new(&scene.shaped), bounds),
            deformed,
            bucket_first: draws.bucket_first,
            draws: draw_buffer,
            draw_data,
            draw_bounds,
            blended_triangles,
            positions,
            attributes,
            indices,
            materials,
            uv_transforms,
            warnings,
        }))
    }

    /// Whether there are alpha-masked surfaces: buckets of the upper half.
    pub fn has_masked(&self) -> bool {
        self.bucket_first[BUCKETS] > self.bucket_first[BUCKETS / 2]
    }

    /// Number of draws without alpha blending: pieces of at most 1,024 triangles.
    pub fn draw_count(&self) -> usize {
        self.rest.infos.len()
    }

    /// Triangles with alpha blending.
    pub fn blended_triangle_count(&self) -> u64 {
        self.rest.blended.triangle_count() as u64
    }
}
