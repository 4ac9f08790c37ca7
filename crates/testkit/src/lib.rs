//! GPU test harness: one validated device a process, its messages checked after every test.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use afterlight_gpu::{Device, DeviceOptions};

mod skip;

pub use skip::{Need, shared_scenes, skip};

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

/// Those of `counts` samples a pixel that a device has; each that it lacks is told.
///
/// # Panics
/// Where a lacking one is expected.
#[track_caller]
pub fn sample_counts(device: &Device, counts: &[u32]) -> Vec<u32> {
    let has = |count: &u32| {
        let there = *count == 1 || device.features().supports_samples(*count, false);
        if !there {
            let need = if *count == 4 { Need::FourSamples } else { Need::OtherSamples };
            skip(need, &format!("{} has no {count} samples a pixel", device.info().name));
        }
        there
    };
    counts.iter().copied().filter(has).collect()
}

/// Whether a device has what tessellated surfaces take; where not, that is told.
///
/// # Panics
/// Where it is expected.
#[track_caller]
pub fn has_tessellation(device: &Device) -> bool {
    let features = device.features();
    let there =
        features.tessellation_shader && features.geometry_shader && features.vertex_stores_and_atomics;
    if !there {
        skip(Need::Tessellation, &format!("{} has no tessellation", device.info().name));
    }
    there
}
