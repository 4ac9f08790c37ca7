//! The scene in memory: what every loader produces and every renderer uploads.
//!
//! Spaces: object space (`_os`) of one mesh, world space (`_ws`, metres, right-handed, +Y up as in
//! glTF), relative to [`Scene::origin_file`] in the coordinates of the file. Colours are linear Rec. 709 unless a name says sRGB. Triangles are counter-clockwise
//! seen from their front.

use std::{path::PathBuf, sync::Arc};

use glam::{Affine3A, DAffine3, DMat4, DVec3, DVec4, Mat4, Vec2, Vec3};

use crate::tangent;

/// Attributes of one vertex besides its position, packed as the GPU reads them (28 bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct VertexAttributes {
    /// Unit normal in object space, octahedral, two 16-bit signed normalised numbers, x in the low half.
    pub normal_os_oct: u32,
    /// Unit tangent in object space, octahedral as the normal; bit 16 (the lowest bit of y) holds
    /// the handedness instead: 1 for a bitangent of `-cross(normal, tangent)`. Where x is -32,768, which no direction has, there is
    /// no tangent: it is then the world's X axis laid into the surface, or the Z axis where the normal's x is 0.9 or more.
    pub tangent_os_oct: u32,
    /// Texture coordinates, set 0, as the bits of two `f32`.
    pub uv0: [u32; 2],
    /// Texture coordinates, set 1, as the bits of two `f32`.
    pub uv1: [u32; 2],
    /// Vertex colour, linear, RGBA, 8 bits each, R in the lowest byte; white where none is given.
    pub color_rgba8: u32,
}

/// One triangle list with one material (a glTF primitive).
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Name for messages.
    pub name: String,
    /// First index in [`Scene::indices`].
    pub first_index: u32,
    /// Number of indices, a multiple of three.
    pub index_count: u32,
    /// First vertex in [`Scene::positions_os`]; indices count from here.
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertex_count: u32,
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Bounds in object space over all vertices of the mesh.
    pub bounds_os: Aabb,
}

/// One mesh placed in the world: one draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// Index into [`Scene::nodes`] of the node that places it.
    pub node: u32,
    /// Object to world. A negative determinant mirrors: its triangles are clockwise in world space.
    pub world_from_object: Affine3A,
}

/// An axis-aligned box; empty when `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least corner.
    pub min: Vec3,
    /// Greatest corner.
    pub max: Vec3,
}

/// How a texture is wrapped outside [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Wrap {
    /// Repeats.
    #[default]
    Repeat,
    /// Repeats, every second copy mirrored.
    Mirror,
    /// Stays at the edge.
    Clamp,
}

/// A sampler; glTF's defaults are linear, linear mip-maps and repetition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Sampler {
    /// Nearest instead of linear magnification.
    pub mag_nearest: bool,
    /// Nearest instead of linear minification within a level.
    pub min_nearest: bool,
    /// Use of mip-map levels.
    pub mip: MipMode,
    /// Wrapping in u.
    pub wrap_u: Wrap,
    /// Wrapping in v.
    pub wrap_v: Wrap,
}

/// Use of mip-map levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MipMode {
    /// The finest level alone.
    None,
    /// The nearest level.
    Nearest,
    /// Linear between levels.
    #[default]
    Linear,
}

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::images`].
    pub image: u32,
    /// How it is sampled.
    pub sampler: Sampler,
    /// Texture coordinate set, 0 or 1.
    pub uv_set: u32,
    /// KHR_texture_transform as the rows of a 2×3 matrix: `uv' = (dot(row0, (u, v, 1)), dot(row1, (u, v, 1)))`.
    pub uv_transform: [[f32; 3]; 2],
}

/// How alpha is used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Ignored.
    #[default]
    Opaque,
    /// A surface exists where alpha ≥ cutoff.
    Mask {
        /// The cutoff.
        cutoff: f32,
    },
    /// Blended over what lies behind.
    Blend,
}

/// A metal-rough material of glTF 2.0.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name for messages.
    pub name: String,
    /// Linear base colour and alpha.
    pub base_color_factor: [f32; 4],
    /// sRGB base colour, alpha linear.
    pub base_color_texture: Option<TextureRef>,
    /// Metalness, 0 to 1.
    pub metallic_factor: f32,
    /// Perceptual roughness, 0 to 1.
    pub roughness_factor: f32,
    /// Roughness in G, metalness in B.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent-space normal map.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Occlusion in R.
    pub occlusion_texture: Option<TextureRef>,
    /// Strength of occlusion, 0 to 1.
    pub occlusion_strength: f32,
    /// Linear emission, the strength of KHR_materials_emissive_strength multiplied in.
    pub emissive_factor: [f32; 3],
    /// sRGB emission.
    pub emissive_texture: Option<TextureRef>,
    /// Use of alpha.
    pub alpha_mode: AlphaMode,
    /// Whether back faces are drawn, their normals turned.
    pub double_sided: bool,
    /// KHR_materials_unlit: base colour is the radiance that leaves.
    pub unlit: bool,
}

/// Where the encoded bytes of an image are.
#[derive(Clone, Debug)]
pub enum ImageData {
    /// A PNG or JPEG file.
    File(PathBuf),
    /// Encoded PNG or JPEG bytes.
    Encoded(Arc<[u8]>),
    /// Pixels made by code: RGBA, 8 bits each, row by row from the top.
    Rgba8 {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// `width * height * 4` bytes.
        pixels: Arc<[u8]>,
    },
}

/// An image: decoded when it is uploaded, so that only few are in memory at a time. Its header
/// was read on loading.
#[derive(Clone, Debug)]
pub struct Image {
    /// Name for messages: the URI, or the glTF index.
    pub name: String,
    /// Where the bytes are.
    pub data: ImageData,
    /// Width in pixels, from the header.
    pub width: u32,
    /// Height in pixels, from the header.
    pub height: u32,
}

/// Kind of a light, as in KHR_lights_punctual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// In all directions; intensity in candela.
    Point,
    /// Within a cone about the direction; intensity in candela.
    Spot {
        /// Angle from the axis where falloff begins, radians.
        inner_angle_rad: f32,
        /// Angle from the axis where light ends, radians.
        outer_angle_rad: f32,
    },
    /// From infinity; intensity in lux.
    Directional,
}

/// A light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Kind.
    pub kind: LightKind,
    /// Position in world space, metres (not used by directional lights).
    pub position_ws: Vec3,
    /// Unit direction in which the light shines, world space.
    pub direction_ws: Vec3,
    /// Linear colour times intensity: candela, or lux for directional lights.
    pub intensity: Vec3,
    /// Distance at which it ends, metres; infinite where none is given.
    pub range_m: f32,
}

/// Projection of a camera. Depth is reversed: 1 at the near plane, 0 at infinity (perspective) or
/// at the far plane (orthographic).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Perspective, far plane at infinity.
    Perspective {
        /// Vertical angle of view, radians.
        fov_y_rad: f32,
        /// Distance of the near plane, metres.
        near_m: f32,
    },
    /// Orthographic.
    Orthographic {
        /// Half the height of the view, metres; half the width follows from the image.
        half_height_m: f32,
        /// Near plane, metres.
        near_m: f32,
        /// Far plane, metres.
        far_m: f32,
    },
}

/// A camera: looks along its −Z, +Y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name, as `--camera` takes it; shared, since every frame has a camera and none should allocate for it.
    pub name: Arc<str>,
    /// Camera to world, rigid.
    pub world_from_view: Affine3A,
    /// Projection.
    pub projection: Projection,
}

/// What surrounds the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Radiance that reaches a surface from every direction: a white surface reflects as much.
    pub ambient_radiance: Vec3,
    /// Radiance of a pixel that shows no surface.
    pub background_radiance: Vec3,
}

/// A node of the hierarchy.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Name for messages and patterns.
    pub name: String,
    /// Index of the parent; parents precede children.
    pub parent: Option<u32>,
    /// Parent from node, at rest; the parent of a root is the space of the file.
    pub local: DAffine3,
}

/// A scene.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for reports.
    pub name: String,
    /// Where the origin of world space is in the coordinates of the file, metres: zero, or beside a scene that lies far from
    /// its file's origin. Instances, lights and cameras are relative to it.
    pub origin_file: DVec3,
    /// Vertex positions in object space, all meshes one after another.
    pub positions_os: Vec<[f32; 3]>,
    /// The other attributes, as many as positions.
    pub attributes: Vec<VertexAttributes>,
    /// Indices of all meshes, each counted from its mesh's first vertex.
    pub indices: Vec<u32>,
    /// Meshes.
    pub meshes: Vec<Mesh>,
    /// Nodes, parents first.
    pub nodes: Vec<Node>,
    /// Draws, in file order.
    pub instances: Vec<Instance>,
    /// Materials; at least one where there is a mesh.
    pub materials: Vec<Material>,
    /// Images.
    pub images: Vec<Image>,
    /// Lights of the file.
    pub lights: Vec<Light>,
    /// Cameras: those of the file, else one made to fit.
    pub cameras: Vec<Camera>,
    /// What surrounds it.
    pub environment: Environment,
    /// Animations. The first is played where none is named.
    pub animations: Vec<crate::animation::Animation>,
    /// Skins of what is drawn.
    pub skins: Vec<crate::Skin>,
    /// Vertices of deformed meshes as they are before any deformation.
    pub shapes: Vec<crate::Shape>,
    /// What deforms meshes, by rising mesh; none for meshes whose vertices stay. [`Scene::deformation_of`] finds an instance's.
    pub deformations: Vec<crate::Deformation>,
    /// Weights of the morph targets of all deformations at rest, in the order of [`Pose::weights`](crate::Pose::weights).
    pub rest_weights: Vec<f32>,
    /// What the drawn vertices of deformed meshes were last written for.
    pub shaped: crate::ShapePose,
    /// Cameras that hang on nodes; none where nothing is animated.
    pub camera_nodes: Vec<crate::Attachment>,
    /// Lights that hang on nodes; none where nothing is animated. Who puts other lights into the scene clears it.
    pub light_nodes: Vec<crate::Attachment>,
    /// What was tolerated, a line each.
    pub warnings: Vec<String>,
}

impl Default for Sampler {
    fn default() -> Self {
        Self {
            mag_nearest: false,
            min_nearest: false,
            mip: MipMode::Linear,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
        }
    }
}

impl Default for Environment {
    fn default() -> Self {
        Self { ambient_radiance: Vec3::splat(0.05), background_radiance: Vec3::ZERO }
    }
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color_factor: [1.0; 4],
            base_color_texture: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive_factor: [0.0; 3],
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
        }
    }
}

impl Material {
    /// All textures that it has.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let all = [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.occlusion_texture,
            &self.emissive_texture,
        ];
        all.into_iter().flatten()
    }
}

impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Aabb {
    /// The empty box.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Whether nothing is inside.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Grows to hold a point.
    pub fn extend(&mut self, point: Vec3) {
        self.min = self.min.min(point);
        self.max = self.max.max(point);
    }

    /// The least box that holds both.
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box of the eight corners, transformed; empty stays empty.
    pub fn transformed(&self, m: &Affine3A) -> Self {
        let mut out = Self::EMPTY;
        if !self.is_empty() {
            for i in 0..8u32 {
                let pick = |bit: u32, lo: f32, hi: f32| if i >> bit & 1 == 0 { lo } else { hi };
                out.extend(m.transform_point3(Vec3::new(
                    pick(0, self.min.x, self.max.x),
                    pick(1, self.min.y, self.max.y),
                    pick(2, self.min.z, self.max.z),
                )));
            }
        }
        out
    }

    /// Extent along each axis; zero where empty.
    pub fn size(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    /// Centre; the origin where empty.
    pub fn center(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { (self.min + self.max) * 0.5 }
    }
}

impl Camera {
    /// World to view.
    pub fn view_from_world(&self) -> Mat4 {
        DMat4::from(self.world_from_view.as_daffine3().inverse()).as_mat4()
    }

    /// View to clip, for an image of `aspect` = width / height. Reversed depth, y down as in Vulkan.
    pub fn clip_from_view(&self, aspect: f32) -> Mat4 {
        self.exact_clip_from_view(aspect).as_mat4()
    }

    /// World to clip, for an image of `aspect` = width / height. Multiplied in 64 bits, rounded once: the eye may be far from
    /// what it sees.
    pub fn clip_from_world(&self, aspect: f32) -> Mat4 {
        let view_from_world = DMat4::from(self.world_from_view.as_daffine3().inverse());
        (self.exact_clip_from_view(aspect) * view_from_world).as_mat4()
    }

    fn exact_clip_from_view(&self, aspect: f32) -> DMat4 {
        let aspect = f64::from(aspect);
        match self.projection {
            Projection::Perspective { fov_y_rad, near_m } => {
                let f = 1.0 / (0.5 * f64::from(fov_y_rad)).tan();
                DMat4::from_cols(
                    DVec4::new(f / aspect, 0.0, 0.0, 0.0),
                    DVec4::new(0.0, -f, 0.0, 0.0),
                    DVec4::new(0.0, 0.0, 0.0, -1.0),
                    DVec4::new(0.0, 0.0, near_m.into(), 0.0),
                )
            }
            Projection::Orthographic { half_height_m, near_m, far_m } => {
                // depth = (z_view + far) / (far - near), with z_view from -near (1) to -far (0)
                let [half_height_m, near_m, far_m] = [half_height_m, near_m, far_m].map(f64::from);
                let depth = far_m - near_m;
                DMat4::from_cols(
                    DVec4::new(1.0 / (half_height_m * aspect), 0.0, 0.0, 0.0),
                    DVec4::new(0.0, -1.0 / half_height_m, 0.0, 0.0),
                    DVec4::new(0.0, 0.0, 1.0 / depth, 0.0),
                    DVec4::new(0.0, 0.0, far_m / depth, 1.0),
                )
            }
        }
    }

    /// The same view with the planes of an orthographic camera as near as a box of the scene lets them be: depths there are at
    /// even steps, of which a far plane of 10^6 m would leave but one every 0.06 m. The planes move inwards alone, so that what
    /// they cut away stays away. An eye that is far from the box besides moves towards it, since view distances have 32 bits as
    /// well; returns by how much, metres, too. A perspective camera stays as it is: its steps are finer the nearer a surface is.
    pub fn fitted(&self, bounds_ws: &Aabb) -> (Self, f32) {
        /// Part of the box's extent that is kept free before and behind it, and part of where it is: rounding cuts nothing.
        const MARGIN: f64 = 0.01;
        const ROUNDING: f64 = 1e-5;
        /// Depths of the box that the eye may be away from it.
        const FAR_DEPTHS: f64 = 64.0;
        let stays = (self.clone(), 0.0);
        let Projection::Orthographic { half_height_m, near_m, far_m } = self.projection else { return stays };
        let forward = -self.world_from_view.matrix3.z_axis.as_dvec3();
        let (min, max) = (bounds_ws.min.as_dvec3(), bounds_ws.max.as_dvec3());
        let center_m = forward.dot(0.5 * (min + max) - self.eye_ws().as_dvec3());
        let half_m = 0.5 * forward.abs().dot(max - min);
        let margin_m = MARGIN * (max - min).max_element() + ROUNDING * min.abs().max(max.abs()).max_element();
        let nearest_m = (center_m - half_m - margin_m).max(near_m.into());
        let farthest_m = (center_m + half_m + margin_m).min(far_m.into());
        let depth_m = farthest_m - nearest_m;
        // Nothing of the box is between the planes, or it is empty or not finite.
        if bounds_ws.is_empty() || !(depth_m > 0.0 && depth_m.is_finite()) {
            return stays;
        }
        let moved_m = if nearest_m > FAR_DEPTHS * depth_m { (nearest_m - depth_m) as f32 } else { 0.0 };
        let [near_m, far_m] = [nearest_m, farthest_m].map(|m| (m - f64::from(moved_m)) as f32);
        if near_m >= far_m {
            return stays;
        }
        let mut camera = self.clone();
        camera.projection = Projection::Orthographic { half_height_m, near_m, far_m };
        let eye_ws = self.eye_ws().as_dvec3() + forward * f64::from(moved_m);
        camera.world_from_view.translation = eye_ws.as_vec3().into();
        (camera, moved_m)
    }

    /// Position of the eye in world space.
    pub fn eye_ws(&self) -> Vec3 {
        self.world_from_view.translation.into()
    }

    /// A perspective camera at `eye_ws` that looks at `target_ws`, +Y up (or +Z where it looks along Y).
    pub fn look_at(
        name: impl Into<Arc<str>>,
        eye_ws: Vec3,
        target_ws: Vec3,
        fov_y_rad: f32,
        near_m: f32,
    ) -> Self {
        let forward = (target_ws - eye_ws).try_normalize().unwrap_or(Vec3::NEG_Z);
        let up = if forward.y.abs() > 0.9999 { Vec3::Z } else { Vec3::Y };
        let right = forward.cross(up).normalize();
        let up = right.cross(forward);
        Self {
            name: name.into(),
            world_from_view: Affine3A::from_cols(right.into(), up.into(), (-forward).into(), eye_ws.into()),
            projection: Projection::Perspective { fov_y_rad, near_m },
        }
    }
}

impl Scene {
    /// A point in the coordinates of the file, metres: what people read and write.
    pub fn file_from_world(&self, point_ws: Vec3) -> DVec3 {
        self.origin_file + point_ws.as_dvec3()
    }

    /// A point of the file's coordinates in world space, metres.
    pub fn world_from_file(&self, point_file: DVec3) -> Vec3 {
        (point_file - self.origin_file).as_vec3()
    }

    /// Bounds in world space: each instance's own box, transformed by its eight corners.
    pub fn bounds_ws(&self) -> Aabb {
        self.instances.iter().fold(Aabb::EMPTY, |b, i| {
            b.union(&self.meshes[i.mesh as usize].bounds_os.transformed(&i.world_from_object))
        })
    }

    /// Triangles drawn: those of each instance's mesh.
    pub fn triangle_count(&self) -> u64 {
        self.instances.iter().map(|i| u64::from(self.meshes[i.mesh as usize].index_count / 3)).sum()
    }
}

/// Packed tangent of a vertex that has none: an x that no direction is packed to.
const NO_TANGENT: u32 = 0x8000;

impl VertexAttributes {
    /// Packs attributes. `normal_os` and `tangent_os` need not be unit; a tangent without a length or along the normal is none, for which every
    /// renderer takes the same direction in world space ([`Self::tangent_os_oct`]); `handedness` is the sign of the bitangent (glTF's TANGENT.w). Angular error: at most 6.5e-5 rad (normal), 1.5e-4 (tangent), as tested in the oracle.
    pub fn pack(
        normal_os: Vec3,
        tangent_os: Vec3,
        handedness: f32,
        uv0: Vec2,
        uv1: Vec2,
        color: [f32; 4],
    ) -> Self {
        let [normal_os_oct, tangent_os_oct] = Self::pack_frame(normal_os, tangent_os, handedness);
        Self {
            normal_os_oct,
            tangent_os_oct,
            uv0: [uv0.x.to_bits(), uv0.y.to_bits()],
            uv1: [uv1.x.to_bits(), uv1.y.to_bits()],
            color_rgba8: color
                .iter()
                .enumerate()
                .fold(0, |c, (i, v)| c | ((v.clamp(0.0, 1.0) * 255.0 + 0.5) as u32) << (8 * i)),
        }
    }

    /// [`Self::normal_os_oct`] and [`Self::tangent_os_oct`], as [`Self::pack`] makes them.
    pub(crate) fn pack_frame(normal_os: Vec3, tangent_os: Vec3, handedness: f32) -> [u32; 2] {
        let sign_bit = u32::from(handedness < 0.0) << 16;
        let tangent = tangent::tangent_beside(normal_os, tangent_os).map_or(NO_TANGENT, oct_encode);
        [oct_encode(normal_os), (tangent & !(1 << 16)) | sign_bit]
    }

    /// The unit normal in object space.
    pub fn normal_os(&self) -> Vec3 {
        oct_decode(self.normal_os_oct)
    }

    /// The unit tangent in object space, zero where there is none, and the bitangent's sign.
    pub fn tangent_os(&self) -> (Vec3, f32) {
        let sign = if self.tangent_os_oct >> 16 & 1 == 1 { -1.0 } else { 1.0 };
        if self.tangent_os_oct & 0xffff == NO_TANGENT {
            return (Vec3::ZERO, sign);
        }
        (oct_decode(self.tangent_os_oct & !(1 << 16)), sign)
    }

    /// Texture coordinates of set 0 or 1.
    pub fn uv(&self, set: u32) -> Vec2 {
        let [u, v] = if set == 1 { self.uv1 } else { self.uv0 };
        Vec2::new(f32::from_bits(u), f32::from_bits(v))
    }
}

/// Encodes a direction on the octahedron (Cigolle et al. 2014), 2 × 16 bits signed normalised.
fn oct_encode(v: Vec3) -> u32 {
    let l1 = v.x.abs() + v.y.abs() + v.z.abs();
    let n = if l1 > 0.0 && l1.is_finite() { v / l1 } else { Vec3::Z };
    let (mut x, mut y) = (n.x, n.y);
    if n.z < 0.0 {
        (x, y) = ((1.0 - n.y.abs()).copysign(n.x), (1.0 - n.x.abs()).copysign(n.y));
    }
    let q = |f: f32| u32::from(((f.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16);
    q(x) | q(y) << 16
}

/// Decodes what [`oct_encode`] made.
fn oct_decode(bits: u32) -> Vec3 {
    let d = |h: u32| (f32::from(h as u16 as i16) / 32767.0).max(-1.0);
    let (x, y) = (d(bits & 0xffff), d(bits >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let t = (-z).max(0.0);
    Vec3::new(x - t.copysign(x), y - t.copysign(y), z).normalize()
}
