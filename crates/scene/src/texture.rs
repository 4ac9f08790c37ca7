//! Textures: headers on loading, decoding and mip chains on upload.
//!
//! Levels are averages of areas, taken in linear light: colours through tables to 16-bit linear
//! values, normals as vectors that are made unit again. Each level is made from the 16-bit values
//! of the one above, so that rounding does not add up.

use std::{borrow::Cow, io::Cursor, path::Path, sync::LazyLock};

use image::{DynamicImage, ImageReader, Limits};

use crate::{Image, ImageData, SceneError, load};

/// What a texture holds, and so how it is averaged and stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum TextureRole {
    /// sRGB colour, linear alpha.
    BaseColor,
    /// sRGB colour.
    Emissive,
    /// Unit vectors in tangent space, biased to [0, 1]; z is positive and not stored.
    Normal,
    /// Linear numbers: occlusion, roughness, metalness.
    Data,
}

/// How the texels of a [`MipChain`] are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum TexelFormat {
    /// Four bytes: sRGB colour and linear alpha.
    Rgba8Srgb,
    /// Four bytes, linear.
    Rgba8Unorm,
    /// Two bytes, linear: x and y of a normal, biased to [0, 1].
    Rg8Unorm,
}

impl TexelFormat {
    /// Bytes of a texel.
    pub fn texel_bytes(self) -> usize {
        match self {
            Self::Rgba8Srgb | Self::Rgba8Unorm => 4,
            Self::Rg8Unorm => 2,
        }
    }
}

impl TextureRole {
    /// The format that textures of this role are decoded to.
    pub fn format(self) -> TexelFormat {
        match self {
            Self::BaseColor | Self::Emissive => TexelFormat::Rgba8Srgb,
            Self::Normal => TexelFormat::Rg8Unorm,
            Self::Data => TexelFormat::Rgba8Unorm,
        }
    }
}

/// A texture with all its mip levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MipChain {
    /// How texels are stored.
    pub format: TexelFormat,
    /// Width of level 0, pixels.
    pub width: u32,
    /// Height of level 0, pixels.
    pub height: u32,
    /// Levels, the finest first, each row by row from the top without padding; level `l` is
    /// `max(1, width >> l)` wide, `max(1, height >> l)` high. The last one is 1×1.
    pub levels: Vec<Vec<u8>>,
}

/// Largest image that is taken, pixels: 1 GiB of texels.
const PIXEL_COUNT_MAX: u64 = 1 << 28;

/// Number of levels of a full mip chain, down to 1×1.
pub fn level_count(width: u32, height: u32) -> u32 {
    width.max(height).max(1).ilog2() + 1
}

/// Decodes an image and makes its mip chain. With `target_size` (pixels) the base level is first
/// resampled to it, by areas where it shrinks and bilinearly where it grows, in linear light.
///
/// # Errors
/// Where the file cannot be read, is no PNG or JPEG, is damaged, or is too large.
pub fn decode(
    image: &Image,
    role: TextureRole,
    target_size: Option<(u32, u32)>,
) -> Result<MipChain, SceneError> {
    let pixels = decode_pixels(image)?;
    let mut base = pixels.view(image)?;
    let resampled;
    if let Some((width, height)) = target_size.filter(|&s| s != (base.width, base.height)) {
        let wide = resample(&Wide::from_bytes(&base, role), width.max(1), height.max(1), role);
        resampled = wide.to_rgba8(role);
        base = Pixels { width: width.max(1), height: height.max(1), channels: 4, bytes: &resampled };
    }
    Ok(mip_chain(&base, role))
}

/// 8-bit pixels with 3 or 4 channels.
struct Pixels<'a> {
    width: u32,
    height: u32,
    channels: usize,
    bytes: &'a [u8],
}

/// What holds decoded pixels.
enum Decoded<'a> {
    Raw { width: u32, height: u32, bytes: &'a [u8] },
    Image(DynamicImage),
}

impl Decoded<'_> {
    fn view(&self, image: &Image) -> Result<Pixels<'_>, SceneError> {
        let pixels = match self {
            Self::Raw { width, height, bytes } => {
                Pixels { width: *width, height: *height, channels: 4, bytes }
            }
            Self::Image(DynamicImage::ImageRgb8(i)) => {
                Pixels { width: i.width(), height: i.height(), channels: 3, bytes: i.as_raw() }
            }
            Self::Image(DynamicImage::ImageRgba8(i)) => {
                Pixels { width: i.width(), height: i.height(), channels: 4, bytes: i.as_raw() }
            }
            Self::Image(other) => {
                return Err(invalid(image, format!("pixels of {:?}", other.color()), "8-bit RGB or RGBA"));
            }
        };
        let expected = pixels.width as usize * pixels.height as usize * pixels.channels;
        if pixels.bytes.len() != expected || expected == 0 {
            let found = format!("{} bytes for {}×{} pixels", pixels.bytes.len(), pixels.width, pixels.height);
            return Err(invalid(image, found, &format!("{expected}, 1 or more")));
        }
        Ok(pixels)
    }
}

fn invalid(image: &Image, found: impl AsRef<str>, expected: &str) -> SceneError {
    SceneError::invalid(Path::new(&image.name), "image", found, expected)
}

fn decode_pixels(image: &Image) -> Result<Decoded<'_>, SceneError> {
    let encoded: Cow<'_, [u8]> = match &image.data {
        ImageData::Rgba8 { width, height, pixels } => {
            return Ok(Decoded::Raw { width: *width, height: *height, bytes: pixels });
        }
        ImageData::Encoded(bytes) => Cow::Borrowed(bytes),
        ImageData::File(path) => Cow::Owned(load::read_file(path)?),
    };
    let damaged = |e: &dyn std::fmt::Display| invalid(image, e.to_string(), "an undamaged PNG or JPEG");
    let mut reader =
        ImageReader::new(Cursor::new(&*encoded)).with_guessed_format().map_err(|e| damaged(&e))?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(4 * PIXEL_COUNT_MAX + (64 << 20));
    reader.limits(limits);
    Ok(Decoded::Image(match reader.decode().map_err(|e| damaged(&e))? {
        rgb @ (DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_)) => rgb,
        other => DynamicImage::ImageRgba8(other.into_rgba8()),
    }))
}

/// Reads an image's header and makes the image. `file` is the scene that names it.
pub(crate) fn open(file: &Path, name: String, data: ImageData) -> Result<Image, SceneError> {
    /// Enough for the metadata that cameras and editors put before a JPEG's size.
    const START_BYTES: u64 = 64 << 10;
    let shown = match &data {
        ImageData::File(path) => path.as_path(),
        _ => file,
    };
    let header = match &data {
        ImageData::Rgba8 { width, height, .. } => Header::Size(*width, *height),
        ImageData::Encoded(bytes) => read_header(bytes),
        ImageData::File(path) => match read_header(&load::read_file_start(path, START_BYTES)?) {
            Header::Truncated => read_header(&load::read_file(path)?),
            header => header,
        },
    };
    let wrong = |found: &str, expected: &str| {
        let at = if shown == file { name.as_str() } else { "image" };
        Err(SceneError::invalid(shown, at, found, expected))
    };
    match header {
        Header::Empty => wrong("0 bytes", "a PNG or JPEG image"),
        Header::Unknown => wrong("another format", "a PNG or JPEG image"),
        Header::Truncated => wrong("an end before the image's size", "a whole PNG or JPEG image"),
        Header::Size(0, _) | Header::Size(_, 0) => wrong("a size of 0", "1×1 pixels or more"),
        Header::Size(width, height) if u64::from(width) * u64::from(height) > PIXEL_COUNT_MAX => {
            let found = u64::from(width) * u64::from(height);
            Err(SceneError::TooLarge {
                file: shown.to_owned(),
                what: "pixels of an image".to_owned(),
                found,
                limit: PIXEL_COUNT_MAX,
            })
        }
        Header::Size(width, height) => Ok(Image { name, data, width, height }),
    }
}

/// What the start of an image file says.
#[derive(Debug, PartialEq, Eq)]
enum Header {
    Empty,
    Unknown,
    Truncated,
    Size(u32, u32),
}

fn read_header(bytes: &[u8]) -> Header {
    const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
    let be =
        |at: usize, n: usize| Some(bytes.get(at..at + n)?.iter().fold(0u32, |v, &b| v << 8 | u32::from(b)));
    if bytes.is_empty() {
        return Header::Empty;
    }
    if bytes.starts_with(PNG) {
        // signature, length and type of IHDR, width, height
        return match (be(16, 4), be(20, 4)) {
            (Some(width), Some(height)) if bytes[12..16] == *b"IHDR" => Header::Size(width, height),
            (Some(_), Some(_)) => Header::Unknown,
            _ => Header::Truncated,
        };
    }
    if !bytes.starts_with(b"\xFF\xD8") {
        return if PNG.starts_with(bytes) || bytes == b"\xFF" { Header::Truncated } else { Header::Unknown };
    }
    let mut at = 2;
    loop {
        let (Some(0xFF), Some(marker)) = (bytes.get(at), bytes.get(at + 1)) else {
            return if at + 1 >= bytes.len() { Header::Truncated } else { Header::Unknown };
        };
        match marker {
            0xFF => at += 1,
            0x01 | 0xD0..=0xD8 => at += 2,
            // a frame header other than DHT, JPG, DAC: length, precision, height, width
            0xC0..=0xCF if !matches!(marker, 0xC4 | 0xC8 | 0xCC) => {
                return match (be(at + 5, 2), be(at + 7, 2)) {
                    (Some(height), Some(width)) => Header::Size(width, height),
                    _ => Header::Truncated,
                };
            }
            0xD9 | 0xDA => return Header::Unknown,
            _ => match be(at + 2, 2) {
                Some(length) if length >= 2 => at += 2 + length as usize,
                Some(_) => return Header::Unknown,
                None => return Header::Truncated,
            },
        }
    }
}

/// sRGB byte to linear light, 65535 for 1.
static LINEAR_FROM_SRGB: LazyLock<[u16; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| (linear_from_srgb(i as f64 / 255.0) * 65535.0).round() as u16));

/// Linear light, 65535 for 1, to the nearest sRGB byte.
static SRGB_FROM_LINEAR: LazyLock<Box<[u8; 65536]>> = LazyLock::new(|| {
    let mut table = Box::new([0; 65536]);
    for (v, byte) in (0u32..).zip(table.iter_mut()) {
        *byte = (srgb_from_linear(f64::from(v) / 65535.0) * 255.0).round() as u8;
    }
    table
});

fn linear_from_srgb(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

fn srgb_from_linear(v: f64) -> f64 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// Linear 16-bit texels; normals biased to [0, 65535].
struct Wide {
    width: u32,
    height: u32,
    texels: Vec<[u16; 4]>,
}

/// How a byte becomes a linear 16-bit value: colour by its table, the rest scaled.
fn color_table(role: TextureRole) -> [u16; 256] {
    match role.format() {
        TexelFormat::Rgba8Srgb => *LINEAR_FROM_SRGB,
        _ => std::array::from_fn(|i| i as u16 * 257),
    }
}

fn byte_from_wide(v: u16) -> u8 {
    ((u32::from(v) + 128) / 257) as u8
}

impl Wide {
    fn from_bytes(pixels: &Pixels, role: TextureRole) -> Self {
        let table = color_table(role);
        let texels = pixels
            .bytes
            .chunks_exact(pixels.channels)
            .map(|p| {
                let alpha = if pixels.channels == 4 { u16::from(p[3]) * 257 } else { u16::MAX };
                [table[usize::from(p[0])], table[usize::from(p[1])], table[usize::from(p[2])], alpha]
            })
            .collect();
        Self { width: pixels.width, height: pixels.height, texels }
    }

    /// Bytes as the source image had them: sRGB colours, all three components of normals.
    fn to_rgba8(&self, role: TextureRole) -> Vec<u8> {
        let mut out = vec![0; 4 * self.texels.len()];
        let (texels, _) = out.as_chunks_mut::<4>();
        if role.format() == TexelFormat::Rgba8Srgb {
            // as an array, so that no 16-bit index needs a check
            let table: &[u8; 65536] = &SRGB_FROM_LINEAR;
            for (o, t) in texels.iter_mut().zip(&self.texels) {
                let color = |c: usize| table[usize::from(t[c])];
                *o = [color(0), color(1), color(2), byte_from_wide(t[3])];
            }
        } else {
            for (o, t) in texels.iter_mut().zip(&self.texels) {
                *o = t.map(byte_from_wide);
            }
        }
        out
    }

    /// Bytes of a level as it is uploaded.
    fn encode(&self, role: TextureRole) -> Vec<u8> {
        if role.format() != TexelFormat::Rg8Unorm {
            return self.to_rgba8(role);
        }
        let mut out = vec![0; 2 * self.texels.len()];
        for (o, t) in out.as_chunks_mut::<2>().0.iter_mut().zip(&self.texels) {
            *o = [byte_from_wide(t[0]), byte_from_wide(t[1])];
        }
        out
    }
}

/// Rounds a number within [0, 65535] to the nearest whole one. Above 2^23 a float has no fraction,
/// and its low bits are the number; a plain cast checks its range, which the compiler does not vectorise.
fn round_u16(v: f32) -> u16 {
    (v + 8_388_608.0).to_bits() as u16
}

/// A biased normal made unit, z at least 0 (it is not stored, so its sign cannot be).
fn renormalize(texel: &mut [u16; 4]) {
    const HALF: f32 = 32767.5;
    let [x, y, z] = [texel[0], texel[1], texel[2]].map(|v| f32::from(v) - HALF);
    let z = z.max(0.0);
    // bytes are whole numbers and the middle, 127.5, is not: x, y and the length are never 0
    let scale = HALF / (x * x + y * y + z * z).sqrt();
    let unit = |v: f32| round_u16(v * scale + HALF);
    *texel = [unit(x), unit(y), unit(z), texel[3]];
}

fn mip_chain(base: &Pixels, role: TextureRole) -> MipChain {
    let level_count = level_count(base.width, base.height);
    let mut levels = Vec::with_capacity(level_count as usize);
    levels.push(base_level(base, role));
    let mut above: Option<Wide> = None;
    for _ in 1..level_count {
        let level = match &above {
            None if base.width.is_multiple_of(2) && base.height.is_multiple_of(2) => halve_bytes(base, role),
            None => shrink(&Wide::from_bytes(base, role), role),
            Some(above) => shrink(above, role),
        };
        levels.push(level.encode(role));
        above = Some(level);
    }
    MipChain { format: role.format(), width: base.width, height: base.height, levels }
}

fn base_level(base: &Pixels, role: TextureRole) -> Vec<u8> {
    match (role.format(), base.channels) {
        (TexelFormat::Rg8Unorm, 4) => unit_xy(base.bytes.as_chunks::<4>().0),
        (TexelFormat::Rg8Unorm, _) => unit_xy(base.bytes.as_chunks::<3>().0),
        (_, 4) => base.bytes.to_vec(),
        _ => {
            let (from, _) = base.bytes.as_chunks::<3>();
            let mut out = vec![u8::MAX; 4 * from.len()];
            for (o, &[r, g, b]) in out.as_chunks_mut::<4>().0.iter_mut().zip(from) {
                *o = [r, g, b, u8::MAX];
            }
            out
        }
    }
}

/// x and y of each texel's vector once it is unit, as bytes.
fn unit_xy<const N: usize>(texels: &[[u8; N]]) -> Vec<u8> {
    /// Texels a block: component by component the compiler works on several at once.
    const BLOCK: usize = 64;
    const HALF: f32 = 127.5;
    let mut out = vec![0; 2 * texels.len()];
    for (o, block) in out.chunks_mut(2 * BLOCK).zip(texels.chunks(BLOCK)) {
        let (mut x, mut y, mut z) = ([0.0f32; BLOCK], [0.0f32; BLOCK], [HALF; BLOCK]);
        for (i, t) in block.iter().enumerate() {
            (x[i], y[i], z[i]) = (f32::from(t[0]) - HALF, f32::from(t[1]) - HALF, f32::from(t[2]) - HALF);
        }
        let (mut r, mut g) = ([0u16; BLOCK], [0u16; BLOCK]);
        for i in 0..BLOCK {
            let z = z[i].max(0.0);
            // bytes are never at the middle: the length is at least 0.7
            let scale = HALF / (x[i] * x[i] + y[i] * y[i] + z * z).sqrt();
            (r[i], g[i]) = (round_u16(x[i] * scale + HALF), round_u16(y[i] * scale + HALF));
        }
        for (i, o) in o.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            *o = [r[i] as u8, g[i] as u8];
        }
    }
    out
}

/// The level below an image of even size: averages of 2×2 bytes.
fn halve_bytes(base: &Pixels, role: TextureRole) -> Wide {
    let (width, height) = (base.width / 2, base.height / 2);
    let mut texels = vec![[0; 4]; width as usize * height as usize];
    let row_bytes = base.width as usize * base.channels;
    let srgb = role.format() == TexelFormat::Rgba8Srgb;
    let table = &*LINEAR_FROM_SRGB;
    let linear = |v: u8| u32::from(v) * 257;
    for (out, rows) in texels.chunks_exact_mut(width as usize).zip(base.bytes.chunks_exact(2 * row_bytes)) {
        let (top, bottom) = rows.split_at(row_bytes);
        match (srgb, base.channels) {
            (true, 4) => halve_row::<4>(|v| u32::from(table[usize::from(v)]), top, bottom, out),
            (true, _) => halve_row::<3>(|v| u32::from(table[usize::from(v)]), top, bottom, out),
            (false, 4) => halve_row::<4>(linear, top, bottom, out),
            (false, _) => halve_row::<3>(linear, top, bottom, out),
        }
    }
    finish(Wide { width, height, texels }, role)
}

/// Averages two rows of `N` channels; `color` is the 16-bit value of a colour byte.
#[inline(always)]
fn halve_row<const N: usize>(color: impl Fn(u8) -> u32, top: &[u8], bottom: &[u8], out: &mut [[u16; 4]]) {
    let (top, _) = top.as_chunks::<N>();
    let (bottom, _) = bottom.as_chunks::<N>();
    let (top, bottom) = (top.as_chunks::<2>().0, bottom.as_chunks::<2>().0);
    for ((o, t), b) in out.iter_mut().zip(top).zip(bottom) {
        for c in 0..3 {
            let sum = color(t[0][c]) + color(t[1][c]) + color(b[0][c]) + color(b[1][c]);
            o[c] = ((sum + 2) / 4) as u16;
        }
        o[3] = u16::MAX;
        if N == 4 {
            let sum: u32 =
                [t[0][N - 1], t[1][N - 1], b[0][N - 1], b[1][N - 1]].iter().map(|&v| u32::from(v)).sum();
            o[3] = ((sum * 257 + 2) / 4) as u16;
        }
    }
}

fn finish(mut level: Wide, role: TextureRole) -> Wide {
    if role == TextureRole::Normal {
        level.texels.iter_mut().for_each(renormalize);
    }
    level
}

/// The next level: half the size, rounded down, at least 1.
fn shrink(above: &Wide, role: TextureRole) -> Wide {
    let (width, height) = ((above.width / 2).max(1), (above.height / 2).max(1));
    if !(above.width.is_multiple_of(2) && above.height.is_multiple_of(2)) {
        return resample(above, width, height, role);
    }
    let row = above.width as usize;
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for rows in above.texels.chunks_exact(2 * row) {
        let (top, bottom) = rows.split_at(row);
        texels.extend(top.chunks_exact(2).zip(bottom.chunks_exact(2)).map(|(t, b)| -> [u16; 4] {
            std::array::from_fn(|c| {
                let sum = [t[0][c], t[1][c], b[0][c], b[1][c]].iter().map(|&v| u32::from(v)).sum::<u32>();
                ((sum + 2) / 4) as u16
            })
        }));
    }
    finish(Wide { width, height, texels }, role)
}

/// Where one texel of a resampled row comes from.
struct Taps {
    first: usize,
    weights: Vec<f32>,
}

/// Taps of each of `to` texels out of `from`: the share of its area where the row shrinks, the two
/// nearest centres where it grows (edges held).
fn taps(from: u32, to: u32) -> Vec<Taps> {
    let scale = f64::from(from) / f64::from(to);
    (0..to)
        .map(|i| {
            if to >= from {
                let center = (f64::from(i) + 0.5) * scale - 0.5;
                let low = center.floor().max(0.0).min(f64::from(from - 1));
                let t = (center - low).clamp(0.0, 1.0) as f32;
                let first = low as usize;
                let weights = if first + 1 < from as usize { vec![1.0 - t, t] } else { vec![1.0] };
                return Taps { first, weights };
            }
            let (start, end) = (f64::from(i) * scale, (f64::from(i) + 1.0) * scale);
            let first = start.floor() as usize;
            let last = (end.ceil() as usize).min(from as usize).max(first + 1);
            let share = |k: usize| (end.min(k as f64 + 1.0) - start.max(k as f64)).max(0.0);
            let total: f64 = (first..last).map(share).sum();
            Taps { first, weights: (first..last).map(|k| (share(k) / total) as f32).collect() }
        })
        .collect()
}

/// Resamples in linear light to any size, rows first.
fn resample(from: &Wide, width: u32, height: u32, role: TextureRole) -> Wide {
    let (columns, rows) = (taps(from.width, width), taps(from.height, height));
    let sum = |taps: &Taps, at: &dyn Fn(usize) -> [f32; 4]| -> [f32; 4] {
        let mut out = [0.0; 4];
        for (k, weight) in taps.weights.iter().enumerate() {
            let texel = at(taps.first + k);
            for (o, t) in out.iter_mut().zip(texel) {
                *o += weight * t;
            }
        }
        out
    };
    let mut narrow: Vec<[f32; 4]> = Vec::with_capacity(width as usize * from.height as usize);
    for row in from.texels.chunks_exact(from.width as usize) {
        narrow.extend(columns.iter().map(|c| sum(c, &|k| row[k].map(f32::from))));
    }
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for r in &rows {
        texels.extend((0..width as usize).map(|x| {
            sum(r, &|k| narrow[k * width as usize + x]).map(|v| (v + 0.5).clamp(0.0, 65535.0) as u16)
        }));
    }
    finish(Wide { width, height, texels }, role)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn raw(width: u32, height: u32, pixels: Vec<u8>) -> Image {
        let data = ImageData::Rgba8 { width, height, pixels: Arc::from(pixels) };
        Image { name: "test".to_owned(), data, width, height }
    }

    #[test]
    fn tables_invert_each_other() {
        for v in 0..=255u8 {
            assert_eq!(SRGB_FROM_LINEAR[usize::from(LINEAR_FROM_SRGB[usize::from(v)])], v);
        }
    }

    #[test]
    fn checkerboard_averages_to_half_the_light() {
        let board: Vec<u8> = (0..16)
            .flat_map(|i| if (i % 4 + i / 4) % 2 == 0 { [255, 255, 255, 255] } else { [0, 0, 0, 0] })
            .collect();
        let chain = decode(&raw(4, 4, board), TextureRole::BaseColor, None).unwrap();
        assert_eq!(chain.levels.len(), 3);
        // sRGB of 0.5 is 188, alpha is linear
        assert_eq!(chain.levels[2], [188, 188, 188, 128]);
    }

    #[test]
    fn odd_sizes_weigh_every_texel_alike() {
        // a white texel among black ones gives the same share of light wherever it is
        for white in 0..15 {
            let row: Vec<u8> = (0..15).flat_map(|i| [if i == white { 255 } else { 0 }; 4]).collect();
            let chain = decode(&raw(15, 1, row), TextureRole::Data, None).unwrap();
            assert_eq!(chain.levels.iter().map(|l| l.len() / 4).collect::<Vec<_>>(), [15, 7, 3, 1]);
            assert!(chain.levels[3][0].abs_diff(17) <= 1, "{white}: {:?}", chain.levels[3]);
        }
    }

    #[test]
    fn normals_stay_unit() {
        let texels = [[255, 128, 128, 255], [128, 255, 128, 255], [128, 128, 255, 255], [128, 128, 255, 255]];
        let chain = decode(&raw(2, 2, texels.concat()), TextureRole::Normal, None).unwrap();
        assert_eq!(chain.format, TexelFormat::Rg8Unorm);
        // mean of x, y, z, z: (1, 1, 2) / sqrt(6)
        let expected = ((1.0 / 6.0f64.sqrt() * 0.5 + 0.5) * 255.0).round() as u8;
        assert!(chain.levels[1].iter().all(|v| v.abs_diff(expected) <= 1), "{:?}", chain.levels[1]);
    }

    #[test]
    fn resampling_keeps_constants() {
        let grey = vec![77; 5 * 3 * 4];
        for size in [(8, 8), (1, 1), (3, 7), (5, 3)] {
            for role in [TextureRole::BaseColor, TextureRole::Data] {
                let chain = decode(&raw(5, 3, grey.clone()), role, Some(size)).unwrap();
                assert_eq!((chain.width, chain.height), size);
                assert_eq!(chain.levels.len() as u32, level_count(size.0, size.1));
                assert!(chain.levels.iter().flatten().all(|&v| v == 77), "{size:?} {role:?}");
            }
        }
    }

    #[test]
    fn headers() {
        assert_eq!(read_header(b""), Header::Empty);
        assert_eq!(read_header(b"\x89PNG\r\n"), Header::Truncated);
        assert_eq!(read_header(b"GIF89a"), Header::Unknown);
        let jpeg = b"\xFF\xD8\xFF\xE0\0\x04ab\xFF\xC2\0\x11\x08\0\x10\0\x20\x03";
        assert_eq!(read_header(jpeg), Header::Size(32, 16));
        for end in 1..jpeg.len() - 1 {
            assert!(!matches!(read_header(&jpeg[..end]), Header::Empty | Header::Unknown), "{end}");
        }
    }
}
