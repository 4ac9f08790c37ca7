//! GLSL to SPIR-V, reflection, structs shared with shaders.
//!
//! A [`Shader`] is one compiled variant of one GLSL file with what its SPIR-V declares ([`Reflection`]). Build scripts
//! compile whole folders with `build::Builder`; `reload::Reloader` compiles them again when a file changes (both need the
//! feature `compile`). Structs that a shader reads from memory are declared once, in Rust, by [`shader_struct!`]: the
//! build compares every GLSL struct of the same name against the Rust layout and fails on a difference.

#[cfg(feature = "compile")]
pub mod build;
#[cfg(feature = "compile")]
mod cache;
#[cfg(feature = "compile")]
pub mod compile;
mod include;
pub mod layout;
#[cfg(feature = "compile")]
mod lookup;
#[cfg(feature = "compile")]
pub mod manifest;
pub mod pack;
pub mod reflect;
#[cfg(feature = "compile")]
pub mod reload;
pub mod structs;

pub use include::INCLUDES;
pub use layout::{FieldLayout, StructLayout};

#[doc(hidden)]
pub use bytemuck;

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

/// A list that is either part of the program or shared at run time; cloning never copies its elements.
#[derive(Clone)]
pub enum Shared<T: 'static> {
    /// Part of the program's data.
    Static(&'static [T]),
    /// Made at run time.
    Owned(Arc<[T]>),
}

impl<T> Deref for Shared<T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        match self {
            Shared::Static(list) => list,
            Shared::Owned(list) => list,
        }
    }
}

impl<T> From<Vec<T>> for Shared<T> {
    fn from(list: Vec<T>) -> Self {
        Shared::Owned(list.into())
    }
}

impl<T: PartialEq> PartialEq for Shared<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: fmt::Debug> fmt::Debug for Shared<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl<'a, T> IntoIterator for &'a Shared<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// A name that is either part of the program or shared at run time; cloning never copies its characters.
#[derive(Clone)]
pub enum Text {
    /// Part of the program's data.
    Static(&'static str),
    /// Made at run time.
    Owned(Arc<str>),
}

impl Text {
    /// Returns the characters.
    pub fn as_str(&self) -> &str {
        self
    }
}

impl Deref for Text {
    type Target = str;
    fn deref(&self) -> &str {
        match self {
            Text::Static(text) => text,
            Text::Owned(text) => text,
        }
    }
}

impl From<&str> for Text {
    fn from(text: &str) -> Self {
        Text::Owned(text.into())
    }
}

impl From<String> for Text {
    fn from(text: String) -> Self {
        Text::Owned(text.into())
    }
}

impl PartialEq for Text {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl PartialEq<str> for Text {
    fn eq(&self, other: &str) -> bool {
        **self == *other
    }
}

impl PartialEq<&str> for Text {
    fn eq(&self, other: &&str) -> bool {
        **self == **other
    }
}

impl fmt::Debug for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&**self, f)
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&**self, f)
    }
}

/// A stage of the pipeline that a shader runs in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// `.vert`
    Vertex,
    /// `.tesc`
    TessControl,
    /// `.tese`
    TessEvaluation,
    /// `.geom`
    Geometry,
    /// `.frag`
    Fragment,
    /// `.comp`
    Compute,
}

/// What a descriptor is to the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BindingKind {
    /// `uniform` block.
    UniformBuffer,
    /// `buffer` block.
    StorageBuffer,
    /// `texture*`, read by `texelFetch` or with a separate sampler.
    SampledImage,
    /// `sampler*`: an image with its sampler.
    CombinedImageSampler,
    /// `image*`, read and written by texel.
    StorageImage,
    /// `sampler` alone.
    Sampler,
}

/// The dimensions that an image type of GLSL addresses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageDim {
    /// `*1D`
    D1,
    /// `*2D`
    D2,
    /// `*3D`
    D3,
    /// `*Cube`
    Cube,
    /// `*Buffer`
    Buffer,
}

/// The shape that an image's view must have to be bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageShape {
    /// Its dimensions.
    pub dim: ImageDim,
    /// Whether it has layers (`*Array`).
    pub arrayed: bool,
    /// Whether it has samples (`*MS`).
    pub multisampled: bool,
}

/// A descriptor that the shader's code uses.
#[derive(Clone, Debug, PartialEq)]
pub struct Binding {
    /// Descriptor set.
    pub set: u32,
    /// Binding within the set.
    pub binding: u32,
    /// The instance's name, or the block's where the instance has none.
    pub name: Text,
    /// What it is.
    pub kind: BindingKind,
    /// Number of array elements; 1 for what is no array.
    pub count: u32,
    /// Whether the declaration lets the shader read it (not `writeonly`).
    pub readable: bool,
    /// Whether the declaration lets the shader write it (storage kinds that are not `readonly`).
    pub writable: bool,
    /// The shape of an image; none for buffers and samplers.
    pub image: Option<ImageShape>,
}

/// The type of a scalar, or of a vector's components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scalar {
    /// `float` and its narrower and wider kin.
    Float,
    /// Signed integers.
    Int,
    /// Unsigned integers.
    Uint,
    /// `bool` (specialization constants alone).
    Bool,
}

/// A specialization constant.
#[derive(Clone, Debug, PartialEq)]
pub struct SpecConstant {
    /// `constant_id`.
    pub id: u32,
    /// Its name in GLSL.
    pub name: Text,
    /// Its type.
    pub scalar: Scalar,
    /// The bits of its default; a `bool` is 0 or 1.
    pub default_bits: u32,
}

/// One location of a stage's inputs or outputs; a matrix takes one a column.
#[derive(Clone, Debug, PartialEq)]
pub struct Interface {
    /// `location`.
    pub location: u32,
    /// Its name in GLSL.
    pub name: Text,
    /// Components, 1 to 4.
    pub components: u32,
    /// Type of the components.
    pub scalar: Scalar,
}

/// What a shader declares, as read from its SPIR-V.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflection {
    /// Descriptors that the code uses, by set and binding.
    pub bindings: Shared<Binding>,
    /// Bytes of the push-constant block from offset 0 to its end; 0 without one.
    pub push_constant_bytes: u32,
    /// Work-group size of a compute shader (defaults of specialization constants); `[1, 1, 1]` otherwise.
    pub local_size: [u32; 3],
    /// Specialization constants by id.
    pub spec_constants: Shared<SpecConstant>,
    /// Stage inputs by location, without built-ins.
    pub inputs: Shared<Interface>,
    /// Stage outputs by location, without built-ins.
    pub outputs: Shared<Interface>,
}

impl Reflection {
    /// Returns the binding of that name.
    pub fn binding(&self, name: &str) -> Option<&Binding> {
        self.bindings.iter().find(|binding| binding.name == *name)
    }

    /// Returns the specialization constant of that name.
    pub fn spec_constant(&self, name: &str) -> Option<&SpecConstant> {
        self.spec_constants.iter().find(|constant| constant.name == *name)
    }
}

/// Decodes little-endian SPIR-V words; bytes past the last whole word are left out.
pub fn words_of(bytes: &[u8]) -> Shared<u32> {
    bytes
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
        .collect::<Vec<_>>()
        .into()
}

/// One compiled variant of a shader file.
#[derive(Clone, Debug, PartialEq)]
pub struct Shader {
    /// Folder, file and, after `#`, the variant's tag: `tiled/shade.comp`, `forward/surface.frag#mask`.
    pub name: Text,
    /// The stage it runs in; its entry point is `main`.
    pub stage: Stage,
    /// SPIR-V 1.5 for Vulkan 1.3.
    pub spirv: Shared<u32>,
    /// What it declares.
    pub reflection: Reflection,
}
