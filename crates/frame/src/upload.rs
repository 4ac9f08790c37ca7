//! Uploads of slices into buffers and of records into images.

use afterlight_graph::gpu::{self, vk};

/// Uploads a slice into a storage buffer that may also be a vertex or index buffer; an empty slice gives a buffer of
/// zeros, since empty buffers do not exist.
pub fn upload_slice<T: bytemuck::NoUninit>(
    device: &gpu::Device,
    uploader: &mut gpu::Uploader,
    name: &str,
    data: &[T],
) -> Result<gpu::Buffer, gpu::GpuError> {
    let zeros = [0u8; 64];
    let bytes = if data.is_empty() { &zeros[..] } else { bytemuck::cast_slice(data) };
    let buffer = device.create_buffer(&gpu::BufferDesc {
        name,
        bytes: bytes.len() as u64,
        usage: vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::VERTEX_BUFFER
            | vk::BufferUsageFlags::INDEX_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST,
        memory: gpu::MemoryKind::DeviceLocal,
    })?;
    uploader.buffer(&buffer, 0, bytes)?;
    Ok(buffer)
}

/// Writes values from `offset` bytes on.
///
/// # Panics
/// Where they find no room: whoever declares a buffer knows how much any view writes.
pub fn put<T: bytemuck::NoUninit>(bytes: &mut [u8], offset: usize, values: &[T]) {
    let from: &[u8] = bytemuck::cast_slice(values);
    let room = bytes.len();
    let to = bytes.get_mut(offset..).and_then(|rest| rest.get_mut(..from.len()));
    let to = to.unwrap_or_else(|| panic!("{} bytes at {offset} of a buffer of {room}", from.len()));
    to.copy_from_slice(from);
}

/// Texels of a row of a record image: shaders address rows of this length.
const ROW_TEXELS: usize = 1024;

/// Uploads records into an image of four 32-bit words a texel, `stride_texels` (a power of two) a record, rows of 1,024
/// texels, gaps filled with zeros.
pub fn record_image<T: bytemuck::NoUninit>(
    device: &gpu::Device,
    uploader: &mut gpu::Uploader,
    name: &str,
    records: &[T],
    stride_texels: usize,
    format: vk::Format,
) -> Result<gpu::Image, gpu::GpuError> {
    let stride_bytes = 16 * stride_texels;
    assert!(size_of::<T>() <= stride_bytes, "{name}: {} bytes in {stride_bytes}", size_of::<T>());
    let rows = record_rows(records.len(), stride_texels);
    let mut bytes = vec![0u8; rows * ROW_TEXELS * 16];
    for (place, record) in bytes.chunks_exact_mut(stride_bytes).zip(records) {
        place[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(record));
    }
    let image = device.create_image(&gpu::ImageDesc {
        name,
        format,
        width: ROW_TEXELS as u32,
        height: rows as u32,
        layers: 1,
        mips: 1,
        samples: 1,
        usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
    })?;
    uploader.image(&image, 0, 0, &bytes)?;
    Ok(image)
}

/// Rows of an image of so many records; the device refuses more than it takes, by the image's name.
fn record_rows(records: usize, stride_texels: usize) -> usize {
    (records * stride_texels).div_ceil(ROW_TEXELS).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What an image of 16,384 rows holds: lights and draws of four texels, materials of eight.
    #[test]
    fn records_of_an_image_of_16384_rows() {
        assert_eq!(record_rows(0, 4), 1);
        assert_eq!([4_194_304, 4_194_305].map(|lights| record_rows(lights, 4)), [16_384, 16_385]);
        assert_eq!([2_097_152, 2_097_153].map(|materials| record_rows(materials, 8)), [16_384, 16_385]);
    }
}
