//! Accessors: typed reading from checked byte ranges.

use std::{borrow::Cow, path::Path};

use gltf::json::{
    Root,
    accessor::{ComponentType, Type},
    validation::Checked,
};

use super::{buffers::View, check};
use crate::SceneError;

/// Most elements of an accessor without a buffer view: they are zeros that no byte of the file
/// pays for, so a short file could ask for any amount of memory.
const ZEROS_COUNT_MAX: u64 = 1 << 24;

/// Shape and place of an accessor, checked against its buffer view.
pub(super) struct Layout {
    at: String,
    view: Option<usize>,
    offset: usize,
    stride: usize,
    pub(super) count: usize,
    pub(super) component: ComponentType,
    pub(super) shape: Type,
    pub(super) normalized: bool,
    sparse: Option<Sparse>,
}

struct Sparse {
    count: usize,
    index_view: usize,
    index_offset: usize,
    index_component: ComponentType,
    value_view: usize,
    value_offset: usize,
}

/// Bytes of one element; columns of matrices start at multiples of four (glTF 2.0, 3.6.2.4).
fn element_bytes(shape: Type, component: ComponentType) -> usize {
    let size = component.size();
    let column = |rows: usize| (rows * size).next_multiple_of(4);
    match shape {
        Type::Mat2 => column(2) + 2 * size,
        Type::Mat3 => 2 * column(3) + 3 * size,
        _ => shape.multiplicity() * size,
    }
}

/// The layouts of all accessors, checked: references, ranges, strides.
pub(super) fn layouts(file: &Path, root: &Root) -> Result<Vec<Layout>, SceneError> {
    (0..root.accessors.len()).map(|i| layout(file, root, i)).collect()
}

fn layout(file: &Path, root: &Root, index: usize) -> Result<Layout, SceneError> {
    let accessor = &root.accessors[index];
    let at = format!("accessors[{index}]");
    let wrong = |property: &str, found: String, expected: String| {
        Err(SceneError::invalid(file, format!("{at}{property}"), found, expected))
    };
    let Checked::Valid(component) = accessor.component_type else {
        return wrong(".componentType", "an unknown number".into(), "5120 to 5123, 5125 or 5126".into());
    };
    let component = component.0;
    let Checked::Valid(shape) = accessor.type_ else {
        return wrong(".type", "an unknown name".into(), "SCALAR, VEC2 to VEC4 or MAT2 to MAT4".into());
    };
    if accessor.normalized && matches!(component, ComponentType::F32 | ComponentType::U32) {
        return wrong(".normalized", "true for 32-bit components".into(), "false".into());
    }
    if accessor.count.0 == 0 {
        return wrong(".count", "0".into(), "1 or more".into());
    }
    let element = element_bytes(shape, component);
    let offset = accessor.byte_offset.map_or(0, |o| o.0);
    let count = accessor.count.0;
    let mut stride = element;
    let view = match accessor.buffer_view {
        None if offset != 0 => {
            return wrong(".byteOffset", offset.to_string(), "none without a bufferView".into());
        }
        None if count > ZEROS_COUNT_MAX => {
            return Err(SceneError::TooLarge {
                file: file.to_owned(),
                what: format!("{at}: elements without a bufferView"),
                found: count,
                limit: ZEROS_COUNT_MAX,
            });
        }
        None => None,
        Some(v) => {
            let view = resolve_view(file, root, format!("{at}.bufferView"), v.value())?;
            stride = view.byte_stride.map_or(element, |s| s.0);
            if stride < element {
                return wrong(
                    "",
                    format!("a stride of {stride} bytes"),
                    format!("its elements' {element} or more"),
                );
            }
            check_range(file, &at, offset, count, stride, element, view.byte_length.0)?;
            Some(v.value())
        }
    };
    let sparse =
        accessor.sparse.as_ref().map(|s| sparse_layout(file, root, &at, s, count, element)).transpose()?;
    let normalized = accessor.normalized;
    let (offset, count) = (offset as usize, count as usize);
    Ok(Layout { at, view, offset, stride, count, component, shape, normalized, sparse })
}

fn resolve_view<'a>(
    file: &Path,
    root: &'a Root,
    at: String,
    index: usize,
) -> Result<&'a gltf::json::buffer::View, SceneError> {
    let views = &root.buffer_views;
    views.get(index).ok_or_else(|| check::unresolved(file, at, index, views.len()))
}

/// Checks that `count` elements lie within a view of `view_bytes`.
fn check_range(
    file: &Path,
    at: &str,
    offset: u64,
    count: u64,
    stride: usize,
    element: usize,
    view_bytes: u64,
) -> Result<(), SceneError> {
    let end = (count - 1)
        .checked_mul(stride as u64)
        .and_then(|b| b.checked_add(element as u64))
        .and_then(|b| b.checked_add(offset));
    if end.is_none_or(|end| end > view_bytes) {
        let found = format!("{count} elements of stride {stride} from byte {offset}");
        let expected = format!("a range within the {view_bytes} bytes of its bufferView");
        return Err(SceneError::invalid(file, at, found, expected));
    }
    Ok(())
}

fn sparse_layout(
    file: &Path,
    root: &Root,
    at: &str,
    sparse: &gltf::json::accessor::sparse::Sparse,
    count: u64,
    element: usize,
) -> Result<Sparse, SceneError> {
    let at = format!("{at}.sparse");
    if sparse.count.0 == 0 || sparse.count.0 > count {
        let expected = format!("1 to the {count} of the accessor");
        return Err(SceneError::invalid(file, format!("{at}.count"), sparse.count.0.to_string(), expected));
    }
    let Checked::Valid(index_component) = sparse.indices.component_type else {
        let expected = "5121, 5123 or 5125";
        return Err(SceneError::invalid(
            file,
            format!("{at}.indices.componentType"),
            "an unknown number",
            expected,
        ));
    };
    let index_component = index_component.0;
    let (indices, values) = (&sparse.indices, &sparse.values);
    for (name, view_index, offset, element) in [
        ("indices", indices.buffer_view.value(), indices.byte_offset.0, index_component.size()),
        ("values", values.buffer_view.value(), values.byte_offset.0, element),
    ] {
        let at = format!("{at}.{name}");
        let view = resolve_view(file, root, format!("{at}.bufferView"), view_index)?;
        if view.byte_stride.is_some() {
            return Err(SceneError::invalid(file, at, "a bufferView with a byteStride", "one without"));
        }
        check_range(file, &at, offset, sparse.count.0, element, element, view.byte_length.0)?;
    }
    Ok(Sparse {
        count: sparse.count.0 as usize,
        index_view: indices.buffer_view.value(),
        index_offset: indices.byte_offset.0 as usize,
        index_component,
        value_view: values.buffer_view.value(),
        value_offset: values.byte_offset.0 as usize,
    })
}

/// All accessors of a file, ready to be read.
pub(super) struct Accessors<'a> {
    pub(super) file: &'a Path,
    pub(super) layouts: Vec<Layout>,
    pub(super) views: Vec<Option<View<'a>>>,
}

/// The elements of one accessor: sparse ones filled in, others borrowed.
struct Elements<'a> {
    bytes: Cow<'a, [u8]>,
    stride: usize,
    element: usize,
    count: usize,
}

impl Elements<'_> {
    fn iter(&self) -> impl ExactSizeIterator<Item = &[u8]> {
        (0..self.count).map(|i| &self.bytes[i * self.stride..i * self.stride + self.element])
    }
}

impl<'a> Accessors<'a> {
    /// An accessor's layout; an index out of range was refused by the reference checks before.
    pub(super) fn layout(&self, index: usize) -> Result<&Layout, SceneError> {
        self.layouts.get(index).ok_or_else(|| {
            check::unresolved(self.file, "an accessor index".to_owned(), index, self.layouts.len())
        })
    }

    /// Whether the bytes of an accessor are there: a buffer may be a placeholder.
    pub(super) fn has_data(&self, index: usize) -> bool {
        let Some(layout) = self.layouts.get(index) else { return false };
        let sparse = layout.sparse.as_ref();
        let views = [layout.view, sparse.map(|s| s.index_view), sparse.map(|s| s.value_view)];
        views.into_iter().flatten().all(|v| matches!(self.views.get(v), Some(Some(_))))
    }

    /// Place of an accessor for messages.
    pub(super) fn place(&self, index: usize) -> &str {
        self.layouts.get(index).map_or("accessors", |l| &l.at)
    }

    fn view_bytes(&self, layout: &Layout, view: usize) -> Result<&[u8], SceneError> {
        match self.views.get(view) {
            Some(Some(bytes)) => Ok(bytes),
            _ => {
                let expected = "data behind its bufferView";
                Err(SceneError::invalid(self.file, &layout.at, "a buffer without data", expected))
            }
        }
    }

    fn elements(&self, layout: &Layout) -> Result<Elements<'_>, SceneError> {
        let element = element_bytes(layout.shape, layout.component);
        let mut elements = match layout.view {
            // ranges were checked against the views' lengths, which their bytes have
            Some(view) => Elements {
                bytes: Cow::Borrowed(&self.view_bytes(layout, view)?[layout.offset..]),
                stride: layout.stride,
                element,
                count: layout.count,
            },
            None => Elements {
                bytes: Cow::Owned(vec![0; layout.count * element]),
                stride: element,
                element,
                count: layout.count,
            },
        };
        if let Some(sparse) = &layout.sparse {
            self.apply_sparse(layout, sparse, &mut elements)?;
        }
        Ok(elements)
    }

    fn apply_sparse(&self, layout: &Layout, s: &Sparse, elements: &mut Elements) -> Result<(), SceneError> {
        let indices = &self.view_bytes(layout, s.index_view)?[s.index_offset..];
        let values = &self.view_bytes(layout, s.value_view)?[s.value_offset..];
        let (element, stride) = (elements.element, elements.stride);
        let index_bytes = s.index_component.size();
        let bytes = elements.bytes.to_mut();
        let mut previous = None;
        for k in 0..s.count {
            let index = read_index(s.index_component, &indices[k * index_bytes..]) as usize;
            if index >= layout.count || previous.is_some_and(|p| p >= index) {
                return Err(SceneError::invalid(
                    self.file,
                    format!("{}.sparse.indices", layout.at),
                    format!("{index} at {k}"),
                    format!("increasing numbers below {}", layout.count),
                ));
            }
            previous = Some(index);
            let at = index * stride;
            bytes[at..at + element].copy_from_slice(&values[k * element..(k + 1) * element]);
        }
        Ok(())
    }

    /// Reads scalars or vectors as floats: normalised integers scaled, others converted. Elements
    /// must have between `N_MIN` and `N` components; missing ones become `fill`. Every number must
    /// be finite.
    pub(super) fn floats<const N: usize>(
        &self,
        index: usize,
        components_min: usize,
        fill: f32,
    ) -> Result<Vec<[f32; N]>, SceneError> {
        let layout = self.layout(index)?;
        let width = layout.shape.multiplicity();
        let is_matrix = matches!(layout.shape, Type::Mat2 | Type::Mat3);
        if is_matrix || width > N || width < components_min {
            let found = format!("{:?}", layout.shape);
            let expected = if components_min == N {
                format!("{N} components")
            } else {
                format!("{components_min} to {N} components")
            };
            return Err(SceneError::invalid(self.file, format!("{}.type", layout.at), found, expected));
        }
        let elements = self.elements(layout)?;
        let read = |convert: &dyn Fn(&[u8], &mut [f32])| -> Vec<[f32; N]> {
            elements
                .iter()
                .map(|e| {
                    let mut out = [fill; N];
                    convert(e, &mut out[..width]);
                    out
                })
                .collect()
        };
        let values = match (layout.component, layout.normalized) {
            (ComponentType::F32, _) if width == N => {
                let mut out = Vec::with_capacity(elements.count);
                out.extend(elements.iter().map(|e| -> [f32; N] { read_floats(e) }));
                out
            }
            (ComponentType::F32, _) => read(&|e, out| {
                for (o, b) in out.iter_mut().zip(e.chunks_exact(4)) {
                    *o = f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
                }
            }),
            (ComponentType::I8, norm) => read(&|e, out| {
                for (o, &b) in out.iter_mut().zip(e) {
                    let v = f32::from(b as i8);
                    *o = if norm { (v / 127.0).max(-1.0) } else { v };
                }
            }),
            (ComponentType::U8, norm) => read(&|e, out| {
                for (o, &b) in out.iter_mut().zip(e) {
                    *o = if norm { f32::from(b) / 255.0 } else { f32::from(b) };
                }
            }),
            (ComponentType::I16, norm) => read(&|e, out| {
                for (o, b) in out.iter_mut().zip(e.chunks_exact(2)) {
                    let v = f32::from(i16::from_le_bytes([b[0], b[1]]));
                    *o = if norm { (v / 32767.0).max(-1.0) } else { v };
                }
            }),
            (ComponentType::U16, norm) => read(&|e, out| {
                for (o, b) in out.iter_mut().zip(e.chunks_exact(2)) {
                    let v = f32::from(u16::from_le_bytes([b[0], b[1]]));
                    *o = if norm { v / 65535.0 } else { v };
                }
            }),
            (ComponentType::U32, _) => read(&|e, out| {
                for (o, b) in out.iter_mut().zip(e.chunks_exact(4)) {
                    *o = u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32;
                }
            }),
        };
        if let Some(k) = values.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
            let found = format!("{:?}", values[k]);
            return Err(SceneError::invalid(
                self.file,
                format!("{} element {k}", layout.at),
                found,
                "finite numbers",
            ));
        }
        Ok(values)
    }

    /// Reads scalars of any unsigned width.
    pub(super) fn indices(&self, index: usize) -> Result<Vec<u32>, SceneError> {
        let layout = self.layout(index)?;
        let elements = self.elements(layout)?;
        let b = &elements;
        Ok(match layout.component {
            ComponentType::U8 | ComponentType::I8 => b.iter().map(|e| u32::from(e[0])).collect(),
            ComponentType::U16 | ComponentType::I16 => {
                b.iter().map(|e| u32::from(u16::from_le_bytes([e[0], e[1]]))).collect()
            }
            ComponentType::U32 | ComponentType::F32 => {
                b.iter().map(|e| u32::from_le_bytes([e[0], e[1], e[2], e[3]])).collect()
            }
        })
    }

    /// Reads vectors of four unsigned integers (joint indices).
    pub(super) fn uvec4(&self, index: usize) -> Result<Vec<[u32; 4]>, SceneError> {
        let layout = self.layout(index)?;
        let elements = self.elements(layout)?;
        let size = layout.component.size();
        Ok(elements
            .iter()
            .map(|e| {
                let mut out = [0; 4];
                for (o, b) in out.iter_mut().zip(e.chunks_exact(size)) {
                    *o = read_index(layout.component, b);
                }
                out
            })
            .collect())
    }
}

/// `N` floats from `4 N` bytes. Files are little-endian.
fn read_floats<const N: usize>(bytes: &[u8]) -> [f32; N] {
    std::array::from_fn(|i| {
        f32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
    })
}

fn read_index(component: ComponentType, b: &[u8]) -> u32 {
    match component {
        ComponentType::U8 | ComponentType::I8 => u32::from(b[0]),
        ComponentType::U16 | ComponentType::I16 => u32::from(u16::from_le_bytes([b[0], b[1]])),
        ComponentType::U32 | ComponentType::F32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
    }
}
