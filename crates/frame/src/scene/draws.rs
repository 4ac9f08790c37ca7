//! Draws: pieces of instances of at most 1,024 triangles, sorted into buckets by their state.

use std::sync::Arc;

use afterlight_scene::{Aabb, AlphaMode, Material, Scene, TextureRef};
use afterlight_shader::structs::{DRAW_MIRRORED, DrawBounds, DrawData, TRIANGLE_BITS};

use super::placed::{DrawSource, object_rows};
use crate::TechniqueError;

/// Most triangles of one draw. A triangle ID keeps the triangle's number within its draw in `TRIANGLE_BITS` bits, and
/// draws are what is culled: larger draws cull worse, smaller ones cost more commands.
pub const DRAW_TRIANGLES: u32 = 1 << TRIANGLE_BITS;

/// Kinds of draws, which differ in pipeline or fixed-function state; draws of one kind are one indirect call.
pub const BUCKETS: usize = 8;

/// What of a draw the CPU needs: for culling, sorting and the indirect command.
#[derive(Clone, Copy, Debug)]
pub struct DrawInfo {
    /// Bounds, world space.
    pub bounds_ws: Aabb,
    /// Indices, three a triangle.
    pub index_count: u32,
    /// First index in the scene's index buffer.
    pub first_index: u32,
    /// Added to every index.
    pub first_vertex: u32,
    /// Textures that a fragment reads.
    pub fetches: TextureFetches,
}

/// Textures that a fragment of a material reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureFetches {
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
pub struct Bucket(pub usize);

impl Bucket {
    /// Opaque and double-sided: a state that drops no face.
    pub const DOUBLE_SIDED: Self = Self(2);

    /// Whether fragments are tested by alpha.
    pub fn masked(self) -> bool {
        self.0 & 4 != 0
    }
    /// Whether back faces are drawn.
    pub fn double_sided(self) -> bool {
        self.0 & 2 != 0
    }
    /// Whether the instance is mirrored, so that its front faces turn clockwise.
    pub fn mirrored(self) -> bool {
        self.0 & 1 != 0
    }
}

/// A draw: its record, what the CPU needs of it, the names of its node and its material, what it is a piece of.
type Draw = (DrawData, DrawInfo, [Arc<str>; 2], DrawSource);

/// All draws of a scene by bucket, then those with alpha blending.
pub(super) struct DrawTable {
    /// Of all draws.
    pub(super) data: Vec<DrawData>,
    /// Of those in buckets.
    pub(super) infos: Vec<DrawInfo>,
    pub(super) names: Vec<[Arc<str>; 2]>,
    /// Of all draws.
    pub(super) sources: Vec<DrawSource>,
    pub(super) bucket_first: [u32; BUCKETS + 1],
    /// Of those with alpha blending.
    pub(super) blended: Vec<DrawInfo>,
}

impl DrawTable {
    pub(super) fn new(scene: &Scene, pieces: &[Vec<Aabb>]) -> Result<Self, TechniqueError> {
        let mut by_bucket: [Vec<Draw>; BUCKETS] = Default::default();
        let mut blended: Vec<Draw> = Vec::new();
        for (number, instance) in (0..).zip(&scene.instances) {
            let mesh = &scene.meshes[instance.mesh as usize];
            let material = &scene.materials[mesh.material as usize];
            let m = &instance.world_from_object;
            let mirrored = m.matrix3.determinant() < 0.0;
            let masked = matches!(material.alpha_mode, AlphaMode::Mask { .. });
            let bucket =
                4 * usize::from(masked) + 2 * usize::from(material.double_sided) + usize::from(mirrored);
            let node = scene.nodes.get(instance.node as usize).map_or("", |node| node.name.as_str());
            let names: [Arc<str>; 2] = [node.into(), material.name.as_str().into()];
            let rows = object_rows(m);
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
                    DrawSource { instance: number, bounds_os: *bounds_os },
                ));
            }
        }
        let mut table = Self {
            data: Vec::new(),
            infos: Vec::new(),
            names: Vec::new(),
            sources: Vec::new(),
            bucket_first: [0; BUCKETS + 1],
            blended: Vec::new(),
        };
        for (bucket, draws) in by_bucket.into_iter().enumerate() {
            for (data, info, names, source) in draws {
                table.sources.push(source);
                table.data.push(data);
                table.infos.push(info);
                table.names.push(names);
            }
            table.bucket_first[bucket + 1] = table.data.len() as u32;
        }
        for (data, info, _, source) in blended {
            table.sources.push(source);
            table.data.push(data);
            table.blended.push(info);
        }
        check_count(table.data.len() as u64)?;
        Ok(table)
    }

    /// What the device chooses draws by, of all draws.
    pub(super) fn bounds(&self) -> Vec<DrawBounds> {
        let infos = self.infos.iter().chain(&self.blended);
        let of_draw = |(source, info): (&DrawSource, &DrawInfo)| DrawBounds {
            min_os: source.bounds_os.min.into(),
            index_count: info.index_count,
            max_os: source.bounds_os.max.into(),
            unused: 0,
        };
        self.sources.iter().zip(infos).map(of_draw).collect()
    }
}

/// Most draws of a scene: as many as the bits of a triangle ID beside the triangle's own tell apart, but for the draw whose last
/// triangle would be all ones, no surface.
pub(super) const DRAWS_MAX: u64 = (u32::MAX >> TRIANGLE_BITS) as u64 - 1;

/// Checks that triangle IDs tell so many draws apart.
pub(super) fn check_count(found: u64) -> Result<(), TechniqueError> {
    if found > DRAWS_MAX {
        return Err(TechniqueError::TooLarge {
            what: format!("draws of at most {DRAW_TRIANGLES} triangles in the scene"),
            found,
            limit: DRAWS_MAX,
        });
    }
    Ok(())
}
