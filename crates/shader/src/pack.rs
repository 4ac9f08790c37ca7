//! Compiled shaders as bytes: what a build script writes and a program carries. Generated Rust for the same data would
//! cost a compiler a minute where there are hundreds of shaders; these bytes cost it nothing.
//!
//! Numbers are little-endian `u32`; a list is its length and its elements; a text is a list of bytes.

use crate::{
    Binding, BindingKind, ImageDim, ImageShape, Interface, Reflection, Scalar, Shader, Shared, SpecConstant,
    Stage, Text,
};

const STAGES: &[Stage] = &[
    Stage::Vertex,
    Stage::TessControl,
    Stage::TessEvaluation,
    Stage::Geometry,
    Stage::Fragment,
    Stage::Compute,
];
const KINDS: &[BindingKind] = &[
    BindingKind::UniformBuffer,
    BindingKind::StorageBuffer,
    BindingKind::SampledImage,
    BindingKind::CombinedImageSampler,
    BindingKind::StorageImage,
    BindingKind::Sampler,
];
const DIMS: &[ImageDim] = &[ImageDim::D1, ImageDim::D2, ImageDim::D3, ImageDim::Cube, ImageDim::Buffer];
const SCALARS: &[Scalar] = &[Scalar::Float, Scalar::Int, Scalar::Uint, Scalar::Bool];

/// Bytes that are no list of shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnpackError {
    /// They end too early.
    #[error("found the end at byte {at}, expected {wanted} more bytes of packed shaders")]
    End {
        /// Where, from 0.
        at: usize,
        /// How many bytes are missing at least.
        wanted: usize,
    },
    /// A number stands for none of the values that there are.
    #[error("found {found} before byte {at}, expected a {what}")]
    Value {
        /// Where its four bytes end.
        at: usize,
        /// The number.
        found: u32,
        /// What it should stand for.
        what: &'static str,
    },
    /// A name is no text.
    #[error("found a name before byte {at} that is not UTF-8, expected text")]
    Text {
        /// Where it ends.
        at: usize,
    },
    /// More bytes follow the last shader.
    #[error("found {left} bytes after the packed shaders, expected the end")]
    Rest {
        /// How many.
        left: usize,
    },
}

/// Reads shaders; their names stay where they are in `bytes`.
///
/// # Errors
/// [`UnpackError`] where [`pack`] did not write the bytes.
pub fn unpack(bytes: &'static [u8]) -> Result<Vec<Shader>, UnpackError> {
    let mut reader = Reader { bytes, at: 0, text: Text::Static };
    let shaders = reader.list(Reader::shader)?;
    reader.end()?;
    Ok(shaders)
}

/// Reads shaders from bytes of any lifetime.
///
/// # Errors
/// As [`unpack`].
pub fn unpack_owned(bytes: &[u8]) -> Result<Vec<Shader>, UnpackError> {
    let mut reader = Reader { bytes, at: 0, text: |text: &str| Text::from(text) };
    let shaders = reader.list(Reader::shader)?;
    reader.end()?;
    Ok(shaders)
}

/// Writes shaders.
pub fn pack(shaders: &[&Shader]) -> Vec<u8> {
    let mut writer = Writer::default();
    writer.list(shaders, |writer, shader| writer.shader(shader));
    writer.bytes
}

#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    fn number(&mut self, number: u32) {
        self.bytes.extend(number.to_le_bytes());
    }

    fn list<T>(&mut self, list: &[T], each: impl Fn(&mut Writer, &T)) {
        self.number(list.len() as u32);
        for element in list {
            each(self, element);
        }
    }

    fn text(&mut self, text: &str) {
        self.number(text.len() as u32);
        self.bytes.extend(text.as_bytes());
    }

    /// Writes a value as its place in the list of all values.
    fn value<T: PartialEq>(&mut self, all: &[T], value: &T) {
        self.number(all.iter().position(|one| one == value).unwrap_or(all.len()) as u32);
    }

    fn shader(&mut self, shader: &Shader) {
        let reflection = &shader.reflection;
        self.text(&shader.name);
        self.value(STAGES, &shader.stage);
        self.list(&shader.spirv, |writer, word| writer.number(*word));
        self.list(&reflection.bindings, Writer::binding);
        self.number(reflection.push_constant_bytes);
        for size in reflection.local_size {
            self.number(size);
        }
        self.list(&reflection.spec_constants, |writer, constant| {
            writer.number(constant.id);
            writer.text(&constant.name);
            writer.value(SCALARS, &constant.scalar);
            writer.number(constant.default_bits);
        });
        self.list(&reflection.inputs, Writer::interface);
        self.list(&reflection.outputs, Writer::interface);
    }

    fn binding(&mut self, binding: &Binding) {
        self.number(binding.set);
        self.number(binding.binding);
        self.text(&binding.name);
        self.value(KINDS, &binding.kind);
        self.number(binding.count);
        self.number(binding.readable.into());
        self.number(binding.writable.into());
        self.list(binding.image.as_slice(), |writer, shape| {
            writer.value(DIMS, &shape.dim);
            writer.number(shape.arrayed.into());
            writer.number(shape.multisampled.into());
        });
    }

    fn interface(&mut self, interface: &Interface) {
        self.number(interface.location);
        self.text(&interface.name);
        self.number(interface.components);
        self.value(SCALARS, &interface.scalar);
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Makes a name of a part of `bytes`.
    text: fn(&'a str) -> Text,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], UnpackError> {
        let rest = &self.bytes[self.at..];
        let end = || UnpackError::End { at: self.bytes.len(), wanted: count - rest.len() };
        let taken = rest.get(..count).ok_or_else(end)?;
        self.at += count;
        Ok(taken)
    }

    fn end(&self) -> Result<(), UnpackError> {
        match self.bytes.len() - self.at {
            0 => Ok(()),
            left => Err(UnpackError::Rest { left }),
        }
    }

    fn number(&mut self) -> Result<u32, UnpackError> {
        let bytes = self.take(4)?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    fn flag(&mut self) -> Result<bool, UnpackError> {
        self.value(&[false, true], "flag")
    }

    fn value<T: Copy>(&mut self, all: &[T], what: &'static str) -> Result<T, UnpackError> {
        let found = self.number()?;
        all.get(found as usize).copied().ok_or(UnpackError::Value { at: self.at, found, what })
    }

    fn list<T>(
        &mut self,
        mut each: impl FnMut(&mut Reader<'a>) -> Result<T, UnpackError>,
    ) -> Result<Vec<T>, UnpackError> {
        // No room is made ahead: a broken length must not ask for all memory.
        let count = self.number()?;
        (0..count).map(|_| each(self)).collect()
    }

    fn name(&mut self) -> Result<Text, UnpackError> {
        let count = self.number()? as usize;
        let bytes = self.take(count)?;
        let text = std::str::from_utf8(bytes).map_err(|_| UnpackError::Text { at: self.at })?;
        Ok((self.text)(text))
    }

    fn words(&mut self) -> Result<Shared<u32>, UnpackError> {
        let count = self.number()? as usize;
        Ok(crate::words_of(self.take(count.saturating_mul(4))?))
    }

    fn shader(&mut self) -> Result<Shader, UnpackError> {
        Ok(Shader {
            name: self.name()?,
            stage: self.value(STAGES, "stage")?,
            spirv: self.words()?,
            reflection: Reflection {
                bindings: self.list(Reader::binding)?.into(),
                push_constant_bytes: self.number()?,
                local_size: [self.number()?, self.number()?, self.number()?],
                spec_constants: self.list(Reader::spec_constant)?.into(),
                inputs: self.list(Reader::interface)?.into(),
                outputs: self.list(Reader::interface)?.into(),
            },
        })
    }

    fn binding(&mut self) -> Result<Binding, UnpackError> {
        Ok(Binding {
            set: self.number()?,
            binding: self.number()?,
            name: self.name()?,
            kind: self.value(KINDS, "kind of descriptor")?,
            count: self.number()?,
            readable: self.flag()?,
            writable: self.flag()?,
            image: self.list(Reader::image)?.pop(),
        })
    }

    fn image(&mut self) -> Result<ImageShape, UnpackError> {
        Ok(ImageShape {
            dim: self.value(DIMS, "dimension of an image")?,
            arrayed: self.flag()?,
            multisampled: self.flag()?,
        })
    }

    fn spec_constant(&mut self) -> Result<SpecConstant, UnpackError> {
        Ok(SpecConstant {
            id: self.number()?,
            name: self.name()?,
            scalar: self.value(SCALARS, "type of a number")?,
            default_bits: self.number()?,
        })
    }

    fn interface(&mut self) -> Result<Interface, UnpackError> {
        Ok(Interface {
            location: self.number()?,
            name: self.name()?,
            components: self.number()?,
            scalar: self.value(SCALARS, "type of a number")?,
        })
    }
}
