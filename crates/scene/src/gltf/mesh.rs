//! Primitives to packed vertices and triangle lists.

mod shape;

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};
use gltf::json::{
    Root,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};
use rayon::prelude::*;

use super::{accessor::Accessors, check};
use crate::{Aabb, Material, Mesh, Scene, SceneError, VertexAttributes, tangent};

/// Most vertices of a scene (5 GiB of them) and most indices (4 GiB).
pub(crate) const VERTEX_COUNT_MAX: u64 = 1 << 27;
pub(crate) const INDEX_COUNT_MAX: u64 = 1 << 30;

/// Vertices and indices that any file may have, and how many more a byte of its buffers allows. A
/// small file can name one accessor many times, or one without bytes; real ones stay far below.
const COUNT_FREE: u64 = 1 << 22;
const COUNT_PER_BYTE: u64 = 4;

/// A mesh in one of its shapes.
#[derive(Clone, Debug, Default)]
pub(super) struct Variant {
    /// Index of the glTF mesh.
    pub(super) mesh: usize,
    /// Weights of its morph targets at rest, one a target.
    pub(super) weights: Vec<f32>,
    /// Index into [`Scene::skins`].
    pub(super) skin: Option<u32>,
    /// The scene's node that has the mesh, and with it the weights.
    pub(super) node: u32,
    /// The scene's node in whose space the vertices are.
    pub(super) object_node: u32,
}

impl Variant {
    /// Whether its vertices are made from a shape.
    fn is_deformed(&self) -> bool {
        self.skin.is_some() || !self.weights.is_empty()
    }
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
    /// Place among the shapes to build; `None` where nothing deforms the vertices.
    shape: Option<usize>,
}

/// What the primitives of a file need, before anything is built.
#[derive(Default)]
struct Plan<'a> {
    jobs: Vec<Job<'a>>,
    /// For each variant the number of its jobs.
    counts: Vec<u32>,
    /// Vertex streams that primitives share.
    streams: Vec<Streams>,
    /// For each shape the first job that is made from it.
    shapes: Vec<usize>,
}

/// Packed vertices.
#[derive(Clone)]
pub(crate) struct Vertices {
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
    let plan = plan(root, variants, scene);
    check_size(accessors, &plan)?;

    let shared: Vec<Vertices> =
        plan.streams.par_iter().map(|s| shared_vertices(accessors, s)).collect::<Result<_, _>>()?;
    let mut shapes = plan
        .shapes
        .par_iter()
        .map(|&job| shape::build(accessors, &plan.jobs[job]))
        .collect::<Result<Vec<_>, _>>()?;
    let mut bases = Vec::with_capacity(shared.len());
    for vertices in shared {
        bases.push(append(scene, vertices));
    }
    let built: Vec<(Option<Vertices>, Vec<u32>, bool)> =
        plan.jobs.par_iter().map(|job| build(accessors, job)).collect::<Result<_, _>>()?;
    let mut deformer = shape::Deformer::default();
    for (job, (mut vertices, mut indices, mut leftover)) in plan.jobs.iter().zip(built) {
        if let Some(shape) = job.shape {
            let shape = &mut shapes[shape];
            deformer.add(accessors, job, shape, scene)?;
            (vertices, indices, leftover) =
                (Some(shape.vertices.clone()), shape.indices.clone(), shape.leftover);
        }
        if leftover {
            scene.warnings.push(format!("{}: indices left over after the last triangle are ignored", job.at));
        }
        let placed = match (vertices, job.shared) {
            (Some(vertices), _) => append(scene, vertices),
            (None, Some(shared)) => bases[shared].clone(),
            (None, None) => Placed { range: 0..0, zero_normals: Vec::new() },
        };
        if !placed.zero_normals.is_empty() {
            scene.warnings.push(format!("{}: normals of length 0 are made from the faces", job.at));
        }
        push_mesh(scene, &job.name, placed, &indices, job.material);
    }
    let mut next = 0;
    Ok(plan
        .counts
        .iter()
        .map(|&count| {
            let range = next..next + count;
            next += count;
            range
        })
        .collect())
}

/// Adds a mesh of vertices that are in the scene.
fn push_mesh(scene: &mut Scene, name: &str, placed: Placed, indices: &[u32], material: u32) {
    let Placed { range, zero_normals } = placed;
    fill_zero_normals(scene, &range, &zero_normals, indices);
    let mut bounds_os = Aabb::EMPTY;
    for &p in &scene.positions_os[range.start as usize..range.end as usize] {
        bounds_os.extend(p.into());
    }
    scene.meshes.push(Mesh {
        name: name.to_owned(),
        first_index: scene.indices.len() as u32,
        index_count: indices.len() as u32,
        first_vertex: range.start,
        vertex_count: range.end - range.start,
        material,
        bounds_os,
    });
    scene.indices.extend_from_slice(indices);
}

/// Adds a mesh with its vertices.
pub(crate) fn add_mesh(scene: &mut Scene, name: &str, vertices: Vertices, indices: &[u32], material: u32) {
    let placed = append(scene, vertices);
    push_mesh(scene, name, placed, indices, material);
}

/// Gives vertices without a normal the mean normal of their faces, weighted by area.
fn fill_zero_normals(scene: &mut Scene, range: &std::ops::Range<u32>, vertices: &[u32], indices: &[u32]) {
    if vertices.is_empty() {
        return;
    }
    let sums = face_sums(&scene.positions_os[range.start as usize..range.end as usize], indices);
    let attributes = &mut scene.attributes[range.start as usize..range.end as usize];
    for &vertex in vertices {
        let sum = sums[vertex as usize];
        if sum.is_finite() && sum != Vec3::ZERO {
            let packed = VertexAttributes::pack(sum, Vec3::X, 1.0, Vec2::ZERO, Vec2::ZERO, [1.0; 4]);
            attributes[vertex as usize].normal_os_oct = packed.normal_os_oct;
        }
    }
}

/// For each vertex the sum of its faces' normals, weighted by area.
fn face_sums(positions_os: &[[f32; 3]], indices: &[u32]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions_os.len()];
    for t in indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| Vec3::from(positions_os[i as usize]));
        let normal = (b - a).cross(c - a);
        t.iter().for_each(|&i| sums[i as usize] += normal);
    }
    sums
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

/// Lists the primitives to convert. Materials that are missing are added to the scene.
fn plan<'a>(root: &'a Root, variants: &'a [Variant], scene: &mut Scene) -> Plan<'a> {
    let mut default_material = None;
    let mut known: HashMap<Streams, usize> = HashMap::new();
    // by the file's mesh, the primitive's number, and whether a skin moves it
    let mut known_shapes: HashMap<(usize, usize, bool), usize> = HashMap::new();
    let Plan { mut jobs, mut counts, streams: mut shared, mut shapes } = Plan::default();
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
            let can_share = normals.is_some() && tangents_from.is_none() && !variant.is_deformed();
            let shared = can_share.then(|| {
                *known.entry(streams).or_insert_with(|| {
                    shared.push(streams);
                    shared.len() - 1
                })
            });
            let name = json.name.clone().unwrap_or_else(|| format!("meshes[{}]", variant.mesh));
            let name = if json.primitives.len() > 1 { format!("{name}[{k}]") } else { name };
            let shape = variant.is_deformed().then(|| {
                *known_shapes.entry((variant.mesh, k, variant.skin.is_some())).or_insert_with(|| {
                    shapes.push(jobs.len());
                    shapes.len() - 1
                })
            });
            jobs.push(Job { at, name, primitive, variant, material, tangents_from, streams, shared, shape });
        }
        counts.push((jobs.len() - before) as u32);
    }
    Plan { jobs, counts, streams: shared, shapes }
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
fn check_size(accessors: &Accessors, plan: &Plan) -> Result<(), SceneError> {
    let vertex_count = |s: &Streams| accessors.layouts[s.positions].count as u64;
    let mut vertices: u64 = plan.streams.iter().map(vertex_count).sum();
    let mut indices = 0;
    let list_count = |job: &Job| {
        let corner_count = match job.primitive.indices {
            Some(a) => accessors.layouts[a.value()].count as u64,
            None => vertex_count(&job.streams),
        };
        if job.primitive.mode == Checked::Valid(Mode::Triangles) { corner_count } else { 3 * corner_count }
    };
    // a shape is about as large as its vertices, and so is each of its targets
    for &job in &plan.shapes {
        let job = &plan.jobs[job];
        let lists = 1 + job.primitive.targets.as_ref().map_or(0, Vec::len) as u64;
        let count = vertex_count(&job.streams).max(list_count(job));
        vertices = vertices.saturating_add(count.saturating_mul(lists));
    }
    for job in &plan.jobs {
        let list_count = list_count(job);
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
#[derive(Default)]
pub(crate) struct Unpacked {
    pub(crate) positions_os: Vec<[f32; 3]>,
    pub(crate) normals_os: Vec<[f32; 3]>,
    pub(crate) tangents_os: Vec<[f32; 4]>,
    pub(crate) uv: [Vec<[f32; 2]>; 2],
    pub(crate) colors: Vec<[f32; 4]>,
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

    /// Packs vertices with the normals and tangents that a triangle list needs: faces' own normals where there are none, and tangents along
    /// the texture coordinates of set `tangents_from`. Vertices whose corners then differ are split; returns the list for them.
    pub(crate) fn framed(self, mut indices: Vec<u32>, tangents_from: Option<usize>) -> (Vertices, Vec<u32>) {
        let mut v = self;
        if v.normals_os.is_empty() {
            v = v.gather(&indices);
            for corners in v.positions_os.chunks_exact(3) {
                let normal = tangent::face_normal([corners[0], corners[1], corners[2]]);
                v.normals_os.extend([normal.to_array(); 3]);
            }
            indices = (0..indices.len() as u32).collect();
        }
        if let Some(set) = tangents_from {
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
        (v.pack(), indices)
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
    if job.shape.is_some() {
        return Ok((None, Vec::new(), false));
    }
    let vertex_count = accessors.layout(job.streams.positions)?.count;
    let (indices, leftover) = triangle_list(accessors, job.primitive, vertex_count)?;
    if job.shared.is_some() {
        return Ok((None, indices, leftover));
    }
    let (vertices, indices) = Unpacked::read(accessors, &job.streams)?.framed(indices, job.tangents_from);
    Ok((Some(vertices), indices, leftover))
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
