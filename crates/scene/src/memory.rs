//! Scenes from memory: meshes, materials, images, lights and cameras as slices, no file.
//!
//! What a mesh lacks is made as for a glTF file, by the same code.

use std::path::Path;

use glam::Affine3A;

use crate::gltf::{INDEX_COUNT_MAX, Unpacked, VERTEX_COUNT_MAX, add_mesh};
use crate::{
    Camera, Environment, Image, ImageData, Instance, Light, Material, Node, Scene, SceneError, texture,
};

/// What messages call a scene that is no file.
const NO_FILE: &str = "scene from memory";

macro_rules! handles {
    ($($(#[doc = $doc:literal])+ $name:ident,)*) => {$(
        $(#[doc = $doc])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub struct $name(u32);

        impl $name {
            /// Its place among those of the scene.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

handles! {
    /// An image of a scene: [`TextureRef::image`](crate::TextureRef::image) takes its index.
    ImageHandle,
    /// A material of a scene.
    MaterialHandle,
    /// A mesh of a scene.
    MeshHandle,
    /// An instance of a scene: its place in [`Scene::instances`] and in poses.
    InstanceHandle,
    /// A light of a scene: its place in [`Scene::lights`] and in poses.
    LightHandle,
}

/// A triangle list. Attributes have a value a vertex, or none at all.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshSource<'a> {
    /// Positions, object space, metres.
    pub positions_os: &'a [[f32; 3]],
    /// Normals, object space, of any length; none: each face is flat.
    pub normals_os: &'a [[f32; 3]],
    /// Tangents, object space, and the sign of the bitangent (glTF's TANGENT); none: made along the texture coordinates where the material
    /// has a normal map.
    pub tangents_os: &'a [[f32; 4]],
    /// Texture coordinates of the sets 0 and 1, v downwards.
    pub uvs: [&'a [[f32; 2]]; 2],
    /// Colours, linear, RGBA, 0 to 1; none: white.
    pub colors: &'a [[f32; 4]],
    /// Three a triangle, counter-clockwise seen from its front, each below the number of vertices; none: the vertices in their order.
    pub indices: &'a [u32],
}

/// A scene under construction.
#[derive(Default)]
pub struct SceneBuilder {
    scene: Scene,
}

impl SceneBuilder {
    /// An empty scene; its name is for reports.
    pub fn new(name: &str) -> Self {
        Self { scene: Scene { name: name.to_owned(), ..Scene::default() } }
    }

    /// Adds an image: encoded bytes (PNG or JPEG), whose header is read, or pixels.
    ///
    /// # Errors
    /// [`SceneError::Invalid`]: no image, or pixels that are not `4 * width * height` bytes.
    pub fn image(&mut self, name: &str, data: ImageData) -> Result<ImageHandle, SceneError> {
        if let ImageData::Rgba8 { width, height, pixels } = &data {
            let expected = 4 * u64::from(*width) * u64::from(*height);
            if pixels.len() as u64 != expected || expected == 0 {
                let found = format!("{} bytes for {width} x {height} pixels", pixels.len());
                return Err(invalid(
                    &format!("image {name}"),
                    &found,
                    "4 bytes a pixel, of one pixel or more",
                ));
            }
        }
        let image: Image = texture::open(Path::new(NO_FILE), name.to_owned(), data)?;
        self.scene.images.push(image);
        Ok(ImageHandle(self.scene.images.len() as u32 - 1))
    }

    /// Adds a material.
    ///
    /// # Errors
    /// [`SceneError::Invalid`]: a texture of an image that the scene has not, or of a set other than 0 and 1.
    pub fn material(&mut self, material: Material) -> Result<MaterialHandle, SceneError> {
        for texture in material.textures() {
            let at = format!("material {}", material.name);
            let images = self.scene.images.len();
            if texture.image as usize >= images {
                return Err(invalid(&at, &format!("image {}", texture.image), &format!("one of {images}")));
            }
            if texture.uv_set > 1 {
                return Err(invalid(&at, &format!("texture coordinates {}", texture.uv_set), "set 0 or 1"));
            }
        }
        self.scene.materials.push(material);
        Ok(MaterialHandle(self.scene.materials.len() as u32 - 1))
    }

    /// Adds a mesh of one material. It is drawn where instances place it.
    ///
    /// # Errors
    /// [`SceneError::Invalid`] names what is wrong: an attribute of another length than positions, values that are not finite, an index past
    /// the vertices, indices that are no whole triangles, a material of another scene. [`SceneError::TooLarge`]: more vertices or indices in
    /// all than a scene can hold.
    pub fn mesh(
        &mut self,
        name: &str,
        source: &MeshSource<'_>,
        material: MaterialHandle,
    ) -> Result<MeshHandle, SceneError> {
        let at = format!("mesh {name}");
        let Some(surface) = self.scene.materials.get(material.index()) else {
            let expected = format!("one of {}", self.scene.materials.len());
            return Err(invalid(&at, &format!("material {}", material.index()), &expected));
        };
        source.check(&at)?;
        let indices: Vec<u32> = match source.indices {
            [] => (0..source.positions_os.len() as u32).collect(),
            indices => indices.to_vec(),
        };
        // As for a file: without a normal map nobody reads tangents that are made.
        let map =
            surface.normal_texture.map(|map| map.uv_set as usize).filter(|_| source.tangents_os.is_empty());
        let tangents_from = map.filter(|set| !source.uvs[*set].is_empty());
        let unpacked = Unpacked {
            positions_os: source.positions_os.to_vec(),
            normals_os: source.normals_os.to_vec(),
            tangents_os: source.tangents_os.to_vec(),
            uv: source.uvs.map(<[_]>::to_vec),
            colors: source.colors.to_vec(),
        };
        // Flat faces and tangents split vertices, at most into one a corner.
        let vertices_most = (source.positions_os.len() + indices.len()) as u64;
        let scene = &mut self.scene;
        for (what, found, limit) in [
            ("vertices", scene.positions_os.len() as u64 + vertices_most, VERTEX_COUNT_MAX),
            ("indices", (scene.indices.len() + indices.len()) as u64, INDEX_COUNT_MAX),
        ] {
            if found > limit {
                return Err(SceneError::TooLarge {
                    file: NO_FILE.into(),
                    what: what.to_owned(),
                    found,
                    limit,
                });
            }
        }
        let (vertices, indices) = unpacked.framed(indices, tangents_from);
        add_mesh(scene, name, vertices, &indices, material.0);
        Ok(MeshHandle(scene.meshes.len() as u32 - 1))
    }

    /// Places a mesh.
    ///
    /// # Errors
    /// [`SceneError::Invalid`]: a mesh of another scene, a matrix that is not finite.
    pub fn instance(
        &mut self,
        name: &str,
        mesh: MeshHandle,
        world_from_object: Affine3A,
    ) -> Result<InstanceHandle, SceneError> {
        let at = format!("instance {name}");
        let meshes = self.scene.meshes.len();
        if mesh.index() >= meshes {
            return Err(invalid(&at, &format!("mesh {}", mesh.index()), &format!("one of {meshes}")));
        }
        if !world_from_object.is_finite() {
            return Err(invalid(&at, "a matrix with NaN or infinity", "finite numbers"));
        }
        let local = world_from_object.as_daffine3();
        self.scene.nodes.push(Node { name: name.to_owned(), parent: None, local });
        let node = self.scene.nodes.len() as u32 - 1;
        self.scene.instances.push(Instance { mesh: mesh.0, node, world_from_object });
        Ok(InstanceHandle(self.scene.instances.len() as u32 - 1))
    }

    /// Adds a light.
    pub fn light(&mut self, light: Light) -> LightHandle {
        self.scene.lights.push(light);
        LightHandle(self.scene.lights.len() as u32 - 1)
    }

    /// Adds a camera; the first is a frame's where none is chosen.
    pub fn camera(&mut self, camera: Camera) {
        self.scene.cameras.push(camera);
    }

    /// Says what surrounds the scene.
    pub fn environment(&mut self, environment: Environment) {
        self.scene.environment = environment;
    }

    /// The scene. Without a camera it gets one that sees all of it.
    pub fn finish(self) -> Scene {
        let mut scene = self.scene;
        if scene.cameras.is_empty() {
            let camera = crate::camera::default_camera(&scene);
            scene.cameras.push(camera);
        }
        scene
    }
}

impl MeshSource<'_> {
    fn check(&self, at: &str) -> Result<(), SceneError> {
        let vertices = self.positions_os.len();
        for (what, count) in [
            ("normals", self.normals_os.len()),
            ("tangents", self.tangents_os.len()),
            ("texture coordinates of set 0", self.uvs[0].len()),
            ("texture coordinates of set 1", self.uvs[1].len()),
            ("colours", self.colors.len()),
        ] {
            if count != 0 && count != vertices {
                return Err(invalid(
                    at,
                    &format!("{count} {what}"),
                    &format!("none or {vertices}, as positions"),
                ));
            }
        }
        let finite = |what: &str, values: &[f32]| match values.iter().all(|value| value.is_finite()) {
            true => Ok(()),
            false => Err(invalid(at, &format!("NaN or infinity among {what}"), "finite numbers")),
        };
        finite("positions", self.positions_os.as_flattened())?;
        finite("normals", self.normals_os.as_flattened())?;
        finite("tangents", self.tangents_os.as_flattened())?;
        finite("texture coordinates", self.uvs[0].as_flattened())?;
        finite("texture coordinates", self.uvs[1].as_flattened())?;
        finite("colours", self.colors.as_flattened())?;
        let corners = if self.indices.is_empty() { vertices } else { self.indices.len() };
        if corners == 0 || !corners.is_multiple_of(3) {
            return Err(invalid(
                at,
                &format!("{corners} corners"),
                "three a triangle, of one triangle or more",
            ));
        }
        match self.indices.iter().find(|index| **index as usize >= vertices) {
            Some(index) => {
                Err(invalid(at, &format!("index {index}"), &format!("one below {vertices}, the vertices")))
            }
            None => Ok(()),
        }
    }
}

fn invalid(at: &str, found: &str, expected: &str) -> SceneError {
    SceneError::invalid(Path::new(NO_FILE), at, found, expected)
}
