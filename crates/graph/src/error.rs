//! What can go wrong between the declaration of a frame and its execution.

use afterlight_gpu::GpuError;

/// An error of the frame graph: names the pass, the slot or the resource, what was found, what is expected.
#[derive(Debug, thiserror::Error)]
pub enum GraphError {
    /// A shader has a binding for which the pass names no resource.
    #[error("pass {pass}: shader {shader} needs a {expected} in slot {slot:?}; the pass binds {bound}")]
    MissingSlot {
        /// Pass that lacks the resource.
        pass: String,
        /// Shader whose binding is left open.
        shader: String,
        /// The binding's name in the shader.
        slot: String,
        /// What the shader expects there.
        expected: &'static str,
        /// The slots that the pass does bind, comma separated.
        bound: String,
    },
    /// Two resources were given to one slot of a pass.
    #[error(
        "pass {pass}: slot {slot:?} is bound twice: to {first:?} and to {second:?}; expected one resource"
    )]
    DoublyBound {
        /// The pass.
        pass: String,
        /// The slot's name.
        slot: String,
        /// Resource bound first.
        first: String,
        /// Resource bound second.
        second: String,
    },
    /// The resource in a slot is of another kind than the shader's binding.
    #[error("pass {pass}: slot {slot:?} of shader {shader}: found {found}, expected {expected}")]
    WrongKind {
        /// The pass.
        pass: String,
        /// The slot's name.
        slot: String,
        /// The shader.
        shader: String,
        /// What the pass binds.
        found: String,
        /// What the shader's binding takes.
        expected: String,
    },
    /// A pass writes through a binding that the shader declares `readonly`, or reads one declared `writeonly`.
    #[error("pass {pass}: slot {slot:?} of shader {shader}: found a {found}, expected a {expected}")]
    WrongDirection {
        /// The pass.
        pass: String,
        /// The slot's name.
        slot: String,
        /// The shader.
        shader: String,
        /// `read` or `write`, as the pass declares.
        found: &'static str,
        /// What the shader's qualifiers allow.
        expected: &'static str,
    },
    /// A pass declares a write that none of its shaders can make.
    #[error("pass {pass}: writes slot {slot:?}, found in no shader of the pass; expected one of: {known}")]
    UnknownSlot {
        /// The pass.
        pass: String,
        /// The slot's name.
        slot: String,
        /// The slots of the pass's shaders.
        known: String,
    },
    /// A constant that the pass sets exists in none of its shaders.
    #[error("pass {pass}: sets the constant {constant:?}, found in no shader; expected one of: {known}")]
    UnknownConstant {
        /// The pass.
        pass: String,
        /// Name of the specialization constant.
        constant: String,
        /// The constants that exist.
        known: String,
    },
    /// The push constants given are not of the size that the shaders declare.
    #[error("pass {pass}: found {found} bytes of push constants, expected {expected} (shader {shader})")]
    PushBytes {
        /// The pass.
        pass: String,
        /// The shader.
        shader: String,
        /// Bytes given.
        found: u32,
        /// Bytes that the shaders declare.
        expected: u32,
    },
    /// A shader was given where another stage is expected.
    #[error("pass {pass}: shader {shader} is of stage {found}, expected {expected}")]
    WrongStage {
        /// The pass.
        pass: String,
        /// The shader.
        shader: String,
        /// The shader's stage.
        found: String,
        /// The stage that the pass needs.
        expected: &'static str,
    },
    /// A raster pass's attachments and its pipeline do not fit each other.
    #[error("pass {pass}: {what}: found {found}, expected {expected}")]
    Attachment {
        /// The pass.
        pass: String,
        /// What does not fit.
        what: &'static str,
        /// What was declared.
        found: String,
        /// What would fit.
        expected: String,
    },
    /// Vertex attributes of the state and inputs of the vertex shader differ.
    #[error(
        "pass {pass}: shader {shader} reads input {input:?} at location {location}, found no attribute there"
    )]
    MissingAttribute {
        /// The pass.
        pass: String,
        /// The vertex shader.
        shader: String,
        /// The input's name.
        input: String,
        /// Its location.
        location: u32,
    },
    /// A resource is read before anything wrote it.
    #[error(
        "pass {pass}: reads {resource:?} before any pass has written it; expected a write or a clear first"
    )]
    ReadBeforeWrite {
        /// The pass.
        pass: String,
        /// The resource.
        resource: String,
    },
    /// A pass writes what the frame before wrote.
    #[error("pass {pass}: writes {resource:?}, which is what the frame before wrote; expected reads alone")]
    WritesBefore {
        /// The pass.
        pass: String,
        /// The resource.
        resource: String,
    },
    /// A pass reads of the frame before what no frame writes.
    #[error("pass {pass}: reads {resource:?}, found no pass that writes that part of {now:?}; expected one")]
    NeverWritten {
        /// The pass.
        pass: String,
        /// What it reads.
        resource: String,
        /// The version that a pass should write.
        now: String,
    },
    /// One pass uses one part of a resource in two ways that exclude each other.
    #[error("pass {pass}: uses {resource:?} as {first} and as {second} at once; expected one of them")]
    Conflict {
        /// The pass.
        pass: String,
        /// The resource.
        resource: String,
        /// One use.
        first: String,
        /// The other.
        second: String,
    },
    /// A range of mip levels or layers lies outside its image, or is not one that the shader can see.
    #[error("pass {pass}: range of {resource:?}: found {found}, expected {expected}")]
    Range {
        /// The pass.
        pass: String,
        /// The image.
        resource: String,
        /// The range asked for.
        found: String,
        /// What the image has, or the shader takes.
        expected: String,
    },
    /// A handle of another graph was used.
    #[error("pass {pass}: the handle of {found:?} belongs to another graph, expected one of this graph")]
    ForeignHandle {
        /// The pass (or the verb) that used it.
        pass: String,
        /// The name that the handle carries.
        found: String,
    },
    /// Two resources carry the same name.
    #[error("resource {name:?} is declared twice; expected a name of its own for each resource")]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// An image or a buffer of size zero, or an unusable format, was declared.
    #[error("resource {name:?}: {what}: found {found}, expected {expected}")]
    BadResource {
        /// The resource.
        name: String,
        /// The property.
        what: &'static str,
        /// What was declared.
        found: String,
        /// What is allowed.
        expected: String,
    },
    /// A read back asks for a resource that the plan does not hold, or did not keep.
    #[error("cannot read back {name:?}: {found}; expected one of the kept resources: {expected}")]
    NotReadable {
        /// The name asked for.
        name: String,
        /// Why it cannot be read.
        found: &'static str,
        /// The kept resources.
        expected: String,
    },
    /// A dispatch of more workgroups along an axis than the device takes.
    #[error("pass {pass}: found a dispatch of {found:?} workgroups, expected at most {limit:?}")]
    Groups {
        /// The pass.
        pass: String,
        /// What was declared.
        found: [u32; 3],
        /// The device's limit.
        limit: [u32; 3],
    },
    /// A device error.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}
