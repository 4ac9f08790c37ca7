//! A scene on the device: vertices, draws, materials, textures.

use std::sync::Arc;

use afterlight_graph::gpu::{self, vk};
use afterlight_scene::{Aabb, AlphaMode, Image, Material, Mesh, Scene, TextureRef};
use afterlight_shader::structs::{
    DRAW_MIRRORED, DrawData, MATERIAL_DOUBLE_SIDED, MATERIAL_UNLIT, MaterialData, NO_TEXTURE, TRIANGLE_BITS,
};

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    draw_list::displaced,
    error::TechniqueError,
    textures::{Role, TextureTable},
    transparent::Blended,
};

/// Most triangles of one draw. A triangle ID keeps the triangle's number within its draw in `TRIANGLE_BITS` bits, and
/// draws are what is culled: larger draws cull worse, smaller ones cost more commands.
pub(crate) const DRAW_TRIANGLES: u32 = 1 << TRIANGLE_BITS;

/// Kinds of draws, which differ in pipeline or fixed-function state; draws of one kind are one indirect call.
pub(crate) const BUCKETS: usize = 8;

/// What of a draw the CPU needs: for culling, sorting and the indirect command.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawInfo {
    pub bounds_ws: Aabb,
    pub index_count: u32,
    pub first_index: u32,
    pub first_vertex: u32,
    pub fetches: TextureFetches,
}

/// Textures that a fragment of a material reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TextureFetches {
    /// For its surface.
    pub all: u8,
    /// For what the lobes of its BRDF need alone: normal, roughness, and alpha where it is masked.
    pub lobe: u8,
}

impl TextureFetches {
    fn new(material: &Material) -> Self {
        let count = |textures: &[&Option<TextureRef>]| textures.iter().filter(|t| t.is_some()).count() as u8;
        let m = material;
        let lobe = [&m.normal_texture, &m.metallic_roughness_texture];
        let colors = [&m.occlusion_texture, &m.emissive_texture];
        let masked = matches!(m.alpha_mode, AlphaMode::Mask { .. });
        let base_color = count(&[&m.base_color_texture]);
        Self {
            all: count(&lobe) + count(&colors) + base_color,
            lobe: count(&lobe) + base_color * u8::from(masked),
        }
    }
}

/// Bucket of a draw: alpha-masked 4, double-sided 2, mirrored 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Bucket(pub usize);

impl Bucket {
    /// Opaque and double-sided: a state that drops no face.
    pub const DOUBLE_SIDED: Self = Self(2);

    pub fn masked(self) -> bool {
        self.0 & 4 != 0
    }
    pub fn double_sided(self) -> bool {
        self.0 & 2 != 0
    }
    pub fn mirrored(self) -> bool {
        self.0 & 1 != 0
    }
}

/// A scene uploaded once and shared by all techniques. Draws with alpha blending stand apart, after the others: techniques do not
/// see them, [`crate::transparent`] draws them.
pub struct SceneGpu {
    pub(crate) positions: gpu::Buffer,
    pub(crate) attributes: gpu::Buffer,
    pub(crate) indices: gpu::Buffer,
    /// One `DrawData` a draw, those with alpha blending last: the vertex stream of instances.
    pub(crate) draws: gpu::Buffer,
    /// The same, four texels a draw, for compute.
    pub(crate) draw_data: gpu::Image,
    /// Eight texels a material.
    pub(crate) materials: gpu::Image,
    pub(crate) uv_transforms: gpu::Buffer,
    pub(crate) texture_set: gpu::DescriptorSet,
    /// Specialization constants that fit the scene, by name.
    pub(crate) constants: Vec<(&'static str, u32)>,
    /// Whether a surface that is not unlit emits light.
    pub(crate) has_emission: bool,
    /// Name of the node, and of the material, of each draw.
    pub(crate) draw_names: Vec<[Arc<str>; 2]>,
    pub(crate) draw_infos: Vec<DrawInfo>,
    /// First draw of each bucket; one more entry for the end.
    pub(crate) bucket_first: [u32; BUCKETS + 1],
    /// Draws with alpha blending.
    pub(crate) blended: Blended,
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
        let (indices, pieces) = compact_pieces(scene);
        let draws = DrawTable::new(scene, &pieces)?;
        let blended =
            Blended::new(scene, &indices, &draws.data[draws.infos.len()..], draws.blended, draws.infos.len());
        let table = TextureTable::plan(scene, device.features(), &mut warnings)?;
        let (materials, transforms) = material_records(&scene.materials, &table);

        let positions = upload_slice(device, &mut uploader, "scene positions", &scene.positions_os)?;
        let attributes = upload_slice(device, &mut uploader, "scene attributes", &scene.attributes)?;
        let indices = upload_slice(device, &mut uploader, "scene indices", &indices)?;
        let draw_buffer = upload_slice(device, &mut uploader, "scene draws", &draws.data)?;
        let uint4 = vk::Format::R32G32B32A32_UINT;
        let draw_data = record_image(device, &mut uploader, "scene draw records", &draws.data, 4, uint4)?;
        let materials = record_image(device, &mut uploader, "scene materials", &materials, 8, uint4)?;
        let uv_transforms = upload_slice(device, &mut uploader, "scene texture transforms", &transforms)?;
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
        let buffers = [&positions, &attributes, &indices, &draw_buffer, &uv_transforms];
        let images = draw_data.allocated_bytes() + materials.allocated_bytes() + textures.bytes;
        Ok(Arc::new(Self {
            bytes: buffers.iter().map(|b| b.allocated_bytes()).sum::<u64>() + images,
            texture_set: textures.set,
            has_emission: scene.materials.iter().any(|m| !m.unlit && m.emissive_factor != [0.0; 3]),
            draw_names: draws.names,
            constants,
            triangle_count: draws.infos.iter().map(|d| u64::from(d.index_count / 3)).sum(),
            vertex_count: scene.positions_os.len() as u64,
            draw_infos: draws.infos,
            blended,
            bucket_first: draws.bucket_first,
            draws: draw_buffer,
            draw_data,
            positions,
            attributes,
            indices,
            materials,
            uv_transforms,
            warnings,
        }))
    }

    /// Whether there are alpha-masked surfaces: buckets of the upper half.
    pub(crate) fn has_masked(&self) -> bool {
        self.bucket_first[BUCKETS] > self.bucket_first[BUCKETS / 2]
    }

    /// Box of all surfaces without alpha blending in world space, which displacement moves along each axis at most as far as said, m.
    pub(crate) fn bounds_ws(&self, displacement_m: f32) -> Aabb {
        let bounds = self.draw_infos.iter().fold(Aabb::EMPTY, |bounds, draw| bounds.union(&draw.bounds_ws));
        displaced(&bounds, displacement_m)
    }

    /// Number of draws without alpha blending: pieces of at most 1,024 triangles.
    pub fn draw_count(&self) -> usize {
        self.draw_infos.len()
    }

    /// Triangles with alpha blending.
    pub fn blended_triangle_count(&self) -> u64 {
        self.blended.triangle_count() as u64
    }
}

/// Uploads a slice into a storage buffer that may also be a vertex or index buffer; an empty slice gives a buffer of
/// zeros, since empty buffers do not exist.
pub(crate) fn upload_slice<T: bytemuck::NoUninit>(
    device: &gpu::Device,
    uploader: &mut gpu::Uploader,
    name: &str,
    data: &[T],
) -> Result<gpu::Buffer, gpu::GpuError> {
    let zeros = [0u8; 64];
    let bytes = if data.is_empty() { &zeros[..] } else { bytemuck::cast_slice(data) };
    let buffer = device.create_buffer(&gpu::BufferDesc {
        name,
        bytes: bytes.len() as u64,
        usage: vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::VERTEX_BUFFER
            | vk::BufferUsageFlags::INDEX_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST,
        memory: gpu::MemoryKind::DeviceLocal,
    })?;
    uploader.buffer(&buffer, 0, bytes)?;
    Ok(buffer)
}

/// Texels of a row of a record image: shaders address rows of this length.
const ROW_TEXELS: usize = 1024;

/// Uploads records into an image of four 32-bit words a texel, `stride_texels` (a power of two) a record, rows of 1,024
/// texels, gaps filled with zeros.
pub(crate) fn record_image<T: bytemuck::NoUninit>(
    device: &gpu::Device,
    uploader: &mut gpu::Uploader,
    name: &str,
    records: &[T],
    stride_texels: usize,
    format: vk::Format,
) -> Result<gpu::Image, gpu::GpuError> {
    let stride_bytes = 16 * stride_texels;
    assert!(size_of::<T>() <= stride_bytes, "{name}: {} bytes in {stride_bytes}", size_of::<T>());
    let rows = (records.len() * stride_texels).div_ceil(ROW_TEXELS).max(1);
    let mut bytes = vec![0u8; rows * ROW_TEXELS * 16];
    for (place, record) in bytes.chunks_exact_mut(stride_bytes).zip(records) {
        place[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(record));
    }
    let image = device.create_image(&gpu::ImageDesc {
        name,
        format,
        width: ROW_TEXELS as u32,
        height: rows as u32,
        layers: 1,
        mips: 1,
        samples: 1,
        usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
    })?;
    uploader.image(&image, 0, 0, &bytes)?;
    Ok(image)
}

/// A draw: its record, what the CPU needs of it, the names of its node and its material.
type Draw = (DrawData, DrawInfo, [Arc<str>; 2]);

/// All draws of a scene by bucket, then those with alpha blending.
struct DrawTable {
    /// Of all draws.
    data: Vec<DrawData>,
    /// Of those in buckets.
    infos: Vec<DrawInfo>,
    names: Vec<[Arc<str>; 2]>,
    bucket_first: [u32; BUCKETS + 1],
    /// Of those with alpha blending.
    blended: Vec<DrawInfo>,
}

impl DrawTable {
    fn new(scene: &Scene, pieces: &[Vec<Aabb>]) -> Result<Self, TechniqueError> {
        let mut by_bucket: [Vec<Draw>; BUCKETS] = Default::default();
        let mut blended: Vec<Draw> = Vec::new();
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh as usize];
            let material = &scene.materials[mesh.material as usize];
            let m = &instance.world_from_object;
            let mirrored = m.matrix3.determinant() < 0.0;
            let masked = matches!(material.alpha_mode, AlphaMode::Mask { .. });
            let bucket =
                4 * usize::from(masked) + 2 * usize::from(material.double_sided) + usize::from(mirrored);
            let node = scene.nodes.get(instance.node as usize).map_or("", |node| node.name.as_str());
            let names: [Arc<str>; 2] = [node.into(), material.name.as_str().into()];
            let rows = [0, 1, 2].map(|i| {
                let row = m.matrix3.row(i);
                [row.x, row.y, row.z, m.translation[i]]
            });
            let draws = match material.alpha_mode {
                AlphaMode::Blend => &mut blended,
                _ => &mut by_bucket[bucket],
            };
            for (piece, bounds_os) in pieces[instance.mesh as usize].iter().enumerate() {
                let first = piece as u32 * DRAW_TRIANGLES * 3;
                let first_index = mesh.first_index + first;
                draws.push((
                    DrawData {
                        object_row0: rows[0],
                        object_row1: rows[1],
                        object_row2: rows[2],
                        first_index,
                        first_vertex: mesh.first_vertex,
                        material: mesh.material,
                        flags: if mirrored { DRAW_MIRRORED } else { 0 },
                    },
                    DrawInfo {
                        bounds_ws: bounds_os.transformed(m),
                        index_count: (mesh.index_count - first).min(DRAW_TRIANGLES * 3),
                        first_index,
                        first_vertex: mesh.first_vertex,
                        fetches: TextureFetches::new(material),
                    },
                    names.clone(),
                ));
            }
        }
        let mut table = Self {
            data: Vec::new(),
            infos: Vec::new(),
            names: Vec::new(),
            bucket_first: [0; BUCKETS + 1],
            blended: Vec::new(),
        };
        for (bucket, draws) in by_bucket.into_iter().enumerate() {
            for (data, info, names) in draws {
                table.data.push(data);
                table.infos.push(info);
                table.names.push(names);
            }
            table.bucket_first[bucket + 1] = table.data.len() as u32;
        }
        for (data, info, _) in blended {
            table.data.push(data);
            table.blended.push(info);
        }
        let limit = u64::from(u32::MAX >> TRIANGLE_BITS);
        if table.data.len() as u64 >= limit {
            return Err(TechniqueError::TooLarge {
                what: format!("draws of at most {DRAW_TRIANGLES} triangles in the scene"),
                found: table.data.len() as u64,
                limit: limit - 1,
            });
        }
        Ok(table)
    }
}

/// All indices, the triangles of each mesh ordered so that its pieces of 1,024 are compact, and each piece's bounds in
/// object space. Files order triangles by material or tool, and a piece that spans the scene is neither culled nor sorted.
fn compact_pieces(scene: &Scene) -> (Vec<u32>, Vec<Vec<Aabb>>) {
    let ordered: Vec<(Vec<u32>, Vec<Aabb>)> =
        scene.meshes.par_iter().map(|mesh| compact_mesh(scene, mesh)).collect();
    let mut indices = scene.indices.clone();
    for (mesh, (order, _)) in scene.meshes.iter().zip(&ordered) {
        let first = mesh.first_index as usize;
        let old = &scene.indices[first..first + mesh.index_count as usize];
        for (new, triangle) in indices[first..].chunks_exact_mut(3).zip(order) {
            new.copy_from_slice(&old[*triangle as usize * 3..][..3]);
        }
    }
    (indices, ordered.into_iter().map(|(_, bounds)| bounds).collect())
}

/// The new order of a mesh's triangles and the bounds of its pieces.
fn compact_mesh(scene: &Scene, mesh: &Mesh) -> (Vec<u32>, Vec<Aabb>) {
    let first = mesh.first_index as usize;
    let indices = &scene.indices[first..first + mesh.index_count as usize];
    let positions = &scene.positions_os[mesh.first_vertex as usize..];
    let corner = |triangle: u32, k: usize| Vec3::from(positions[indices[triangle as usize * 3 + k] as usize]);
    let mut order: Vec<u32> = (0..mesh.index_count / 3).collect();
    if order.len() > DRAW_TRIANGLES as usize {
        let centroids: Vec<Vec3> =
            order.iter().map(|&t| (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0).collect();
        split_by_place(&mut order, &centroids);
    }
    let bounds = order
        .chunks(DRAW_TRIANGLES as usize)
        .map(|piece| {
            let mut bounds = Aabb::EMPTY;
            piece.iter().for_each(|&t| (0..3).for_each(|k| bounds.extend(corner(t, k))));
            bounds
        })
        .collect();
    (order, bounds)
}

/// Splits triangles by the median of their centroids along the longest axis until pieces have at most 1,024; all pieces
/// but the last are full. Within a piece the old order stays, for the vertex cache.
fn split_by_place(order: &mut [u32], centroids: &[Vec3]) {
    let pieces = order.len().div_ceil(DRAW_TRIANGLES as usize);
    if pieces <= 1 {
        order.sort_unstable();
        return;
    }
    let mut bounds = Aabb::EMPTY;
    order.iter().for_each(|&t| bounds.extend(centroids[t as usize]));
    let axis = bounds.size().max_position();
    let middle = pieces / 2 * DRAW_TRIANGLES as usize;
    order.select_nth_unstable_by(middle, |&a, &b| {
        centroids[a as usize][axis].total_cmp(&centroids[b as usize][axis]).then(a.cmp(&b))
    });
    let (low, high) = order.split_at_mut(middle);
    split_by_place(low, centroids);
    split_by_place(high, centroids);
}

fn uses_uv1(materials: &[Material]) -> bool {
    materials.iter().any(|m| slots(m).iter().any(|(t, _)| t.is_some_and(|t| t.uv_set == 1)))
}

/// A material's textures in the order of the slots in `MaterialData`.
pub(crate) fn slots(m: &Material) -> [(Option<TextureRef>, Role); 5] {
    [
        (m.base_color_texture, Role::BaseColor),
        (m.metallic_roughness_texture, Role::Data),
        (m.normal_texture, Role::Normal),
        (m.occlusion_texture, Role::Data),
        (m.emissive_texture, Role::Emissive),
    ]
}

const IDENTITY_TRANSFORM: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// Material records and the rows of all texture transforms, five transforms for each material that has one.
fn material_records(materials: &[Material], table: &TextureTable) -> (Vec<MaterialData>, Vec<[f32; 4]>) {
    let mut transforms = Vec::new();
    let records = materials
        .iter()
        .map(|m| {
            let slots = slots(m);
            let first = (transforms.len() / 2) as u32;
            let transformed = |t: &TextureRef| t.uv_transform != IDENTITY_TRANSFORM;
            if slots.iter().any(|(t, _)| t.as_ref().is_some_and(transformed)) {
                for (t, _) in &slots {
                    let rows = t.map_or(IDENTITY_TRANSFORM, |t| t.uv_transform);
                    transforms.extend(rows.map(|[a, b, c]| [a, b, c, 0.0]));
                }
            }
            let [base_color, metallic_roughness, normal, occlusion, emissive] = slots.map(|(t, role)| {
                t.map_or(NO_TEXTURE, |t| {
                    table.slot(&t, role) | t.uv_set.min(1) << 24 | u32::from(transformed(&t)) << 25
                })
            });
            MaterialData {
                base_color_factor: m.base_color_factor,
                emissive_factor: m.emissive_factor,
                alpha_cutoff: if let AlphaMode::Mask { cutoff } = m.alpha_mode { cutoff } else { 0.0 },
                metallic_factor: m.metallic_factor,
                roughness_factor: m.roughness_factor,
                normal_scale: m.normal_scale,
                occlusion_strength: m.occlusion_strength,
                flags: (u32::from(m.unlit) * MATERIAL_UNLIT)
                    | (u32::from(m.double_sided) * MATERIAL_DOUBLE_SIDED),
                uv_transform: first,
                base_color_slot: base_color,
                metallic_roughness_slot: metallic_roughness,
                normal_slot: normal,
                occlusion_slot: occlusion,
                emissive_slot: emissive,
                _padding: 0,
            }
        })
        .collect();
    (records, transforms)
}

/// Names of images for messages.
pub(crate) fn image_name(images: &[Image], index: u32) -> &str {
    images.get(index as usize).map_or("image", |i| i.name.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_scene::load_source;

    /// Each mesh keeps its triangles, and pieces hold theirs.
    #[test]
    fn compact_pieces_keep_every_triangle() {
        let scene = load_source("builtin:colonnade?triangles=30000&texture=16", &Default::default()).unwrap();
        let (indices, bounds) = compact_pieces(&scene);
        let mut cut = 0;
        for (mesh, pieces) in scene.meshes.iter().zip(&bounds) {
            let range = mesh.first_index as usize..(mesh.first_index + mesh.index_count) as usize;
            let sorted = |list: &[u32]| {
                let mut triangles: Vec<[u32; 3]> = list.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
                triangles.sort_unstable();
                triangles
            };
            assert_eq!(
                sorted(&scene.indices[range.clone()]),
                sorted(&indices[range.clone()]),
                "{}",
                mesh.name
            );
            assert_eq!(pieces.len() as u32, (mesh.index_count / 3).div_ceil(DRAW_TRIANGLES));
            for (piece, held) in indices[range].chunks(3 * DRAW_TRIANGLES as usize).zip(pieces) {
                for &i in piece {
                    let p = Vec3::from(scene.positions_os[(mesh.first_vertex + i) as usize]);
                    assert!(p.cmpge(held.min).all() && p.cmple(held.max).all(), "{}", mesh.name);
                }
            }
            cut += pieces.len() - 1;
        }
        assert!(cut > 0, "no mesh of the scene is cut");
    }
}
