//! GPU test harness: one validated device a process, its messages checked after every test.

use std::{
    io::Write,
    path::PathBuf,
    sync::{Mutex, MutexGuard, OnceLock, PoisonError},
};

use afterlight_gpu::{Device, DeviceOptions};

static DEVICE: OnceLock<Device> = OnceLock::new();
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// A test's hold of the device: tests take turns, so that a validation message belongs to the test that caused it.
pub struct GpuTest {
    device: Device,
    _turn: MutexGuard<'static, ()>,
}

/// Opens the process's device, with validation and synchronization checks, and waits for its turn. `AFTERLIGHT_DEVICE`
/// picks a device by index or name.
///
/// # Panics
/// Without a Vulkan device or the validation layer: a test that needs them must not pass without.
pub fn gpu() -> GpuTest {
    let turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let device = DEVICE.get_or_init(|| {
        let options = DeviceOptions {
            select: std::env::var("AFTERLIGHT_DEVICE").ok(),
            validate: true,
            ..DeviceOptions::default()
        };
        Device::open(&options)
            .unwrap_or_else(|e| panic!("tests need a Vulkan device and the validation layer: {e}"))
    });
    device.validation_messages();
    GpuTest { device: device.clone(), _turn: turn }
}

impl std::ops::Deref for GpuTest {
    type Target = Device;
    fn deref(&self) -> &Device {
        &self.device
    }
}

impl Drop for GpuTest {
    /// Fails the test on any validation message.
    fn drop(&mut self) {
        let messages = self.device.validation_messages();
        if !std::thread::panicking() {
            assert!(messages.is_empty(), "validation messages:\n{}", messages.join("\n"));
        }
    }
}

/// The folder of real scenes beside the repository, or `None`, said on standard error, where it is absent.
pub fn shared_scenes() -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if path.is_dir() {
        return Some(path);
    }
    // Not `eprintln`: the test harness would keep it from whoever runs the tests.
    let _ = writeln!(std::io::stderr(), "skipped: no folder ../shared/scenes beside the repository");
    None
}
