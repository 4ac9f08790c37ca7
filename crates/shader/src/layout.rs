//! Layouts of structs that Rust writes and shaders read.

/// Where one field of a struct lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldLayout {
    /// Name, the same in Rust and GLSL.
    pub name: &'static str,
    /// Bytes from the struct's start.
    pub offset_bytes: usize,
    /// Bytes of the field itself.
    pub size_bytes: usize,
}

/// The memory layout of a struct declared by [`shader_struct!`](crate::shader_struct).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StructLayout {
    /// Name, the same in Rust and GLSL.
    pub name: &'static str,
    /// Bytes of one element; the array stride in a shader must equal it.
    pub size_bytes: usize,
    /// Fields in order. Names that start with `_` are padding: GLSL may leave them out.
    pub fields: &'static [FieldLayout],
}

/// Defines `#[repr(C)]` structs that are plain bytes (`bytemuck::Pod`) and know their `LAYOUT`.
///
/// Matrices are `[[f32; 4]; 4]` (columns), vectors `[f32; N]`, scalars `f32`, `u32`, `i32`; arrays and other such structs
/// nest. Padding is spelled out as fields whose names start with `_`. The GLSL side is a struct or a block of the same
/// name with the same field names, in `std430`, `std140` or `scalar` layout: the build reads the offsets that the
/// compiler gave them and compares.
///
/// ```
/// afterlight_shader::shader_struct! {
///     /// A sphere.
///     pub struct Sphere {
///         /// Centre in world space, m.
///         pub centre_ws: [f32; 3],
///         /// Radius, m.
///         pub radius_m: f32,
///     }
/// }
/// assert_eq!(Sphere::LAYOUT.size_bytes, 16);
/// assert_eq!(Sphere::LAYOUT.fields[1].offset_bytes, 12);
/// ```
#[macro_export]
macro_rules! shader_struct {
    ($($(#[$meta:meta])* $vis:vis struct $name:ident {
        $($(#[$field_meta:meta])* $field_vis:vis $field:ident : $kind:ty),* $(,)?
    })+) => {$(
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, $crate::bytemuck::Pod, $crate::bytemuck::Zeroable)]
        $vis struct $name {
            $($(#[$field_meta])* $field_vis $field: $kind,)*
        }

        impl $name {
            /// Size, and the name, offset and size of each field: what the shader build checks GLSL against.
            pub const LAYOUT: $crate::StructLayout = $crate::StructLayout {
                name: stringify!($name),
                size_bytes: ::core::mem::size_of::<$name>(),
                fields: &[$($crate::FieldLayout {
                    name: stringify!($field),
                    offset_bytes: ::core::mem::offset_of!($name, $field),
                    size_bytes: ::core::mem::size_of::<$kind>(),
                },)*],
            };
        }

        impl Default for $name {
            /// All bytes zero.
            fn default() -> Self {
                $crate::bytemuck::Zeroable::zeroed()
            }
        }
    )+};
}
