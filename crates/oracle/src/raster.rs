//! What a pixel shows, by a ray through its centre: the reference for every technique's surfaces and shading.

use afterlight_scene::{AlphaMode, Camera, Instance, Light, Material, Projection, Scene};
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};

use crate::{
    brdf::{Surface, shade},
    packing::{unpack_normal, unpack_tangent},
    tangent::tangent_of,
    texture::{sample_finest, transformed_uv},
    tiles::world_from_view,
};

/// Triangles of a leaf of the hierarchy.
const LEAF_TRIANGLES: usize = 4;

/// A ray with the part of it that counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, world space.
    pub origin_ws: DVec3,
    /// Direction; not unit: its length along the view direction is 1, so the parameter is the view distance.
    pub direction_ws: DVec3,
    /// Parameters of the near and far plane, metres of view distance.
    pub range_m: [f64; 2],
}

/// A point of a surface that a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// View distance, metres.
    pub distance_m: f64,
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Triangle of the instance's mesh.
    pub triangle: u32,
    /// Weights of the second and third corner.
    pub barycentric: DVec2,
    /// Whether the front is seen; mirroring instances taken into account.
    pub front: bool,
    /// Parameter distance to the nearest edge of the triangle as a barycentric coordinate: small values mean
    /// that rounding may show another triangle.
    pub edge_distance: f64,
}

impl Hit {
    /// The triangle that is met: instance, and triangle of its mesh.
    pub fn place(&self) -> (u32, u32) {
        (self.instance, self.triangle)
    }
}

/// Interpolated attributes of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attributes {
    /// Position in world space, metres.
    pub position_ws: DVec3,
    /// Interpolated normal, world space, not unit, on the side of the front.
    pub normal_ws: DVec3,
    /// Interpolated tangent, world space, not unit.
    pub tangent_ws: DVec3,
    /// Sign of the bitangent `cross(normal, tangent)`, interpolated: between -1 and 1 where the vertices have both signs.
    pub handedness: f64,
    /// Both sets of texture coordinates.
    pub uv: [DVec2; 2],
    /// Vertex colour, linear.
    pub color: DVec4,
}

struct Triangle {
    corners_ws: [DVec3; 3],
    /// Whether its instance is mirrored, which turns its front.
    mirrored: bool,
    instance: u32,
    triangle: u32,
}

struct Node {
    min: DVec3,
    max: DVec3,
    /// Leaf: first triangle and count. Inner: the second child's index (the first follows) and 0.
    first: u32,
    count: u32,
}

/// A scene ready for rays.
pub struct RayScene<'a> {
    scene: &'a Scene,
    /// Without those with alpha blending.
    triangles: Vec<Triangle>,
    nodes: Vec<Node>,
    /// Those with alpha blending.
    blended: Vec<Triangle>,
}

impl<'a> RayScene<'a> {
    /// Builds the hierarchy of boxes.
    pub fn new(scene: &'a Scene) -> Self {
        let (mut triangles, mut blended) = (Vec::new(), Vec::new());
        for (i, instance) in scene.instances.iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh as usize];
            let of_kind = match scene.materials[mesh.material as usize].alpha_mode {
                AlphaMode::Blend => &mut blended,
                _ => &mut triangles,
            };
            let mirrored = widened(instance).determinant() < 0.0;
            for triangle in 0..mesh.index_count / 3 {
                let corners_ws = corners_ws(scene, instance, triangle);
                of_kind.push(Triangle { corners_ws, mirrored, instance: i as u32, triangle });
            }
        }
        let mut nodes = Vec::new();
        let count = triangles.len();
        if count > 0 {
            build(&mut nodes, &mut triangles, 0, count);
        }
        Self { scene, triangles, nodes, blended }
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// The first surface without alpha blending along a ray: back faces count where the material is double-sided, masked surfaces where alpha
    /// reaches the cutoff.
    pub fn first_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.walk(ray, |hit| {
            let is_nearer = best.is_none_or(|best| hit.distance_m < best.distance_m);
            if is_nearer && self.is_there(&hit) {
                best = Some(hit);
            }
            best.map_or(ray.range_m[1], |best| best.distance_m)
        });
        best
    }

    /// Surfaces without alpha blending along a ray, from near to far, up to the first one that is not doubtful; masked ones whatever their alpha,
    /// so `is_doubtful` must say so of them.
    pub fn surfaces(&self, ray: &Ray, is_doubtful: impl Fn(&Hit) -> bool) -> Vec<Hit> {
        let (mut hits, mut farthest_m) = (Vec::new(), ray.range_m[1]);
        self.walk(ray, |hit| {
            if hit.distance_m <= farthest_m {
                if !is_doubtful(&hit) {
                    farthest_m = hit.distance_m;
                }
                hits.push(hit);
            }
            farthest_m
        });
        hits.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        let closed = hits.iter().position(|hit| !is_doubtful(hit));
        hits.truncate(closed.map_or(hits.len(), |last| last + 1));
        hits
    }

    /// Visits surfaces without alpha blending that a ray meets, in no order, as far as a visit says: it returns the view distance beyond which
    /// nothing is asked for.
    fn walk(&self, ray: &Ray, mut visit: impl FnMut(Hit) -> f64) {
        let mut farthest_m = ray.range_m[1];
        let mut stack = vec![0usize];
        while let Some(n) = stack.pop() {
            let Some(node) = self.nodes.get(n) else { continue };
            if !meets_box(node, ray, farthest_m) {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.first as usize, n + 1]);
                continue;
            }
            for triangle in &self.triangles[node.first as usize..][..node.count as usize] {
                if let Some(hit) = self.meets(triangle, ray) {
                    farthest_m = visit(hit);
                }
            }
        }
    }

    /// Surfaces with alpha blending along a ray before a view distance, from far to near.
    pub fn layers(&self, ray: &Ray, before_m: f64) -> Vec<Hit> {
        let hits = self.blended.iter().filter_map(|triangle| self.meets(triangle, ray));
        let mut layers: Vec<Hit> = hits.filter(|hit| hit.distance_m < before_m).collect();
        layers.sort_by(|a, b| b.distance_m.total_cmp(&a.distance_m));
        layers
    }

    /// Opacity of a surface with alpha blending.
    pub fn alpha(&self, hit: &Hit) -> f64 {
        self.base_color(self.material(hit.instance), &self.attributes(hit)).w
    }

    /// The material of an instance.
    pub fn material(&self, instance: u32) -> &'a Material {
        let mesh = self.scene.instances[instance as usize].mesh;
        &self.scene.materials[self.scene.meshes[mesh as usize].material as usize]
    }

    /// Ray against triangle (Möller, Trumbore 1997).
    fn meets(&self, triangle: &Triangle, ray: &Ray) -> Option<Hit> {
        let [a, b, c] = triangle.corners_ws;
        let (ab, ac) = (b - a, c - a);
        let p = ray.direction_ws.cross(ac);
        let determinant = ab.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let u = (ray.origin_ws - a).dot(p) / determinant;
        let q = (ray.origin_ws - a).cross(ab);
        let v = ray.direction_ws.dot(q) / determinant;
        let distance_m = ac.dot(q) / determinant;
        let in_range = distance_m >= ray.range_m[0] && distance_m <= ray.range_m[1];
        if !(u >= 0.0 && v >= 0.0 && u + v <= 1.0 && in_range) {
            return None;
        }
        // positive if the corners run counter-clockwise
        let front = (determinant > 0.0) != triangle.mirrored;
        if !front && !self.material(triangle.instance).double_sided {
            return None;
        }
        Some(Hit {
            distance_m,
            instance: triangle.instance,
            triangle: triangle.triangle,
            barycentric: DVec2::new(u, v),
            front,
            edge_distance: u.min(v).min(1.0 - u - v),
        })
    }

    /// Whether a masked surface is there.
    fn is_there(&self, hit: &Hit) -> bool {
        let material = self.material(hit.instance);
        let AlphaMode::Mask { cutoff } = material.alpha_mode else { return true };
        self.base_color(material, &self.attributes(hit)).w >= f64::from(cutoff)
    }

    /// Linear base colour and alpha. Textures that are files count as white.
    fn base_color(&self, material: &Material, at: &Attributes) -> DVec4 {
        let factor = DVec4::from_array(material.base_color_factor.map(f64::from));
        factor * at.color * self.sample(material.base_color_texture.as_ref(), at, true).unwrap_or(DVec4::ONE)
    }

    fn sample(
        &self,
        texture: Option<&afterlight_scene::TextureRef>,
        at: &Attributes,
        srgb: bool,
    ) -> Option<DVec4> {
        let texture = texture?;
        let uv = transformed_uv(texture, at.uv[usize::from(texture.uv_set == 1)]);
        sample_finest(&self.scene.images[texture.image as usize], &texture.sampler, uv, srgb)
    }

    /// Interpolates the attributes of a hit. Normals and tangents are made unit at the corners, in world space.
    pub fn attributes(&self, hit: &Hit) -> Attributes {
        let instance = &self.scene.instances[hit.instance as usize];
        let world_from_object = widened(instance);
        let linear = DMat3::from_mat4(world_from_object);
        let determinant = linear.determinant();
        let mirror = if determinant < 0.0 { -1.0 } else { 1.0 };
        // inverse transpose times |determinant|: no inverse needed, and outward stays outward
        let cofactor = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        ) * mirror;
        let weights = [1.0 - hit.barycentric.x - hit.barycentric.y, hit.barycentric.x, hit.barycentric.y];
        let vertices = corner_vertices(self.scene, instance, hit.triangle);
        let mut out = Attributes {
            position_ws: DVec3::ZERO,
            normal_ws: DVec3::ZERO,
            tangent_ws: DVec3::ZERO,
            handedness: 0.0,
            uv: [DVec2::ZERO; 2],
            color: DVec4::ZERO,
        };
        for (vertex, weight) in vertices.into_iter().zip(weights) {
            let a = &self.scene.attributes[vertex];
            let position_os = DVec3::from_array(self.scene.positions_os[vertex].map(f64::from));
            let (tangent_os, sign) = unpack_tangent(a.tangent_os_oct);
            out.position_ws += weight * world_from_object.transform_point3(position_os);
            let normal_ws = (cofactor * unpack_normal(a.normal_os_oct)).normalize_or_zero();
            out.normal_ws += weight * normal_ws;
            out.tangent_ws += weight * tangent_of(normal_ws, linear * tangent_os);
            out.handedness += weight * sign * mirror;
            for set in 0..2 {
                out.uv[set as usize] += weight * a.uv(set).as_dvec2();
            }
            let byte = |c: u32| f64::from(a.color_rgba8 >> (8 * c) & 0xff) / 255.0;
            out.color += weight * DVec4::new(byte(0), byte(1), byte(2), byte(3));
        }
        out
    }

    /// Unit normal of a hit's triangle in world space, to either side.
    pub fn plane_normal_ws(&self, hit: &Hit) -> DVec3 {
        let [a, b, c] = self.corners_ws(hit);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Corners of a hit's triangle, world space.
    pub fn corners_ws(&self, hit: &Hit) -> [DVec3; 3] {
        corners_ws(self.scene, &self.scene.instances[hit.instance as usize], hit.triangle)
    }

    /// The surface of a hit: attributes, factors, textures made by code on their finest level (glTF 2.0, section 3.9).
    pub fn surface(&self, hit: &Hit) -> Surface {
        let m = self.material(hit.instance);
        let at = self.attributes(hit);
        let mut normal_ws = at.normal_ws;
        if let Some(texel) = self.sample(m.normal_texture.as_ref(), &at, false) {
            // of a texel that is not unit the direction counts; the device keeps x and y of that, and finds z from them
            let stored = texel.truncate() * 2.0 - 1.0;
            let unit = stored.with_z(stored.z.max(0.0)).normalize_or(DVec3::Z);
            let (xy, z) = (unit.truncate() * f64::from(m.normal_scale), unit.z);
            let bitangent_ws = at.handedness * at.normal_ws.cross(at.tangent_ws);
            normal_ws = xy.x * at.tangent_ws + xy.y * bitangent_ws + z * at.normal_ws;
        }
        let normal_ws = normal_ws.normalize_or_zero() * if hit.front { 1.0 } else { -1.0 };
        let orm = self.sample(m.metallic_roughness_texture.as_ref(), &at, false).unwrap_or(DVec4::ONE);
        let occlusion = self.sample(m.occlusion_texture.as_ref(), &at, false).map_or(1.0, |t| t.x);
        let emissive = self.sample(m.emissive_texture.as_ref(), &at, true).unwrap_or(DVec4::ONE);
        Surface {
            position_ws: at.position_ws,
            normal_ws,
            base_color: self.base_color(m, &at).truncate(),
            metallic: f64::from(m.metallic_factor) * orm.z,
            roughness: f64::from(m.roughness_factor) * orm.y,
            occlusion: 1.0 + f64::from(m.occlusion_strength) * (occlusion - 1.0),
            emission: DVec3::from_array(m.emissive_factor.map(f64::from)) * emissive.truncate(),
            unlit: m.unlit,
        }
    }

    /// Linear radiance of a pixel, row 0 on top; the background's where it shows no surface. Layers with alpha blending are over it,
    /// each at its own place along the ray.
    pub fn shade_pixel(
        &self,
        lights: &[Light],
        camera: &Camera,
        pixel: [u32; 2],
        size_px: [u32; 2],
    ) -> DVec3 {
        let ray = pixel_ray(camera, pixel, size_px);
        let environment = &self.scene.environment;
        let to_eye = -ray.direction_ws.normalize();
        let radiance =
            |hit: &Hit| shade(&self.surface(hit), to_eye, lights, environment.ambient_radiance.as_dvec3());
        let first = self.first_hit(&ray);
        let behind = first.as_ref().map_or(environment.background_radiance.as_dvec3(), radiance);
        let layers = self.layers(&ray, first.map_or(f64::INFINITY, |hit| hit.distance_m));
        layers.iter().fold(behind, |below, layer| {
            let alpha = self.alpha(layer);
            alpha * radiance(layer) + (1.0 - alpha) * below
        })
    }
}

/// The ray through the centre of a pixel, row 0 on top.
pub fn pixel_ray(camera: &Camera, pixel: [u32; 2], size_px: [u32; 2]) -> Ray {
    ray_through(camera, DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5, size_px)
}

/// Where a point is seen, pixels from the image's upper left corner; `None` behind the eye. The inverse of [`ray_through`].
pub fn place_of(camera: &Camera, point_ws: DVec3, size_px: [u32; 2]) -> Option<DVec2> {
    let [width, height] = size_px.map(f64::from);
    let at = world_from_view(camera).inverse().transform_point3(point_ws);
    let half = match camera.projection {
        Projection::Perspective { fov_y_rad, .. } => -at.z * (0.5 * f64::from(fov_y_rad)).tan(),
        Projection::Orthographic { half_height_m, .. } => f64::from(half_height_m),
    };
    let (right, up) = (at.x / (half * width / height), at.y / half);
    (half > 0.0).then(|| DVec2::new((right + 1.0) * 0.5 * width, (1.0 - up) * 0.5 * height))
}

/// The ray through a place of an image, pixels from its upper left corner.
pub fn ray_through(camera: &Camera, place_px: DVec2, size_px: [u32; 2]) -> Ray {
    let [width, height] = size_px.map(f64::from);
    let right = place_px.x * 2.0 / width - 1.0;
    let up = 1.0 - place_px.y * 2.0 / height;
    let aspect = width / height;
    let pose = world_from_view(camera);
    match camera.projection {
        Projection::Perspective { fov_y_rad, near_m } => {
            let half = (0.5 * f64::from(fov_y_rad)).tan();
            let direction = DVec3::new(right * half * aspect, up * half, -1.0);
            Ray {
                origin_ws: pose.w_axis.truncate(),
                direction_ws: pose.transform_vector3(direction),
                range_m: [f64::from(near_m), f64::INFINITY],
            }
        }
        Projection::Orthographic { half_height_m, near_m, far_m } => {
            let half = f64::from(half_height_m);
            Ray {
                origin_ws: pose.transform_point3(DVec3::new(right * half * aspect, up * half, 0.0)),
                direction_ws: pose.transform_vector3(DVec3::NEG_Z),
                range_m: [f64::from(near_m), f64::from(far_m)],
            }
        }
    }
}

/// Vertices of a triangle of an instance, as indices into the scene's arrays.
fn corner_vertices(scene: &Scene, instance: &Instance, triangle: u32) -> [usize; 3] {
    let mesh = &scene.meshes[instance.mesh as usize];
    let first = (mesh.first_index + 3 * triangle) as usize;
    [0, 1, 2].map(|k| (mesh.first_vertex + scene.indices[first + k]) as usize)
}

/// Corners of a triangle of an instance.
fn corners_ws(scene: &Scene, instance: &Instance, triangle: u32) -> [DVec3; 3] {
    let world_from_object = widened(instance);
    corner_vertices(scene, instance, triangle).map(|vertex| {
        let position_os = DVec3::from_array(scene.positions_os[vertex].map(f64::from));
        world_from_object.transform_point3(position_os)
    })
}

fn widened(instance: &Instance) -> DMat4 {
    DMat4::from(instance.world_from_object.as_daffine3())
}

/// Splits at the median of the centres along the longest axis until few are left.
fn build(nodes: &mut Vec<Node>, triangles: &mut [Triangle], first: usize, count: usize) {
    let part = &mut triangles[first..first + count];
    let corners = || part.iter().flat_map(|t| t.corners_ws);
    let min = corners().fold(DVec3::INFINITY, DVec3::min);
    let max = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let index = nodes.len();
    nodes.push(Node { min, max, first: first as u32, count: count as u32 });
    if count <= LEAF_TRIANGLES {
        return;
    }
    let size = max - min;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let center = |t: &Triangle| t.corners_ws.iter().map(|p| p[axis]).sum::<f64>();
    part.select_nth_unstable_by(count / 2, |a, b| center(a).total_cmp(&center(b)));
    build(nodes, triangles, first, count / 2);
    nodes[index].first = nodes.len() as u32;
    nodes[index].count = 0;
    build(nodes, triangles, first + count / 2, count - count / 2);
}

fn meets_box(node: &Node, ray: &Ray, farthest_m: f64) -> bool {
    let inverse = ray.direction_ws.recip();
    let (a, b) = ((node.min - ray.origin_ws) * inverse, (node.max - ray.origin_ws) * inverse);
    // relative 1e-12: a flat box has no inside, and its rays meet it in a point; f64::min drops a NaN of 0 × ∞
    let near = |k: usize| a[k].min(b[k]);
    let far = |k: usize| a[k].max(b[k]);
    let enter = near(0).max(near(1)).max(near(2)).max(ray.range_m[0]);
    let leave = far(0).min(far(1)).min(far(2)).min(farthest_m);
    enter <= leave + 1e-12 * (1.0 + leave.abs())
}
