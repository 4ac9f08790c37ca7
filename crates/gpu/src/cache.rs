//! The pipeline cache on disk.
//!
//! A driver may crash on a damaged cache or on that of another driver, so the file carries a checksum beside the header that
//! Vulkan prescribes (`VkPipelineCacheHeaderVersionOne`), and both are checked before the driver sees the data.

use crate::DeviceInfo;
use std::io::Write;
use std::path::Path;

/// Marks the file and its version; a change of the layout below changes it.
const MAGIC: [u8; 8] = *b"ALPIPE01";
/// Magic, checksum, payload length.
const PREFIX_BYTES: usize = 8 + 8 + 8;
/// `VkPipelineCacheHeaderVersionOne`: length, version, vendor, device, UUID.
const HEADER_BYTES: usize = 4 * 4 + 16;

/// Name of the cache file of the device and driver build with this UUID.
pub(crate) fn file_name(uuid: &[u8; 16]) -> String {
    let hex: String = uuid.iter().map(|b| format!("{b:02x}")).collect();
    format!("pipelines-{hex}.bin")
}

/// The driver's data out of a cache file; `None` where it is damaged or of another device.
pub(crate) fn unwrap<'a>(file: &'a [u8], info: &DeviceInfo) -> Option<&'a [u8]> {
    let (prefix, data) = file.split_at_checked(PREFIX_BYTES)?;
    let word = |at: usize| prefix[at..at + 8].try_into().map(u64::from_le_bytes).ok();
    let intact = prefix[..8] == MAGIC && word(16)? == data.len() as u64 && word(8)? == checksum(data, info);
    (intact && is_of_device(data, info)).then_some(data)
}

/// A cache file with the driver's `data`.
pub(crate) fn wrap(data: &[u8], info: &DeviceInfo) -> Vec<u8> {
    let mut file = Vec::with_capacity(PREFIX_BYTES + data.len());
    file.extend_from_slice(&MAGIC);
    file.extend_from_slice(&checksum(data, info).to_le_bytes());
    file.extend_from_slice(&(data.len() as u64).to_le_bytes());
    file.extend_from_slice(data);
    file
}

/// Writes beside `path`, then renames: the file is complete or absent, also when two programs end at once.
pub(crate) fn write(path: &Path, file: &[u8]) -> std::io::Result<()> {
    if let Some(dir) = path.parent() {
        std::fs::create_dir_all(dir)?;
    }
    let beside = path.with_extension(format!("{}.part", std::process::id()));
    let written = std::fs::File::create(&beside).and_then(|mut f| f.write_all(file));
    let renamed = written.and_then(|()| std::fs::rename(&beside, path));
    if renamed.is_err() {
        // The temporary file is useless now. If it cannot be removed either, the first error is still the one to report.
        let _ = std::fs::remove_file(&beside);
    }
    renamed
}

/// Whether Vulkan's header in `data` names this device and driver build.
fn is_of_device(data: &[u8], info: &DeviceInfo) -> bool {
    let Some(header) = data.get(..HEADER_BYTES) else { return false };
    let word = |i: usize| {
        u32::from_le_bytes([header[4 * i], header[4 * i + 1], header[4 * i + 2], header[4 * i + 3]])
    };
    word(0) as usize >= HEADER_BYTES
        && word(1) == 1
        && word(2) == info.vendor_id
        && word(3) == info.device_id
        && header[16..32] == info.pipeline_cache_uuid
}

/// FNV-1a, 64 bits, over the driver's version and the data: Mesa 22.3 gives every build of lavapipe the same UUID.
/// Source: Fowler, Noll, Vo.
fn checksum(data: &[u8], info: &DeviceInfo) -> u64 {
    let bytes = info.driver.as_bytes().iter().chain(data);
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info() -> DeviceInfo {
        DeviceInfo {
            index: 0,
            name: "test".to_owned(),
            driver: String::new(),
            api: String::new(),
            kind: "cpu",
            vendor_id: 7,
            device_id: 9,
            pipeline_cache_uuid: [3; 16],
        }
    }

    fn driver_data() -> Vec<u8> {
        let mut data = Vec::new();
        for word in [32u32, 1, 7, 9] {
            data.extend_from_slice(&word.to_le_bytes());
        }
        data.extend_from_slice(&[3; 16]);
        data.extend_from_slice(b"pipelines");
        data
    }

    #[test]
    fn round_trip() {
        let data = driver_data();
        assert_eq!(unwrap(&wrap(&data, &info()), &info()), Some(&data[..]));
    }

    #[test]
    fn damage_anywhere_is_noticed() {
        let file = wrap(&driver_data(), &info());
        for at in 0..file.len() {
            let mut damaged = file.clone();
            damaged[at] ^= 0x40;
            assert!(unwrap(&damaged, &info()).is_none(), "byte {at}");
            assert!(unwrap(&file[..at], &info()).is_none(), "cut at {at}");
        }
    }

    #[test]
    fn another_device_or_driver_is_refused() {
        let file = wrap(&driver_data(), &info());
        assert!(unwrap(&file, &DeviceInfo { pipeline_cache_uuid: [4; 16], ..info() }).is_none());
        assert!(unwrap(&file, &DeviceInfo { driver: "next".to_owned(), ..info() }).is_none());
    }
}
