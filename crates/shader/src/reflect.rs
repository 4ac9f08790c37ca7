//! Reads from SPIR-V what a shader declares: descriptors that its code uses, interface, constants, memory layouts.
//!
//! Written here rather than taken from a reflection crate because three things are needed that those leave out: access
//! qualifiers of block members, names and offsets of nested structs, and the removal of descriptors that no code uses
//! (a shared header may declare more than a variant needs). Numbers of instructions and decorations are those of the
//! SPIR-V 1.5 specification, section 3.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::{
    Binding, BindingKind, ImageDim, ImageShape, Interface, Reflection, Scalar, Shared, SpecConstant, Text,
};

const MAGIC: u32 = 0x0723_0203;
const HEADER_WORDS: usize = 5;

mod op {
    pub const NAME: u16 = 5;
    pub const MEMBER_NAME: u16 = 6;
    pub const ENTRY_POINT: u16 = 15;
    pub const EXECUTION_MODE: u16 = 16;
    pub const TYPE_BOOL: u16 = 20;
    pub const TYPE_INT: u16 = 21;
    pub const TYPE_FLOAT: u16 = 22;
    pub const TYPE_VECTOR: u16 = 23;
    pub const TYPE_MATRIX: u16 = 24;
    pub const TYPE_IMAGE: u16 = 25;
    pub const TYPE_SAMPLER: u16 = 26;
    pub const TYPE_SAMPLED_IMAGE: u16 = 27;
    pub const TYPE_ARRAY: u16 = 28;
    pub const TYPE_RUNTIME_ARRAY: u16 = 29;
    pub const TYPE_STRUCT: u16 = 30;
    pub const TYPE_POINTER: u16 = 32;
    pub const CONSTANT: u16 = 43;
    pub const SPEC_CONSTANT_TRUE: u16 = 48;
    pub const SPEC_CONSTANT_FALSE: u16 = 49;
    pub const SPEC_CONSTANT: u16 = 50;
    pub const FUNCTION: u16 = 54;
    pub const VARIABLE: u16 = 59;
    pub const DECORATE: u16 = 71;
    pub const MEMBER_DECORATE: u16 = 72;
}

mod decoration {
    pub const SPEC_ID: u32 = 1;
    pub const ROW_MAJOR: u32 = 4;
    pub const ARRAY_STRIDE: u32 = 6;
    pub const MATRIX_STRIDE: u32 = 7;
    pub const BUILT_IN: u32 = 11;
    pub const NON_WRITABLE: u32 = 24;
    pub const NON_READABLE: u32 = 25;
    pub const LOCATION: u32 = 30;
    pub const BINDING: u32 = 33;
    pub const DESCRIPTOR_SET: u32 = 34;
    pub const OFFSET: u32 = 35;
}

mod storage {
    pub const UNIFORM_CONSTANT: u32 = 0;
    pub const INPUT: u32 = 1;
    pub const UNIFORM: u32 = 2;
    pub const OUTPUT: u32 = 3;
    pub const PUSH_CONSTANT: u32 = 9;
    pub const STORAGE_BUFFER: u32 = 12;
}

const EXECUTION_MODE_LOCAL_SIZE: u32 = 17;

/// More locations than any device has: a guard against broken modules.
const MAX_LOCATIONS: usize = 1024;

/// Why SPIR-V could not be read.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum ReflectError {
    /// The words are no SPIR-V module.
    #[error("not SPIR-V: found first word {found:#010x}, expected 0x07230203")]
    Magic {
        /// The first word; 0 where there is none.
        found: u32,
    },
    /// An instruction does not fit into the module.
    #[error("SPIR-V word {word}: found an instruction of {found} words, expected 1 to {expected}")]
    Length {
        /// Index of the instruction's first word.
        word: usize,
        /// Words that it claims.
        found: usize,
        /// Words left in the module.
        expected: usize,
    },
    /// An instruction refers to something that the module does not define, or lacks operands.
    #[error("SPIR-V: {what}")]
    Malformed {
        /// What is missing or wrong.
        what: String,
    },
    /// A descriptor is of a kind that is not supported.
    #[error(
        "binding `{name}` (set {set}, binding {binding}): found {found}, expected a buffer, an image or a sampler"
    )]
    Kind {
        /// The binding's name.
        name: String,
        /// Its descriptor set.
        set: u32,
        /// Its binding.
        binding: u32,
        /// What it is.
        found: String,
    },
}

/// A struct as the compiler laid it out in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct StructInMemory {
    /// Name of the struct or block.
    pub name: String,
    /// Stride of arrays of it, where the module has one.
    pub stride_bytes: Option<u32>,
    /// Its members in order.
    pub members: Vec<MemberInMemory>,
}

/// One member of a [`StructInMemory`].
#[derive(Clone, Debug, PartialEq)]
pub struct MemberInMemory {
    /// Its name.
    pub name: String,
    /// Bytes from the struct's start.
    pub offset_bytes: u32,
    /// Bytes that it takes; none for an array without a length.
    pub size_bytes: Option<u32>,
}

#[derive(Clone, Debug)]
enum Type {
    Scalar { scalar: Scalar, bytes: u32 },
    Vector { component: u32, count: u32 },
    Matrix { column: u32, count: u32 },
    Image { dim: u32, arrayed: bool, multisampled: bool, sampled: u32 },
    Sampler,
    SampledImage { image: u32 },
    Array { element: u32, length: u32 },
    RuntimeArray { element: u32 },
    Struct { members: Vec<u32> },
    Pointer { pointee: u32 },
}

struct Variable {
    id: u32,
    pointer: u32,
    storage: u32,
}

/// A SPIR-V module's declarations, by id.
#[derive(Default)]
struct Module {
    names: HashMap<u32, String>,
    member_names: HashMap<(u32, u32), String>,
    decorations: HashMap<(u32, u32), u32>,
    member_decorations: HashMap<(u32, u32, u32), u32>,
    types: HashMap<u32, Type>,
    constants: HashMap<u32, u32>,
    spec_constants: Vec<(u32, u32, u32)>,
    variables: Vec<Variable>,
    local_size: Option<[u32; 3]>,
    /// Ids that appear in function bodies.
    used: HashSet<u32>,
}

/// Calls `visit` with each instruction's opcode and words (the first holds opcode and length), in order.
fn for_each_instruction(
    words: &[u32],
    mut visit: impl FnMut(usize, u16, &[u32]) -> Result<(), ReflectError>,
) -> Result<(), ReflectError> {
    if words.len() < HEADER_WORDS || words[0] != MAGIC {
        return Err(ReflectError::Magic { found: words.first().copied().unwrap_or(0) });
    }
    let mut at = HEADER_WORDS;
    while at < words.len() {
        let length = (words[at] >> 16) as usize;
        if length == 0 || at + length > words.len() {
            return Err(ReflectError::Length { word: at, found: length, expected: words.len() - at });
        }
        visit(at, (words[at] & 0xffff) as u16, &words[at..at + length])?;
        at += length;
    }
    Ok(())
}

/// Decodes a nul-terminated string and returns it with the number of words that it takes.
fn string(words: &[u32]) -> (String, usize) {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    (String::from_utf8_lossy(&bytes[..end]).into_owned(), end / 4 + 1)
}

fn operand(words: &[u32], index: usize) -> Result<u32, ReflectError> {
    words.get(index).copied().ok_or_else(|| ReflectError::Malformed {
        what: format!("opcode {} has {} words, expected more than {index}", words[0] & 0xffff, words.len()),
    })
}

impl Module {
    fn parse(words: &[u32]) -> Result<Module, ReflectError> {
        let mut module = Module::default();
        let mut in_functions = false;
        for_each_instruction(words, |_, opcode, words| {
            in_functions |= opcode == op::FUNCTION;
            if in_functions {
                // Every operand is taken for an id: a literal that equals an id keeps a descriptor at worst.
                module.used.extend(&words[1..]);
                if opcode != op::VARIABLE {
                    return Ok(());
                }
            }
            module.declaration(opcode, words)
        })?;
        Ok(module)
    }

    fn declaration(&mut self, opcode: u16, words: &[u32]) -> Result<(), ReflectError> {
        let at = |index| operand(words, index);
        match opcode {
            op::NAME => {
                self.names.insert(at(1)?, string(words.get(2..).unwrap_or(&[])).0);
            }
            op::MEMBER_NAME => {
                self.member_names.insert((at(1)?, at(2)?), string(words.get(3..).unwrap_or(&[])).0);
            }
            op::EXECUTION_MODE if at(2)? == EXECUTION_MODE_LOCAL_SIZE => {
                self.local_size = Some([at(3)?, at(4)?, at(5)?]);
            }
            op::DECORATE => {
                self.decorations.insert((at(1)?, at(2)?), words.get(3).copied().unwrap_or(1));
            }
            op::MEMBER_DECORATE => {
                self.member_decorations.insert((at(1)?, at(2)?, at(3)?), words.get(4).copied().unwrap_or(1));
            }
            op::TYPE_BOOL => self.define(at(1)?, Type::Scalar { scalar: Scalar::Bool, bytes: 4 })?,
            op::TYPE_INT => {
                let scalar = if at(3)? == 0 { Scalar::Uint } else { Scalar::Int };
                self.define(at(1)?, Type::Scalar { scalar, bytes: at(2)? / 8 })?;
            }
            op::TYPE_FLOAT => {
                self.define(at(1)?, Type::Scalar { scalar: Scalar::Float, bytes: at(2)? / 8 })?
            }
            op::TYPE_VECTOR => self.define(at(1)?, Type::Vector { component: at(2)?, count: at(3)? })?,
            op::TYPE_MATRIX => self.define(at(1)?, Type::Matrix { column: at(2)?, count: at(3)? })?,
            op::TYPE_IMAGE => self.define(
                at(1)?,
                Type::Image { dim: at(3)?, arrayed: at(5)? != 0, multisampled: at(6)? != 0, sampled: at(7)? },
            )?,
            op::TYPE_SAMPLER => self.define(at(1)?, Type::Sampler)?,
            op::TYPE_SAMPLED_IMAGE => self.define(at(1)?, Type::SampledImage { image: at(2)? })?,
            op::TYPE_ARRAY => self.define(at(1)?, Type::Array { element: at(2)?, length: at(3)? })?,
            op::TYPE_RUNTIME_ARRAY => self.define(at(1)?, Type::RuntimeArray { element: at(2)? })?,
            op::TYPE_STRUCT => {
                self.define(at(1)?, Type::Struct { members: words.get(2..).unwrap_or(&[]).to_vec() })?
            }
            op::TYPE_POINTER => self.define(at(1)?, Type::Pointer { pointee: at(3)? })?,
            op::CONSTANT => {
                self.constants.insert(at(2)?, at(3)?);
            }
            op::SPEC_CONSTANT_TRUE => self.spec_constants.push((at(1)?, at(2)?, 1)),
            op::SPEC_CONSTANT_FALSE => self.spec_constants.push((at(1)?, at(2)?, 0)),
            op::SPEC_CONSTANT => {
                self.constants.insert(at(2)?, at(3)?);
                self.spec_constants.push((at(1)?, at(2)?, at(3)?));
            }
            op::VARIABLE => {
                self.variables.push(Variable { pointer: at(1)?, id: at(2)?, storage: at(3)? });
            }
            _ => {}
        }
        Ok(())
    }

    /// Adds a type; each id is defined once and after what it is made of, so that types have no cycles.
    fn define(&mut self, id: u32, definition: Type) -> Result<(), ReflectError> {
        let parts = match &definition {
            Type::Vector { component: part, .. }
            | Type::Matrix { column: part, .. }
            | Type::SampledImage { image: part }
            | Type::Array { element: part, .. }
            | Type::RuntimeArray { element: part } => std::slice::from_ref(part),
            Type::Struct { members } => members,
            Type::Scalar { .. } | Type::Image { .. } | Type::Sampler | Type::Pointer { .. } => &[],
        };
        if let Some(part) = parts.iter().find(|part| !self.types.contains_key(part)) {
            return Err(ReflectError::Malformed {
                what: format!("type {id} is made of {part}, not defined yet"),
            });
        }
        match self.types.insert(id, definition) {
            None => Ok(()),
            Some(_) => Err(ReflectError::Malformed { what: format!("type {id} is defined twice") }),
        }
    }

    fn type_of(&self, id: u32) -> Result<&Type, ReflectError> {
        self.types
            .get(&id)
            .ok_or_else(|| ReflectError::Malformed { what: format!("type {id} is not defined") })
    }

    fn pointee(&self, variable: &Variable) -> Result<u32, ReflectError> {
        match self.type_of(variable.pointer)? {
            Type::Pointer { pointee } => Ok(*pointee),
            other => Err(ReflectError::Malformed {
                what: format!("variable {} is of type {other:?}, expected a pointer", variable.id),
            }),
        }
    }

    fn decoration(&self, id: u32, decoration: u32) -> Option<u32> {
        self.decorations.get(&(id, decoration)).copied()
    }

    fn member_decoration(&self, id: u32, member: usize, decoration: u32) -> Option<u32> {
        self.member_decorations.get(&(id, member as u32, decoration)).copied()
    }

    fn constant(&self, id: u32) -> Result<u32, ReflectError> {
        self.constants.get(&id).copied().ok_or_else(|| ReflectError::Malformed {
            what: format!("array length {id} is not a plain constant"),
        })
    }

    /// Bytes of a type in memory; none for arrays without a length and opaque types.
    fn size_bytes(
        &self,
        id: u32,
        matrix_stride: Option<u32>,
        row_major: bool,
    ) -> Result<Option<u32>, ReflectError> {
        Ok(match self.type_of(id)? {
            Type::Scalar { bytes, .. } => Some(*bytes),
            Type::Vector { component, count } => {
                self.size_bytes(*component, None, false)?.map(|bytes| bytes.saturating_mul(*count))
            }
            Type::Matrix { column, count } => {
                let rows = match self.type_of(*column)? {
                    Type::Vector { count, .. } => *count,
                    _ => 1,
                };
                let stride = matrix_stride.unwrap_or(0);
                Some(stride.saturating_mul(if row_major { rows } else { *count }))
            }
            Type::Array { element, length } => {
                let length = self.constant(*length)?;
                match self.decoration(id, decoration::ARRAY_STRIDE) {
                    Some(stride) => Some(stride.saturating_mul(length)),
                    None => self
                        .size_bytes(*element, matrix_stride, row_major)?
                        .map(|bytes| bytes.saturating_mul(length)),
                }
            }
            Type::Struct { members } => {
                let mut end = 0;
                for (index, _) in members.iter().enumerate() {
                    let (offset, size) = self.member_extent(id, members, index)?;
                    let Some(size) = size else { return Ok(None) };
                    end = end.max(offset.saturating_add(size));
                }
                Some(end)
            }
            Type::RuntimeArray { .. }
            | Type::Image { .. }
            | Type::Sampler
            | Type::SampledImage { .. }
            | Type::Pointer { .. } => None,
        })
    }

    /// Offset and size in bytes of a struct's member.
    fn member_extent(
        &self,
        id: u32,
        members: &[u32],
        index: usize,
    ) -> Result<(u32, Option<u32>), ReflectError> {
        let offset = self.member_decoration(id, index, decoration::OFFSET).unwrap_or(0);
        let stride = self.member_decoration(id, index, decoration::MATRIX_STRIDE);
        let row_major = self.member_decoration(id, index, decoration::ROW_MAJOR).is_some();
        Ok((offset, self.size_bytes(members[index], stride, row_major)?))
    }

    fn name(&self, id: u32) -> &str {
        self.names.get(&id).map_or("", String::as_str)
    }

    /// The variable's name, or that of its block.
    fn variable_name(&self, variable: &Variable, pointee: u32) -> Text {
        let name = self.name(variable.id);
        if !name.is_empty() {
            return name.into();
        }
        let mut block = pointee;
        while let Some(Type::Array { element, .. } | Type::RuntimeArray { element }) = self.types.get(&block)
        {
            block = *element;
        }
        self.name(block).into()
    }

    /// Whether every member of a block, or the variable itself, carries the decoration.
    fn all_decorated(&self, variable: u32, block: u32, decoration: u32) -> bool {
        if self.decoration(variable, decoration).is_some() {
            return true;
        }
        match self.types.get(&block) {
            Some(Type::Struct { members }) => {
                !members.is_empty()
                    && (0..members.len())
                        .all(|index| self.member_decoration(block, index, decoration).is_some())
            }
            _ => false,
        }
    }

    fn binding(&self, variable: &Variable) -> Result<Binding, ReflectError> {
        let pointee = self.pointee(variable)?;
        let name = self.variable_name(variable, pointee);
        let set = self.decoration(variable.id, decoration::DESCRIPTOR_SET).unwrap_or(0);
        let binding = self.decoration(variable.id, decoration::BINDING).unwrap_or(0);
        let (element, count) = match self.type_of(pointee)? {
            Type::Array { element, length } => (*element, self.constant(*length)?),
            Type::RuntimeArray { element } => (*element, 0),
            _ => (pointee, 1),
        };
        let (kind, image) = match (self.type_of(element)?, variable.storage) {
            (Type::Struct { .. }, storage::UNIFORM) => (BindingKind::UniformBuffer, None),
            (Type::Struct { .. }, storage::STORAGE_BUFFER) => (BindingKind::StorageBuffer, None),
            (Type::Sampler, _) => (BindingKind::Sampler, None),
            (Type::SampledImage { image }, _) => {
                (BindingKind::CombinedImageSampler, self.image_shape(*image)?)
            }
            (Type::Image { sampled: 1, .. }, _) => (BindingKind::SampledImage, self.image_shape(element)?),
            (Type::Image { sampled: 2, .. }, _) => (BindingKind::StorageImage, self.image_shape(element)?),
            (other, _) => {
                return Err(ReflectError::Kind {
                    name: name.to_string(),
                    set,
                    binding,
                    found: format!("{other:?}"),
                });
            }
        };
        let storage_kind = matches!(kind, BindingKind::StorageBuffer | BindingKind::StorageImage);
        Ok(Binding {
            set,
            binding,
            name,
            kind,
            count,
            readable: !self.all_decorated(variable.id, element, decoration::NON_READABLE),
            writable: storage_kind && !self.all_decorated(variable.id, element, decoration::NON_WRITABLE),
            image,
        })
    }

    fn image_shape(&self, id: u32) -> Result<Option<ImageShape>, ReflectError> {
        let Type::Image { dim, arrayed, multisampled, .. } = *self.type_of(id)? else { return Ok(None) };
        let dim = match dim {
            0 => ImageDim::D1,
            1 => ImageDim::D2,
            2 => ImageDim::D3,
            3 => ImageDim::Cube,
            5 => ImageDim::Buffer,
            other => {
                return Err(ReflectError::Malformed {
                    what: format!("image type {id} has dimension {other}"),
                });
            }
        };
        Ok(Some(ImageShape { dim, arrayed, multisampled }))
    }

    /// The locations that a variable of the interface takes; none for built-ins.
    fn interface(&self, variable: &Variable) -> Result<Vec<Interface>, ReflectError> {
        let pointee = self.pointee(variable)?;
        let name = self.variable_name(variable, pointee);
        if self.decoration(variable.id, decoration::BUILT_IN).is_some() {
            return Ok(Vec::new());
        }
        let mut list = Vec::new();
        if let Some(location) = self.decoration(variable.id, decoration::LOCATION) {
            self.locations(pointee, location, &name, &mut list)?;
        } else if let Type::Struct { members } = self.type_of(pointee)? {
            for (index, member) in members.iter().enumerate() {
                if let Some(location) = self.member_decoration(pointee, index, decoration::LOCATION) {
                    let name =
                        self.member_names.get(&(pointee, index as u32)).map_or("", String::as_str).into();
                    self.locations(*member, location, &name, &mut list)?;
                }
            }
        }
        Ok(list)
    }

    /// Appends the locations from `location` on that a value of type `id` takes, and returns the next free one.
    fn locations(
        &self,
        id: u32,
        location: u32,
        name: &Text,
        list: &mut Vec<Interface>,
    ) -> Result<u32, ReflectError> {
        if list.len() > MAX_LOCATIONS {
            return Err(ReflectError::Malformed {
                what: format!("`{name}` takes more than {MAX_LOCATIONS} locations"),
            });
        }
        match self.type_of(id)? {
            Type::Scalar { scalar, .. } => {
                list.push(Interface { location, name: name.clone(), components: 1, scalar: *scalar });
                Ok(location.saturating_add(1))
            }
            Type::Vector { component, count } => {
                let scalar = match self.type_of(*component)? {
                    Type::Scalar { scalar, .. } => *scalar,
                    _ => Scalar::Float,
                };
                list.push(Interface { location, name: name.clone(), components: *count, scalar });
                Ok(location.saturating_add(1))
            }
            Type::Matrix { column, count } => (0..(*count).min(4))
                .try_fold(location, |location, _| self.locations(*column, location, name, list)),
            Type::Array { element, length } => (0..self.constant(*length)?.min(MAX_LOCATIONS as u32))
                .try_fold(location, |location, _| self.locations(*element, location, name, list)),
            Type::Struct { members } => members
                .iter()
                .try_fold(location, |location, member| self.locations(*member, location, name, list)),
            _ => Ok(location),
        }
    }

    fn spec_constants(&self) -> Result<Vec<SpecConstant>, ReflectError> {
        let mut list = Vec::new();
        for (kind, id, default_bits) in &self.spec_constants {
            // Parts of a work-group size may be constants without an id of their own.
            let Some(spec_id) = self.decoration(*id, decoration::SPEC_ID) else { continue };
            let scalar = match self.type_of(*kind)? {
                Type::Scalar { scalar, .. } => *scalar,
                _ => Scalar::Uint,
            };
            list.push(SpecConstant {
                id: spec_id,
                name: self.name(*id).into(),
                scalar,
                default_bits: *default_bits,
            });
        }
        list.sort_by_key(|constant| constant.id);
        Ok(list)
    }

    fn is_used(&self, variable: &Variable) -> bool {
        self.used.contains(&variable.id)
    }
}

/// Whether a storage class holds descriptors or push constants.
fn is_resource(class: u32) -> bool {
    matches!(
        class,
        storage::UNIFORM_CONSTANT | storage::UNIFORM | storage::STORAGE_BUFFER | storage::PUSH_CONSTANT
    )
}

/// Returns what the module declares; descriptors and push constants that no function mentions are left out.
///
/// # Errors
/// [`ReflectError`] where the words are no SPIR-V module, or a descriptor is of an unsupported kind.
pub fn reflect(words: &[u32]) -> Result<Reflection, ReflectError> {
    let module = Module::parse(words)?;
    let mut bindings = Vec::new();
    let mut push_constant_bytes = 0;
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    for variable in &module.variables {
        match variable.storage {
            storage::PUSH_CONSTANT if module.is_used(variable) => {
                let pointee = module.pointee(variable)?;
                push_constant_bytes = module.size_bytes(pointee, None, false)?.unwrap_or(0);
            }
            storage::INPUT => inputs.extend(module.interface(variable)?),
            storage::OUTPUT => outputs.extend(module.interface(variable)?),
            class if is_resource(class) && module.is_used(variable) => {
                bindings.push(module.binding(variable)?);
            }
            _ => {}
        }
    }
    bindings.sort_by_key(|binding| (binding.set, binding.binding));
    inputs.sort_by_key(|interface| interface.location);
    outputs.sort_by_key(|interface| interface.location);
    Ok(Reflection {
        bindings: bindings.into(),
        push_constant_bytes,
        local_size: module.local_size.unwrap_or([1, 1, 1]),
        spec_constants: Shared::from(module.spec_constants()?),
        inputs: inputs.into(),
        outputs: outputs.into(),
    })
}

/// Returns every named struct and block of the module that has a place in memory (its members have offsets).
///
/// # Errors
/// [`ReflectError`] where the words are no SPIR-V module.
pub fn structs_in_memory(words: &[u32]) -> Result<Vec<StructInMemory>, ReflectError> {
    let module = Module::parse(words)?;
    let mut strides = BTreeMap::new();
    for (id, definition) in &module.types {
        if let Type::Array { element, .. } | Type::RuntimeArray { element } = definition
            && let Some(stride) = module.decoration(*id, decoration::ARRAY_STRIDE)
        {
            strides.insert(*element, stride);
        }
    }
    let mut found = BTreeMap::new();
    for (id, definition) in &module.types {
        let Type::Struct { members } = definition else { continue };
        if members.is_empty() || module.member_decoration(*id, 0, decoration::OFFSET).is_none() {
            continue;
        }
        let mut list = Vec::new();
        for index in 0..members.len() {
            let (offset_bytes, size_bytes) = module.member_extent(*id, members, index)?;
            let name = module.member_names.get(&(*id, index as u32)).cloned().unwrap_or_default();
            list.push(MemberInMemory { name, offset_bytes, size_bytes });
        }
        found.insert(
            *id,
            StructInMemory {
                name: module.name(*id).to_owned(),
                stride_bytes: strides.get(id).copied(),
                members: list,
            },
        );
    }
    Ok(found.into_values().collect())
}

/// Removes descriptors and push constants that no function mentions, so that a pipeline layout made from [`reflect`]
/// covers everything that the module declares.
///
/// # Errors
/// [`ReflectError`] where the words are no SPIR-V module.
pub fn strip_unused(words: &[u32]) -> Result<Vec<u32>, ReflectError> {
    let module = Module::parse(words)?;
    let unused: HashSet<u32> = module
        .variables
        .iter()
        .filter(|variable| is_resource(variable.storage) && !module.is_used(variable))
        .map(|variable| variable.id)
        .collect();
    let mut kept = words[..HEADER_WORDS].to_vec();
    for_each_instruction(words, |_, opcode, words| {
        match opcode {
            op::NAME | op::DECORATE if unused.contains(&operand(words, 1)?) => {}
            op::VARIABLE if unused.contains(&operand(words, 2)?) => {}
            op::ENTRY_POINT => {
                let name_words = string(words.get(3..).unwrap_or(&[])).1;
                let interface = (3 + name_words).min(words.len());
                let mut entry = words[..interface].to_vec();
                entry.extend(words[interface..].iter().filter(|id| !unused.contains(id)));
                entry[0] = (entry.len() as u32) << 16 | u32::from(op::ENTRY_POINT);
                kept.extend(entry);
            }
            _ => kept.extend(words),
        }
        Ok(())
    })?;
    Ok(kept)
}
