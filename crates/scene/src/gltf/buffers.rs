//! Buffers and buffer views: checked byte ranges, decompressed where EXT_meshopt_compression says so.

use std::{borrow::Cow, path::Path};

use base64::{Engine, engine::DecodePaddingMode, engine::general_purpose::GeneralPurposeConfig};
use gltf::json::{self, Root, Value};
use rayon::prelude::*;
use serde::Deserialize;

use super::container::Container;
use crate::{SceneError, load};

/// The bytes of a buffer view.
pub(super) type View<'a> = Cow<'a, [u8]>;

const MESHOPT: &str = "EXT_meshopt_compression";

/// EXT_meshopt_compression of a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Meshopt {
    buffer: u64,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: u64,
    count: u64,
    mode: String,
    #[serde(default = "filter_none")]
    filter: String,
}

fn filter_none() -> String {
    "NONE".to_owned()
}

/// Reads every buffer. `None` is a buffer without bytes: a placeholder, an error only where used.
pub(super) fn load_buffers<'a>(
    file: &Path,
    container: &Container<'a>,
) -> Result<Vec<Option<Cow<'a, [u8]>>>, SceneError> {
    let buffers = &container.root.buffers;
    let mut out = Vec::with_capacity(buffers.len());
    for (i, buffer) in buffers.iter().enumerate() {
        let at = format!("buffers[{i}]");
        let length = buffer.byte_length.0;
        if length == 0 {
            return Err(SceneError::invalid(file, format!("{at}.byteLength"), "0 or none", "1 or more"));
        }
        let bytes: Option<Cow<'a, [u8]>> = match &buffer.uri {
            Some(uri) => Some(Cow::Owned(read_uri(file, &at, uri, BUFFER_TYPES)?)),
            None if i == 0 && container.is_glb => match container.bin {
                Some(bin) => Some(Cow::Borrowed(bin)),
                None if is_fallback(buffer) => None,
                None => {
                    return Err(SceneError::invalid(
                        file,
                        at,
                        "no uri and no BIN chunk",
                        "bytes in one of them",
                    ));
                }
            },
            None => None,
        };
        if let Some(bytes) = &bytes
            && (bytes.len() as u64) < length
        {
            let source = buffer.uri.as_deref().filter(|u| !u.starts_with("data:")).unwrap_or("its data");
            return Err(SceneError::invalid(
                file,
                at,
                format!("{} bytes in {source}", bytes.len()),
                format!("the {length} bytes of its byteLength"),
            ));
        }
        out.push(bytes);
    }
    Ok(out)
}

/// Whether a buffer only stands for what compressed views decode to.
fn is_fallback(buffer: &json::Buffer) -> bool {
    let extension = buffer.extensions.as_ref().and_then(|e| e.others.get(MESHOPT));
    extension.and_then(|e| e.get("fallback")).and_then(Value::as_bool).unwrap_or(false)
}

/// Media types of buffers in data URIs.
const BUFFER_TYPES: &[&str] = &["application/octet-stream", "application/gltf-buffer"];

/// Decodes base64 whether or not it is padded.
const BASE64: base64::engine::GeneralPurpose = base64::engine::GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes of a `data:` URI, one of the media types.
pub(super) fn decode_data_uri(
    file: &Path,
    at: &str,
    uri: &str,
    media_types: &[&str],
) -> Result<Vec<u8>, SceneError> {
    let wrong =
        |found: String, expected: String| SceneError::invalid(file, format!("{at}.uri"), found, expected);
    let short: String = uri.chars().take(40).collect();
    let Some((header, data)) = uri["data:".len()..].split_once(',') else {
        return Err(wrong(format!("{short:?}"), "data:TYPE;base64,DATA".to_owned()));
    };
    let (media_type, is_base64) = match header.strip_suffix(";base64") {
        Some(media_type) => (media_type, true),
        None => (header, false),
    };
    let media_type = media_type.split(';').next().unwrap_or_default();
    if !media_types.contains(&media_type) {
        return Err(wrong(format!("the media type {media_type:?}"), media_types.join(" or ")));
    }
    let data =
        load::percent_decode_bytes(data).ok_or_else(|| wrong("a broken % escape".into(), "%XX".into()))?;
    if !is_base64 {
        return Ok(data);
    }
    BASE64.decode(data).map_err(|e| wrong(e.to_string(), "base64".to_owned()))
}

fn read_uri(file: &Path, at: &str, uri: &str, media_types: &[&str]) -> Result<Vec<u8>, SceneError> {
    if uri.starts_with("data:") {
        return decode_data_uri(file, at, uri, media_types);
    }
    let path = load::resolve_uri(file, uri).ok_or_else(|| {
        SceneError::invalid(
            file,
            format!("{at}.uri"),
            format!("{uri:?}"),
            "a relative file name or a data URI",
        )
    })?;
    load::read_file(&path)
}

/// Resolves every buffer view; compressed ones are decoded in parallel.
pub(super) fn load_views<'a>(
    file: &Path,
    root: &Root,
    buffers: &'a [Option<Cow<'_, [u8]>>],
) -> Result<Vec<Option<View<'a>>>, SceneError> {
    root.buffer_views
        .par_iter()
        .enumerate()
        .map(|(i, view)| load_view(file, root, buffers, i, view))
        .collect()
}

fn load_view<'a>(
    file: &Path,
    root: &Root,
    buffers: &'a [Option<Cow<'_, [u8]>>],
    index: usize,
    view: &json::buffer::View,
) -> Result<Option<View<'a>>, SceneError> {
    let at = format!("bufferViews[{index}]");
    let length = view.byte_length.0;
    let offset = view.byte_offset.map_or(0, |o| o.0);
    if length == 0 {
        return Err(SceneError::invalid(file, format!("{at}.byteLength"), "0", "1 or more"));
    }
    if let Some(stride) = view.byte_stride.map(|s| s.0)
        && !((4..=252).contains(&stride) && stride.is_multiple_of(4))
    {
        let expected = "4 to 252, a multiple of 4";
        return Err(SceneError::invalid(file, format!("{at}.byteStride"), stride.to_string(), expected));
    }
    let Some(buffer) = root.buffers.get(view.buffer.value()) else {
        return Err(super::check::unresolved(
            file,
            format!("{at}.buffer"),
            view.buffer.value(),
            root.buffers.len(),
        ));
    };
    let in_range =
        |offset: u64, length: u64, total: u64| offset.checked_add(length).is_some_and(|end| end <= total);
    if !in_range(offset, length, buffer.byte_length.0) {
        return Err(SceneError::invalid(
            file,
            at,
            format!("bytes {offset} to {}", offset.saturating_add(length)),
            format!("a range within the {} bytes of buffers[{}]", buffer.byte_length.0, view.buffer.value()),
        ));
    }
    if let Some(extension) = view.extensions.as_ref().and_then(|e| e.others.get(MESHOPT)) {
        let at = format!("{at}.extensions.{MESHOPT}");
        let meshopt = Meshopt::deserialize(extension)
            .map_err(|e| SceneError::invalid(file, &at, e.to_string(), "the properties of the extension"))?;
        let bytes = decode_meshopt(file, &at, buffers, &meshopt, length)?;
        return Ok(Some(Cow::Owned(bytes)));
    }
    let Some(bytes) = &buffers[view.buffer.value()] else { return Ok(None) };
    // in range: the buffer holds at least its byteLength, checked on loading it
    let bytes = &bytes[offset as usize..(offset + length) as usize];
    Ok(Some(Cow::Borrowed(bytes)))
}

/// Most bytes that a compressed byte can stand for. The vertex codec stores a control byte for
/// four byte planes of up to 256 vertices: 1,024; anything above is refused before memory is taken.
const MESHOPT_RATIO_MAX: u64 = 1024;

/// Bytes of header and tail of a compressed vertex stream that [`MESHOPT_RATIO_MAX`] leaves out.
const MESHOPT_SLACK_BYTES: u64 = 64;

fn decode_meshopt(
    file: &Path,
    at: &str,
    buffers: &[Option<Cow<'_, [u8]>>],
    m: &Meshopt,
    view_length: u64,
) -> Result<Vec<u8>, SceneError> {
    let wrong = |property: &str, found: String, expected: String| {
        SceneError::invalid(file, format!("{at}{property}"), found, expected)
    };
    let encoded = match buffers.get(m.buffer as usize) {
        None => {
            return Err(super::check::unresolved(
                file,
                format!("{at}.buffer"),
                m.buffer as usize,
                buffers.len(),
            ));
        }
        Some(None) => {
            return Err(wrong(".buffer", format!("buffers[{}] without data", m.buffer), "data".into()));
        }
        Some(Some(bytes)) => bytes,
    };
    let end = m.byte_offset.checked_add(m.byte_length).filter(|&end| end <= encoded.len() as u64);
    let Some(end) = end else {
        let found = format!("{} bytes from {}", m.byte_length, m.byte_offset);
        return Err(wrong("", found, format!("a range within the {} bytes of its buffer", encoded.len())));
    };
    let encoded = &encoded[m.byte_offset as usize..end as usize];
    if m.count.checked_mul(m.byte_stride) != Some(view_length) {
        let found = format!("count {} of stride {}", m.count, m.byte_stride);
        return Err(wrong("", found, format!("the {view_length} bytes of the view")));
    }
    if view_length > (m.byte_length + MESHOPT_SLACK_BYTES) * MESHOPT_RATIO_MAX {
        let found = format!("{view_length} bytes out of {}", m.byte_length);
        return Err(wrong("", found, format!("at most {MESHOPT_RATIO_MAX} from one")));
    }
    if m.mode != "ATTRIBUTES" && m.filter != "NONE" {
        return Err(wrong(".filter", format!("{:?} with mode {}", m.filter, m.mode), "NONE".into()));
    }
    let count = m.count as usize;
    let failed = |_| {
        wrong(
            "",
            format!("{} bytes that do not decode", m.byte_length),
            format!("{count} elements of mode {}", m.mode),
        )
    };
    match (m.mode.as_str(), m.byte_stride) {
        ("ATTRIBUTES", stride) => {
            let mut bytes = decode_vertices(stride, encoded, count)
                .ok_or_else(|| wrong(".byteStride", stride.to_string(), "4 to 256, a multiple of 4".into()))?
                .map_err(failed)?;
            apply_filter(&m.filter, stride, &mut bytes).ok_or_else(|| {
                wrong(".filter", format!("{:?} with stride {stride}", m.filter), FILTERS.to_owned())
            })?;
            Ok(bytes)
        }
        ("TRIANGLES", _) if !count.is_multiple_of(3) => {
            Err(wrong(".count", count.to_string(), "a multiple of 3".into()))
        }
        ("TRIANGLES", 2) => meshopt::decode_index_buffer::<u16>(encoded, count).map(to_bytes).map_err(failed),
        ("TRIANGLES", 4) => meshopt::decode_index_buffer::<u32>(encoded, count).map(to_bytes).map_err(failed),
        ("INDICES", 2) => meshopt::decode_index_sequence::<u16>(encoded, count).map(to_bytes).map_err(failed),
        ("INDICES", 4) => meshopt::decode_index_sequence::<u32>(encoded, count).map(to_bytes).map_err(failed),
        ("TRIANGLES" | "INDICES", stride) => Err(wrong(".byteStride", stride.to_string(), "2 or 4".into())),
        (mode, _) => Err(wrong(".mode", format!("{mode:?}"), "ATTRIBUTES, TRIANGLES or INDICES".into())),
    }
}

const FILTERS: &str = "NONE, OCTAHEDRAL (stride 4 or 8), QUATERNION (8) or EXPONENTIAL (a multiple of 4)";

fn to_bytes<T: bytemuck::NoUninit>(values: Vec<T>) -> Vec<u8> {
    bytemuck::cast_slice(&values).to_vec()
}

/// Calls the decoder for a stride known at compile time, as its safe interface needs; `None`
/// for strides that the format does not have.
fn decode_vertices(stride: u64, encoded: &[u8], count: usize) -> Option<meshopt::Result<Vec<u8>>> {
    /// One vertex of `4 * N` bytes.
    #[derive(Clone, Copy)]
    struct Vertex<const N: usize>([u32; N]);
    impl<const N: usize> Default for Vertex<N> {
        fn default() -> Self {
            Self([0; N])
        }
    }
    fn decode<const N: usize>(encoded: &[u8], count: usize) -> meshopt::Result<Vec<u8>> {
        let vertices = meshopt::decode_vertex_buffer::<Vertex<N>>(encoded, count)?;
        let mut bytes = Vec::with_capacity(count * 4 * N);
        for v in &vertices {
            bytes.extend_from_slice(bytemuck::cast_slice(&v.0));
        }
        Ok(bytes)
    }
    macro_rules! by_words {
        ($($n:literal)*) => {
            match stride {
                $(s if s == 4 * $n => Some(decode::<$n>(encoded, count)),)*
                _ => None,
            }
        };
    }
    by_words!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32
        33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64)
}

/// Undoes a filter in place; `None` where the extension has no such filter for the stride.
fn apply_filter(filter: &str, stride: u64, bytes: &mut [u8]) -> Option<()> {
    match (filter, stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => meshopt::decode_filter_oct(bytemuck::cast_slice_mut::<u8, [i8; 4]>(bytes)),
        ("OCTAHEDRAL", 8) => with_words::<[i16; 4]>(bytes, meshopt::decode_filter_oct),
        ("QUATERNION", 8) => with_words::<[i16; 4]>(bytes, meshopt::decode_filter_quat),
        ("EXPONENTIAL", s) if s.is_multiple_of(4) => {
            with_words::<[u32; 1]>(bytes, meshopt::decode_filter_exp);
        }
        _ => return None,
    }
    Some(())
}

/// Runs `f` on the bytes as values of `T`, copied where they are not aligned for it.
fn with_words<T: bytemuck::Pod>(bytes: &mut [u8], f: impl FnOnce(&mut [T])) {
    if let Ok(values) = bytemuck::try_cast_slice_mut(bytes) {
        return f(values);
    }
    let mut values: Vec<T> = bytemuck::pod_collect_to_vec(bytes);
    f(&mut values);
    bytes.copy_from_slice(bytemuck::cast_slice(&values));
}
