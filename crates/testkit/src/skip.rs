//! Tests that cannot run: told, counted, and failed where what they need is expected to be there.
//!
//! `AFTERLIGHT_EXPECTS` names what a run of the tests must find, such as `device scenes`; a test that lacks one of these fails. Without it,
//! the test passes and says on standard error what it did not do. `AFTERLIGHT_SKIPS` names a file that gets a line for each; `./test` sets
//! both and tells the lines at its end.

use std::{fs::OpenOptions, io::Write, path::PathBuf};

/// What a test may need and a machine may lack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// A Vulkan device.
    Device,
    /// The folder of real scenes beside the repository.
    Scenes,
    /// Tessellation and geometry shaders, and stores in them.
    Tessellation,
    /// Four samples a pixel.
    FourSamples,
    /// Two or eight samples a pixel.
    OtherSamples,
    /// A compute pipeline that asks for a size of its subgroups.
    SubgroupSizes,
    /// Timestamps.
    Timestamps,
    /// Pipeline statistics.
    Statistics,
    /// What visibility by rasterisation in compute takes: atomics of 64 bits.
    ComputeVisibility,
    /// A binding of more than 128 MiB.
    LargeBindings,
    /// A limit that a test can reach with the memory there is.
    ReachableLimit,
}

impl Need {
    /// Its name in `AFTERLIGHT_EXPECTS` and in lines about skipped tests.
    pub fn name(self) -> &'static str {
        match self {
            Self::Device => "device",
            Self::Scenes => "scenes",
            Self::Tessellation => "tessellation",
            Self::FourSamples => "4-samples",
            Self::OtherSamples => "2-and-8-samples",
            Self::SubgroupSizes => "subgroup-sizes",
            Self::Timestamps => "timestamps",
            Self::Statistics => "statistics",
            Self::ComputeVisibility => "compute-visibility",
            Self::LargeBindings => "large-bindings",
            Self::ReachableLimit => "reachable-limit",
        }
    }
}

/// Tells that the running test leaves something out for want of `need`; `found` says what there is instead.
///
/// # Panics
/// Where `AFTERLIGHT_EXPECTS` names the need.
#[track_caller]
pub fn skip(need: Need, found: &str) {
    let expected = std::env::var("AFTERLIGHT_EXPECTS").unwrap_or_default();
    assert!(!is_expected(&expected, need), "AFTERLIGHT_EXPECTS has {}: found {found}", need.name());
    let thread = std::thread::current();
    let line = format!("skipped: {}: {}: {found}\n", thread.name().unwrap_or("a test"), need.name());
    // Not `eprintln`: the test harness would keep it from whoever runs the tests.
    let _ = std::io::stderr().write_all(line.as_bytes());
    if let Some(file) = std::env::var_os("AFTERLIGHT_SKIPS") {
        let opened = OpenOptions::new().create(true).append(true).open(&file);
        let written = opened.and_then(|mut file| file.write_all(line.as_bytes()));
        written.unwrap_or_else(|error| panic!("AFTERLIGHT_SKIPS={}: {error}", file.display()));
    }
}

/// Whether a list of names, parted by spaces or commas, has a need's.
fn is_expected(names: &str, need: Need) -> bool {
    names.split([' ', ',']).any(|name| name == need.name())
}

/// The folder of real scenes beside the repository, or `None`, told, where it is absent.
///
/// # Panics
/// Where it is absent and expected.
#[track_caller]
pub fn shared_scenes() -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if path.is_dir() {
        return Some(path);
    }
    skip(Need::Scenes, "no folder ../shared/scenes beside the repository");
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_expected_is_named_in_full() {
        assert!(is_expected("device scenes", Need::Scenes) && is_expected("device,scenes", Need::Scenes));
        assert!(!is_expected("", Need::Scenes) && !is_expected("scene", Need::Scenes));
        assert!(!is_expected("device tessellation", Need::Scenes));
    }
}
