//! The kit that built-in scenes are made with: parametric patches, and a scene under construction.

use std::{f64::consts::TAU, sync::Arc};

use glam::{Affine3A, DVec2, DVec3, Vec2};
use rayon::prelude::*;

use crate::{Aabb, Image, ImageData, Instance, Material, Mesh, Node, Scene, VertexAttributes};

/// Step of the differences that give a patch's normals, as a fraction of the patch. Positions are in `f64`: at 1e-5
/// rounding is 1e-11 of the extent, and curvature is resolved far below a vertex's own spacing.
const DIFFERENCE: f64 = 1e-5;

/// Which side of a patch is its front.
#[derive(Clone, Copy, Debug)]
pub(super) enum Front {
    /// The side that its normal at the middle shares with a direction.
    Along(DVec3),
    /// The side turned away from a point.
    AwayFrom(DVec3),
    /// The side turned to a point.
    Towards(DVec3),
}

/// Triangles of one mesh under construction.
#[derive(Default)]
pub(super) struct MeshData {
    positions_os: Vec<[f32; 3]>,
    attributes: Vec<VertexAttributes>,
    indices: Vec<u32>,
    /// Whether triangles are counted alone; then `counted` is how many.
    counting: bool,
    counted: u32,
}

impl MeshData {
    /// A mesh that only counts the triangles it is given.
    pub fn counter() -> Self {
        Self { counting: true, ..Self::default() }
    }

    /// The mesh with a patch added.
    pub fn with_patch(
        mut self,
        divisions: [u32; 2],
        front: Front,
        position: impl Fn(f64, f64) -> DVec3 + Sync,
        uv: impl Fn(f64, f64) -> DVec2 + Sync,
    ) -> Self {
        self.patch(divisions, front, position, uv);
        self
    }

    /// Adds the surface `position(s, t)` over the unit square as a grid of quads, two triangles each; normals and tangents
    /// follow from the functions. Triangles that a pole degenerates are left out.
    pub fn patch(
        &mut self,
        divisions: [u32; 2],
        front: Front,
        position: impl Fn(f64, f64) -> DVec3 + Sync,
        uv: impl Fn(f64, f64) -> DVec2 + Sync,
    ) {
        self.patch_of(divisions, front, &position, &uv);
    }

    /// [`Self::patch`], compiled once rather than for each surface's functions.
    fn patch_of(
        &mut self,
        divisions: [u32; 2],
        front: Front,
        position: &(dyn Fn(f64, f64) -> DVec3 + Sync),
        uv: &(dyn Fn(f64, f64) -> DVec2 + Sync),
    ) {
        let [n_s, n_t] = divisions.map(|n| n.max(1));
        if self.counting {
            self.counted += 2 * n_s * n_t;
            return;
        }
        let normal_of = |s, t| {
            let [along_s, along_t] = derivatives(s, t, &position);
            along_s.cross(along_t)
        };
        let (middle_os, normal_os) = (position(0.5, 0.5), normal_of(0.5, 0.5));
        let wanted = match front {
            Front::Along(direction) => direction,
            Front::AwayFrom(point) => middle_os - point,
            Front::Towards(point) => point - middle_os,
        };
        let side = if normal_os.dot(wanted) < 0.0 { -1.0 } else { 1.0 };
        let first = self.positions_os.len() as u32;
        let vertices: Vec<_> = (0..(n_s + 1) * (n_t + 1))
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let s = f64::from(i % (n_s + 1)) / f64::from(n_s);
                let t = f64::from(i / (n_s + 1)) / f64::from(n_t);
                let p = position(s, t).as_vec3().to_array();
                (p, vertex_attributes(s, t, side, &position, &uv))
            })
            .collect();
        self.positions_os.extend(vertices.iter().map(|v| v.0));
        self.attributes.extend(vertices.iter().map(|v| v.1));
        for t in 0..n_t {
            for s in 0..n_s {
                let a = first + t * (n_s + 1) + s;
                let (b, c) = (a + 1, a + n_s + 1);
                let d = c + 1;
                if side > 0.0 {
                    self.triangle([a, b, d]);
                    self.triangle([a, d, c]);
                } else {
                    self.triangle([a, d, b]);
                    self.triangle([a, c, d]);
                }
            }
        }
    }

    /// Adds a flat rectangle: a corner and its two edges, `uv_per_m` texture repeats a metre from (0, 0) at the corner.
    pub fn rectangle(
        &mut self,
        divisions: [u32; 2],
        front: DVec3,
        corner: DVec3,
        edges: [DVec3; 2],
        uv_per_m: f64,
    ) {
        let lengths = edges.map(|e| e.length() * uv_per_m);
        self.patch(
            divisions,
            Front::Along(front),
            |s, t| corner + edges[0] * s + edges[1] * t,
            |s, t| DVec2::new(lengths[0] * s, lengths[1] * (1.0 - t)),
        );
    }

    /// Adds a box of undivided faces: centre and half extents.
    pub fn cuboid(&mut self, center: DVec3, half: DVec3, uv_per_m: f64) {
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut normal = DVec3::ZERO;
                normal[axis] = sign;
                let (mut e0, mut e1) = (DVec3::ZERO, DVec3::ZERO);
                // the second edge is the upright one where there is one
                let (a0, a1) = [(2, 1), (0, 2), (0, 1)][axis];
                e0[a0] = 2.0 * half[a0];
                e1[a1] = 2.0 * half[a1];
                let corner = center + normal * half[axis] - 0.5 * (e0 + e1);
                self.rectangle([1, 1], normal, corner, [e0, e1], uv_per_m);
            }
        }
    }

    /// Adds a surface of revolution about +Y through `center`; `profile(t)` gives radius and height.
    /// The outside is the front, or the inside where `inside`.
    pub fn revolve(
        &mut self,
        divisions: [u32; 2],
        center: DVec3,
        inside: bool,
        profile: impl Fn(f64) -> DVec2 + Sync,
        uv_repeats: DVec2,
    ) {
        let axis_point = center + DVec3::Y * profile(0.5).y;
        let front = if inside { Front::Towards(axis_point) } else { Front::AwayFrom(axis_point) };
        // fewer than six around would be no body of revolution
        let divisions = [divisions[0].max(6), divisions[1]];
        let position = |s: f64, t: f64| {
            let p = profile(t);
            let angle = TAU * s.fract();
            center + DVec3::new(p.x * angle.cos(), p.y, -p.x * angle.sin())
        };
        self.patch(divisions, front, position, |s, t| DVec2::new(s, 1.0 - t) * uv_repeats);
    }

    /// Adds a sphere of `segments` around its equator and half as many from pole to pole.
    pub fn sphere(&mut self, segments: u32, center: DVec3, radius_m: f64) {
        let profile = |t: f64| {
            let angle = std::f64::consts::PI * (t - 0.5);
            // exactly zero at the poles, so that their triangles share one vertex position
            let cos = if t == 0.0 || t == 1.0 { 0.0 } else { angle.cos() };
            DVec2::new(radius_m * cos, radius_m * angle.sin())
        };
        self.revolve([segments.max(6), (segments / 2).max(3)], center, false, profile, DVec2::ONE);
    }

    /// Adds a tube about a closed or open curve; the frame is turned by `up`, which must not be parallel to the curve.
    pub fn tube(
        &mut self,
        divisions: [u32; 2],
        curve: impl Fn(f64) -> DVec3 + Sync,
        radius_m: f64,
        up: DVec3,
        uv_repeats: DVec2,
    ) {
        // fewer than four around would be no tube
        let divisions = [divisions[0], divisions[1].max(4)];
        let middle = curve(0.5);
        let position = |s: f64, t: f64| {
            let along = (curve(s + DIFFERENCE) - curve(s - DIFFERENCE)).normalize();
            let side = along.cross(up).normalize();
            let angle = TAU * t.fract();
            curve(s) + radius_m * (side * angle.cos() + side.cross(along) * angle.sin())
        };
        self.patch(divisions, Front::AwayFrom(middle), position, |s, t| DVec2::new(s, t) * uv_repeats);
    }

    fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|i| self.positions_os[i as usize]);
        if a != b && b != c && c != a {
            self.indices.extend(corners);
        }
    }

    /// Number of triangles so far.
    fn triangle_count(&self) -> u32 {
        if self.counting { self.counted } else { self.indices.len() as u32 / 3 }
    }
}

/// Derivatives of a patch by differences, one-sided at its borders.
fn derivatives(s: f64, t: f64, position: &impl Fn(f64, f64) -> DVec3) -> [DVec3; 2] {
    let (s0, s1) = ((s - DIFFERENCE).max(0.0), (s + DIFFERENCE).min(1.0));
    let (t0, t1) = ((t - DIFFERENCE).max(0.0), (t + DIFFERENCE).min(1.0));
    [(position(s1, t) - position(s0, t)) / (s1 - s0), (position(s, t1) - position(s, t0)) / (t1 - t0)]
}

/// Normal, tangent and texture coordinates of a patch at a point.
fn vertex_attributes(
    s: f64,
    t: f64,
    side: f64,
    position: &impl Fn(f64, f64) -> DVec3,
    uv: &impl Fn(f64, f64) -> DVec2,
) -> VertexAttributes {
    let mut d = derivatives(s, t, position);
    let mut normal_os = d[0].cross(d[1]);
    if normal_os.length_squared() < 1e-12 * (d[0].length_squared() + d[1].length_squared()).powi(2) {
        // a pole: the derivatives a little towards the middle
        let inward = |x: f64| x + (0.5 - x) * 1e-3;
        d = derivatives(inward(s), inward(t), position);
        normal_os = d[0].cross(d[1]);
    }
    let normal_os = normal_os.normalize_or(DVec3::Y) * side;
    let uv_at = |s: f64, t: f64| uv(s, t);
    let h = DIFFERENCE;
    let uv_s = (uv_at(s + h, t) - uv_at(s - h, t)) / (2.0 * h);
    let uv_t = (uv_at(s, t + h) - uv_at(s, t - h)) / (2.0 * h);
    let determinant = uv_s.perp_dot(uv_t);
    let sign = if determinant < 0.0 { -1.0 } else { 1.0 };
    let along_u = (d[0] * uv_t.y - d[1] * uv_s.y) * sign;
    let along_v = (d[1] * uv_s.x - d[0] * uv_t.x) * sign;
    let tangent_os = (along_u - normal_os * normal_os.dot(along_u)).normalize_or_zero();
    // glTF: v runs downwards, the bitangent upwards
    let handedness = if normal_os.cross(tangent_os).dot(along_v) > 0.0 { -1.0 } else { 1.0 };
    VertexAttributes::pack(
        normal_os.as_vec3(),
        tangent_os.as_vec3(),
        handedness,
        uv_at(s, t).as_vec2(),
        Vec2::ZERO,
        [1.0; 4],
    )
}

/// A scene under construction.
#[derive(Default)]
pub(super) struct SceneBuilder {
    /// The scene so far.
    pub scene: Scene,
}

impl SceneBuilder {
    /// Adds an image made by code; its index.
    pub fn image(&mut self, name: &str, size_px: u32, pixels: Vec<u8>) -> u32 {
        debug_assert_eq!(pixels.len(), (size_px * size_px * 4) as usize, "pixels of {name}");
        let data = ImageData::Rgba8 { width: size_px, height: size_px, pixels: Arc::from(pixels) };
        self.scene.images.push(Image { name: name.to_owned(), data, width: size_px, height: size_px });
        self.scene.images.len() as u32 - 1
    }

    /// Adds a material; its index.
    pub fn material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// Adds a mesh; its index.
    pub fn mesh(&mut self, name: &str, data: &MeshData, material: u32) -> u32 {
        let scene = &mut self.scene;
        let mut bounds_os = Aabb::EMPTY;
        for p in &data.positions_os {
            bounds_os.extend((*p).into());
        }
        scene.meshes.push(Mesh {
            name: name.to_owned(),
            first_index: scene.indices.len() as u32,
            index_count: 3 * data.triangle_count(),
            first_vertex: scene.positions_os.len() as u32,
            vertex_count: data.positions_os.len() as u32,
            material,
            bounds_os,
        });
        scene.positions_os.extend_from_slice(&data.positions_os);
        scene.attributes.extend_from_slice(&data.attributes);
        scene.indices.extend_from_slice(&data.indices);
        scene.meshes.len() as u32 - 1
    }

    /// Adds a node; its index.
    pub fn node(&mut self, name: &str, parent: Option<u32>, local: Affine3A) -> u32 {
        self.scene.nodes.push(Node { name: name.to_owned(), parent, local: local.as_daffine3() });
        self.scene.nodes.len() as u32 - 1
    }

    /// Draws a mesh at a new node; the node's index.
    pub fn place(&mut self, name: &str, mesh: u32, world_from_object: Affine3A) -> u32 {
        let node = self.node(name, None, world_from_object);
        self.scene.instances.push(Instance { mesh, node, world_from_object });
        node
    }

    /// Adds a mesh and draws it once where it was modelled.
    pub fn add(&mut self, name: &str, data: &MeshData, material: u32) -> u32 {
        let mesh = self.mesh(name, data, material);
        self.place(name, mesh, Affine3A::IDENTITY)
    }
}
