//! Primitives to packed vertices and triangle lists.

use std::collections::HashMap;

use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};
use gltf::json::{
    Root,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};
use rayon::prelude::*;

use super::{accessor::Accessors, check};
use crate::{Aabb, Material, Mesh, Scene, SceneError, VertexAttributes, tangent};

/// Most vertices of a scene (5 GiB of them) and most indices (4 GiB).
const VERTEX_COUNT_MAX: u64 = 1 << 27;
const INDEX_COUNT_MAX: u64 = 1 << 30;

/// Vertices and indices that any file may have, and how many more a byte of its buffers allows. A
/// small file can name one accessor many times, or one without bytes; real ones stay far below.
const COUNT_FREE: u64 = 1 << 22;
const COUNT_PER_BYTE: u64 = 4;

/// A mesh in one of its shapes.
#[derive(Clone, Debug, Default)]
pub(super) struct Variant {
    /// Index of the glTF mesh.
    pub(super) mesh: usize,
    /// Weights of its morph targets; empty for none.
    pub(super) weights: Vec<f32>,
    /// World from bind space for each joint of its skin; empty for none.
    pub(super) joints: Vec<Mat4>,
}

/// Accessors that make up a vertex stream, those of the attributes that are kept.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Streams {
    positions: usize,
    normals: Option<usize>,
    tangents: Option<usize>,
    uv: [Option<usize>; 2],
    colors: Option<usize>,
}

/// One primitive to convert.
struct Job<'a> {
    at: String,
    name: String,
    primitive: &'a Primitive,
    variant: &'a Variant,
    material: u32,
    /// UV set of the normal map where tangents have to be made.
    tangents_from: Option<usize>,
    streams: Streams,
    /// Place among the shared vertex streams; `None` where the vertices are its own.
    shared: Option<usize>,
}

/// Packed vertices.
struct Vertices {
    positions_os: Vec<[f32; 3]>,
    attributes: Vec<VertexAttributes>,
    /// Vertices with a normal of length 0, to be made from the faces.
    zero_normals: Vec<u32>,
}

/// Where packed vertices are in the scene.
#[derive(Clone)]
struct Placed {
    range: std::ops::Range<u32>,
    zero_normals: Vec<u32>,
}

/// Converts variants into `scene` and returns, for each, the range of its scene meshes.
pub(super) fn convert(
    accessors: &Accessors,
    root: &Root,
    variants: &[Variant],
    scene: &mut Scene,
) -> Result<Vec<std::ops::Range<u32>>, SceneError> {
    let mut shared_streams = Vec::new();
    let (jobs, counts) = plan(root, variants, scene, &mut shared_streams);
    check_size(accessors, &jobs, &shared_streams)?;

    let shared: Vec<Vertices> =
        shared_streams.par_iter().map(|s| shared_vertices(accessors, s)).collect::<Result<_, _>>()?;
    let mut bases = Vec::with_capacity(shared.len());
    for vertices in shared {
        bases.push(append(scene, vertices));
    }
    let built: Vec<(Option<Vertices>, Vec<u32>, bool)> =
        jobs.par_iter().map(|job| build(accessors, job)).collect::<Result<_, _>>()?;
    for (job, (vertices, indices, leftover)) in jobs.iter().zip(built) {
        if leftover {
            scene.warnings.push(format!("{}: indices left over after the last triangle are ignored", job.at));
        }
        let placed = match (vertices, job.shared) {
            (Some(vertices), _) => append(scene, vertices),
            (None, Some(shared)) => bases[shared].clone(),
            (None, None) => Placed { range: 0..0, zero_normals: Vec::new() },
        };
        let Placed { range, zero_normals } = placed;
        if !zero_normals.is_empty() {
            scene.warnings.push(format!("{}: normals of length 0 are made from the faces", job.at));
            fill_zero_normals(scene, &range, &zero_normals, &indices);
        }
        let mut bounds_os = Aabb::EMPTY;
        for &p in &scene.positions_os[range.start as usize..range.end as usize] {
            bounds_os.extend(p.into());
        }
        scene.meshes.push(Mesh {
            name: job.name.clone(),
            first_index: scene.indices.len() as u32,
            index_count: indices.len() as u32,
            first_vertex: range.start,
            vertex_count: range.end - range.start,
            material: job.material,
            bounds_os,
        });
        scene.indices.extend_from_slice(&indices);
    }
    let mut next = 0;
    Ok(counts
        .iter()
        .map(|&count| {
            let range = next..next + count;
            next += count;
            range
        })
        .collect())
}

/// Gives vertices without a normal the mean normal of their faces, weighted by area.
fn fill_zero_normals(scene: &mut Scene, range: &std::ops::Range<u32>, vertices: &[u32], indices: &[u32]) {
    let mut sums = vec![Vec3::ZERO; range.len()];
    let positions_os = &scene.positions_os[range.start as usize..range.end as usize];
    for t in indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| Vec3::from(positions_os[i as usize]));
        let normal = (b - a).cross(c - a);
        t.iter().for_each(|&i| sums[i as usize] += normal);
    }
    let attributes = &mut scene.attributes[range.start as usize..range.end as usize];
    for &vertex in vertices {
        let sum = sums[vertex as usize];
        if sum.is_finite() && sum != Vec3::ZERO {
            let packed = VertexAttributes::pack(sum, Vec3::X, 1.0, Vec2::ZERO, Vec2::ZERO, [1.0; 4]);
            attributes[vertex as usize].normal_os_oct = packed.normal_os_oct;
        }
    }
}

fn append(scene: &mut Scene, vertices: Vertices) -> Placed {
    let zero_normals = vertices.zero_normals;
    let start = scene.positions_os.len() as u32;
    // the first stream is taken over as it is: no copy where there is only one
    if scene.positions_os.is_empty() {
        scene.positions_os = vertices.positions_os;
        scene.attributes = vertices.attributes;
    } else {
        scene.positions_os.extend_from_slice(&vertices.positions_os);
        scene.attributes.extend_from_slice(&vertices.attributes);
    }
    Placed { range: start..scene.positions_os.len() as u32, zero_normals }
}

/// Checks indices and positions of meshes that nothing draws: a broken file is refused whether or
/// not its broken part shows. Primitives without data are passed over.
pub(super) fn check_unused(
    accessors: &Accessors,
    root: &Root,
    variants: &[Variant],
) -> Result<(), SceneError> {
    let mut used = vec![false; root.meshes.len()];
    variants.iter().for_each(|v| used[v.mesh] = true);
    let unused = root.meshes.iter().zip(used).filter(|(_, used)| !used);
    unused.flat_map(|(mesh, _)| &mesh.primitives).try_for_each(|primitive| {
        let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions)).map(|a| a.value());
        let Some(positions) = positions.filter(|&p| accessors.has_data(p)) else { return Ok(()) };
        accessors.floats::<3>(positions, 3, 0.0)?;
        if primitive.indices.is_some_and(|i| accessors.has_data(i.value())) {
            corners(accessors, primitive, accessors.layout(positions)?.count)?;
        }
        Ok(())
    })
}

/// Lists the primitives to convert and, for each variant, how many there are. Materials that
/// are missing are added to the scene, vertex streams that primitives can share to `shared`.
fn plan<'a>(
    root: &'a Root,
    variants: &'a [Variant],
    scene: &mut Scene,
    shared: &mut Vec<Streams>,
) -> (Vec<Job<'a>>, Vec<u32>) {
    let mut default_material = None;
    let mut known: HashMap<Streams, usize> = HashMap::new();
    let mut jobs = Vec::new();
    let mut counts = Vec::new();
    for variant in variants {
        let json = &root.meshes[variant.mesh];
        let before = jobs.len();
        for (k, primitive) in json.primitives.iter().enumerate() {
            let at = format!("meshes[{}].primitives[{k}]", variant.mesh);
            if !check::is_triangles(primitive) {
                scene.warnings.push(format!("{at}: points and lines are not drawn"));
                continue;
            }
            let attribute = |s| primitive.attributes.get(&Checked::Valid(s)).map(|a| a.value());
            let Some(positions) = attribute(Semantic::Positions) else {
                scene.warnings.push(format!("{at}: no positions, not drawn"));
                continue;
            };
            let material = match primitive.material {
                Some(m) => m.value() as u32,
                None => *default_material.get_or_insert_with(|| {
                    scene.materials.push(Material { name: "default".to_owned(), ..Material::default() });
                    scene.materials.len() as u32 - 1
                }),
            };
            let uv = [attribute(Semantic::TexCoords(0)), attribute(Semantic::TexCoords(1))];
            let normals = attribute(Semantic::Normals);
            // without normals, given tangents mean nothing (glTF 2.0, 3.7.2.1)
            let tangents = normals.and(attribute(Semantic::Tangents));
            let uses = textures(&scene.materials[material as usize]).flatten();
            if let Some(t) = uses.into_iter().find(|t| uv[t.uv_set as usize].is_none()) {
                scene
                    .warnings
                    .push(format!("{at}: no texture coordinates of set {} for its material", t.uv_set));
            }
            let normal_map = scene.materials[material as usize].normal_texture.map(|t| t.uv_set as usize);
            let tangents_from = normal_map.filter(|&set| tangents.is_none() && uv[set].is_some());
            let colors = attribute(Semantic::Colors(0));
            let streams = Streams { positions, normals, tangents, uv, colors };
            let deformed = !variant.joints.is_empty() || variant.weights.iter().any(|&w| w != 0.0);
            let can_share = normals.is_some() && tangents_from.is_none() && !deformed;
            let shared = can_share.then(|| {
                *known.entry(streams).or_insert_with(|| {
                    shared.push(streams);
                    shared.len() - 1
                })
            });
            let name = json.name.clone().unwrap_or_else(|| format!("meshes[{}]", variant.mesh));
            let name = if json.primitives.len() > 1 { format!("{name}[{k}]") } else { name };
            jobs.push(Job { at, name, primitive, variant, material, tangents_from, streams, shared });
        }
        counts.push((jobs.len() - before) as u32);
    }
    (jobs, counts)
}

fn textures(m: &Material) -> impl Iterator<Item = Option<&crate::TextureRef>> {
    [
        m.base_color_texture.as_ref(),
        m.metallic_roughness_texture.as_ref(),
        m.normal_texture.as_ref(),
        m.occlusion_texture.as_ref(),
        m.emissive_texture.as_ref(),
    ]
    .into_iter()
}

/// Refuses, before memory is taken, more vertices or indices than a scene can hold.
fn check_size(accessors: &Accessors, jobs: &[Job], shared: &[Streams]) -> Result<(), SceneError> {
    let vertex_count = |s: &Streams| accessors.layouts[s.positions].count as u64;
    let mut vertices: u64 = shared.iter().map(vertex_count).sum();
    let mut indices = 0;
    for job in jobs {
        let corner_count = match job.primitive.indices {
            Some(a) => accessors.layouts[a.value()].count as u64,
            None => vertex_count(&job.streams),
        };
        let list_count = if job.primitive.mode == Checked::Valid(Mode::Triangles) {
            corner_count
        } else {
            3 * corner_count
        };
        indices += list_count;
        if job.shared.is_none() {
            vertices += vertex_count(&job.streams).max(list_count);
        }
    }
    let bytes: u64 = accessors.views.iter().flatten().map(|v| v.len() as u64).sum();
    let paid = COUNT_FREE.max(bytes.saturating_mul(COUNT_PER_BYTE));
    let (vertex_max, index_max) = (VERTEX_COUNT_MAX.min(paid), INDEX_COUNT_MAX.min(paid));
    for (what, found, limit) in [("vertices", vertices, vertex_max), ("indices", indices, index_max)] {
        if found > limit {
            let file = accessors.file.to_owned();
            return Err(SceneError::TooLarge { file, what: what.to_owned(), found, limit });
        }
    }
    Ok(())
}

/// The attributes of a primitive as floats, before packing. Missing ones are empty.
struct Unpacked {
    positions_os: Vec<[f32; 3]>,
    normals_os: Vec<[f32; 3]>,
    tangents_os: Vec<[f32; 4]>,
    uv: [Vec<[f32; 2]>; 2],
    colors: Vec<[f32; 4]>,
}

impl Unpacked {
    fn read(accessors: &Accessors, s: &Streams) -> Result<Self, SceneError> {
        let uv = |set: usize| s.uv[set].map_or(Ok(Vec::new()), |a| accessors.floats(a, 2, 0.0));
        Ok(Self {
            positions_os: accessors.floats(s.positions, 3, 0.0)?,
            normals_os: s.normals.map_or(Ok(Vec::new()), |a| accessors.floats(a, 3, 0.0))?,
            tangents_os: s.tangents.map_or(Ok(Vec::new()), |a| accessors.floats(a, 4, 1.0))?,
            uv: [uv(0)?, uv(1)?],
            colors: s.colors.map_or(Ok(Vec::new()), |a| accessors.floats(a, 3, 1.0))?,
        })
    }

    /// The vertices that `source` names, in its order.
    fn gather(&self, source: &[u32]) -> Self {
        fn pick<T: Copy>(values: &[T], source: &[u32]) -> Vec<T> {
            if values.is_empty() { Vec::new() } else { source.iter().map(|&i| values[i as usize]).collect() }
        }
        Self {
            positions_os: pick(&self.positions_os, source),
            normals_os: pick(&self.normals_os, source),
            tangents_os: pick(&self.tangents_os, source),
            uv: [pick(&self.uv[0], source), pick(&self.uv[1], source)],
            colors: pick(&self.colors, source),
        }
    }

    fn pack(self) -> Vertices {
        let attributes = (0..self.positions_os.len())
            .map(|i| {
                let uv = |set: usize| self.uv[set].get(i).map_or(Vec2::ZERO, |&v| v.into());
                let normal_os = self.normals_os.get(i).map_or(Vec3::Z, |&n| n.into());
                let tangent = self.tangents_os.get(i).map_or(Vec4::W, |&t| t.into());
                let color = self.colors.get(i).copied().unwrap_or([1.0; 4]);
                VertexAttributes::pack(normal_os, tangent.truncate(), tangent.w, uv(0), uv(1), color)
            })
            .collect();
        let zero = self.normals_os.iter().zip(0..).filter(|(n, _)| **n == [0.0; 3]);
        let zero_normals = zero.map(|(_, i)| i).collect();
        Vertices { positions_os: self.positions_os, attributes, zero_normals }
    }
}

fn shared_vertices(accessors: &Accessors, streams: &Streams) -> Result<Vertices, SceneError> {
    Unpacked::read(accessors, streams).map(Unpacked::pack)
}

/// Converts one primitive: its own vertices if it has any, its triangle list, and whether
/// indices were left over.
fn build(accessors: &Accessors, job: &Job) -> Result<(Option<Vertices>, Vec<u32>, bool), SceneError> {
    let vertex_count = accessors.layout(job.streams.positions)?.count;
    let (mut indices, leftover) = triangle_list(accessors, job.primitive, vertex_count)?;
    if job.shared.is_some() {
        return Ok((None, indices, leftover));
    }
    let mut v = Unpacked::read(accessors, &job.streams)?;
    apply_morph_targets(accessors, job, &mut v)?;
    apply_skin(accessors, job, &mut v)?;
    if v.normals_os.is_empty() {
        v = v.gather(&indices);
        for corners in v.positions_os.chunks_exact(3) {
            let normal = tangent::face_normal([corners[0], corners[1], corners[2]]);
            v.normals_os.extend([normal.to_array(); 3]);
        }
        indices = (0..indices.len() as u32).collect();
    }
    if let Some(set) = job.tangents_from {
        let surface = tangent::Surface {
            positions_os: &v.positions_os,
            normals_os: &v.normals_os,
            uvs: &v.uv[set],
            indices: &indices,
        };
        let corners = tangent::corner_tangents(&surface);
        let split = tangent::split_by_tangent(v.positions_os.len(), &indices, &corners);
        v = v.gather(&split.source);
        v.tangents_os = split.tangents_os.iter().map(Vec4::to_array).collect();
        indices = split.indices;
    }
    Ok((Some(v.pack()), indices, leftover))
}

/// The primitive's triangles as a list of vertex indices, each checked against the vertices, and
/// whether some were left over.
fn triangle_list(
    accessors: &Accessors,
    primitive: &Primitive,
    vertex_count: usize,
) -> Result<(Vec<u32>, bool), SceneError> {
    Ok(to_triangles(corners(accessors, primitive, vertex_count)?, primitive.mode))
}

/// The primitive's indices, each below the number of vertices; all vertices where it has none.
fn corners(
    accessors: &Accessors,
    primitive: &Primitive,
    vertex_count: usize,
) -> Result<Vec<u32>, SceneError> {
    match primitive.indices {
        None => Ok((0..vertex_count as u32).collect()),
        Some(accessor) => {
            let corners = accessors.indices(accessor.value())?;
            // the largest number of each width would restart a strip (glTF 2.0, 3.7.2.1)
            let restart = match accessors.layout(accessor.value())?.component.size() {
                1 => usize::from(u8::MAX),
                2 => usize::from(u16::MAX),
                _ => u32::MAX as usize,
            };
            let limit = vertex_count.min(restart);
            if corners.iter().max().is_some_and(|&m| m as usize >= limit)
                && let Some(k) = corners.iter().position(|&i| i as usize >= limit)
            {
                let at = format!("{} element {k}", accessors.place(accessor.value()));
                let expected = format!("an index below {limit}, for {vertex_count} vertices");
                return Err(SceneError::invalid(accessors.file, at, corners[k].to_string(), expected));
            }
            Ok(corners)
        }
    }
}

/// Turns strips and fans into lists (glTF 2.0, 3.7.2.1, with its orders, which keep the winding).
fn to_triangles(mut corners: Vec<u32>, mode: Checked<Mode>) -> (Vec<u32>, bool) {
    let n = corners.len();
    match mode {
        Checked::Valid(Mode::TriangleStrip) => {
            let list = (0..n.saturating_sub(2))
                .flat_map(|i| [corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]])
                .collect();
            (list, n < 3)
        }
        Checked::Valid(Mode::TriangleFan) => {
            let list =
                (1..n.saturating_sub(1)).flat_map(|i| [corners[i], corners[i + 1], corners[0]]).collect();
            (list, n < 3)
        }
        _ => {
            corners.truncate(n - n % 3);
            (corners, !n.is_multiple_of(3))
        }
    }
}

fn apply_morph_targets(accessors: &Accessors, job: &Job, v: &mut Unpacked) -> Result<(), SceneError> {
    let targets = job.primitive.targets.iter().flatten();
    for (target, &weight) in targets.zip(&job.variant.weights).filter(|(_, w)| **w != 0.0) {
        let add = |base: &mut [[f32; 3]], accessor: Option<usize>| -> Result<(), SceneError> {
            let Some(accessor) = accessor else { return Ok(()) };
            for (b, d) in base.iter_mut().zip(accessors.floats::<3>(accessor, 3, 0.0)?) {
                *b = (Vec3::from(*b) + weight * Vec3::from(d)).to_array();
            }
            Ok(())
        };
        add(&mut v.positions_os, target.positions.map(|a| a.value()))?;
        add(&mut v.normals_os, target.normals.map(|a| a.value()))?;
        if let Some(accessor) = target.tangents {
            for (b, d) in v.tangents_os.iter_mut().zip(accessors.floats::<3>(accessor.value(), 3, 0.0)?) {
                for (b, d) in b.iter_mut().zip(d) {
                    *b += weight * d;
                }
            }
        }
    }
    check_finite(accessors, job, &v.positions_os)
}

/// Places skinned vertices in world space: each by the weighted sum of its joints' matrices.
fn apply_skin(accessors: &Accessors, job: &Job, v: &mut Unpacked) -> Result<(), SceneError> {
    let joints = &job.variant.joints;
    if joints.is_empty() {
        return Ok(());
    }
    let mut matrices = vec![Mat4::ZERO; v.positions_os.len()];
    let mut totals = vec![0.0f32; v.positions_os.len()];
    for set in 0.. {
        let attribute = |s| job.primitive.attributes.get(&Checked::Valid(s)).map(|a| a.value());
        let (Some(ids), Some(weights)) =
            (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set)))
        else {
            break;
        };
        let weights = accessors.floats::<4>(weights, 4, 0.0)?;
        for (k, (id, weight)) in accessors.uvec4(ids)?.into_iter().zip(weights).enumerate() {
            for (id, weight) in id.into_iter().zip(weight).filter(|(_, w)| *w != 0.0) {
                let Some(matrix) = joints.get(id as usize) else {
                    let at = format!("{} element {k}", accessors.place(ids));
                    return Err(check::unresolved(accessors.file, at, id as usize, joints.len()));
                };
                matrices[k] += *matrix * weight;
                totals[k] += weight;
            }
        }
    }
    for (k, (matrix, total)) in matrices.iter().zip(totals).enumerate() {
        // weights that do not add up to one are scaled so that they do; without any, the first joint holds it
        let matrix = if total > 0.0 { *matrix * (1.0 / total) } else { joints[0] };
        let turn = Mat3::from_mat4(matrix);
        v.positions_os[k] = matrix.transform_point3(v.positions_os[k].into()).to_array();
        if let Some(n) = v.normals_os.get_mut(k) {
            *n = (turn * Vec3::from(*n)).to_array();
        }
        if let Some(t) = v.tangents_os.get_mut(k) {
            let turned = turn * Vec3::new(t[0], t[1], t[2]);
            *t = turned.extend(t[3]).to_array();
        }
    }
    check_finite(accessors, job, &v.positions_os)
}

fn check_finite(accessors: &Accessors, job: &Job, positions_os: &[[f32; 3]]) -> Result<(), SceneError> {
    match positions_os.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        None => Ok(()),
        Some(k) => {
            let at = format!("{} vertex {k}", job.at);
            Err(SceneError::invalid(
                accessors.file,
                at,
                format!("{:?}", positions_os[k]),
                "finite numbers after morphing and skinning",
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_the_winding() {
        let strip = to_triangles(vec![0, 1, 2, 3, 4], Checked::Valid(Mode::TriangleStrip));
        assert_eq!(strip, (vec![0, 1, 2, 1, 3, 2, 2, 3, 4], false));
        let fan = to_triangles(vec![0, 1, 2, 3], Checked::Valid(Mode::TriangleFan));
        assert_eq!(fan, (vec![1, 2, 0, 2, 3, 0], false));
        let list = to_triangles(vec![0, 1, 2, 3], Checked::Valid(Mode::Triangles));
        assert_eq!(list, (vec![0, 1, 2], true));
        assert_eq!(to_triangles(vec![0, 1], Checked::Valid(Mode::TriangleStrip)), (vec![], true));
    }
}
