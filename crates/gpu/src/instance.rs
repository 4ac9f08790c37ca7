//! The loader, the instance and the log of validation messages.

use crate::GpuError;
use crate::features::{Detected, detect};
use ash::{ext, vk};
use std::collections::HashMap;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";
/// Messages kept of each kind: more of one kind say nothing new.
const MESSAGES_PER_ID: usize = 4;
/// Messages kept in all, so that a broken frame in a loop does not fill the memory.
const MESSAGES_MAX: usize = 100;

/// Warnings and errors of the validation layer, de-duplicated and capped.
#[derive(Default)]
pub(crate) struct ValidationLog(Mutex<LogState>);

#[derive(Default)]
struct LogState {
    messages: Vec<String>,
    count_by_id: HashMap<i32, usize>,
    left_out_count: usize,
}

impl ValidationLog {
    fn push(&self, id: i32, message: String) {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if state.messages.contains(&message) {
            return;
        }
        let seen_count = {
            let count = state.count_by_id.entry(id).or_default();
            *count += 1;
            *count
        };
        if seen_count > MESSAGES_PER_ID || state.messages.len() >= MESSAGES_MAX {
            state.left_out_count += 1;
        } else {
            state.messages.push(message);
        }
    }

    /// Takes what has been collected; a last line counts what was left out.
    pub fn drain(&self) -> Vec<String> {
        let mut state = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        if state.left_out_count > 0 {
            state.messages.push(format!("and {} more messages of the kinds above", state.left_out_count));
        }
        state.messages
    }
}

/// An instance with, where asked for, validation.
pub(crate) struct Instance {
    pub raw: ash::Instance,
    pub log: Arc<ValidationLog>,
    /// Whether `VK_EXT_debug_utils` is enabled: names and labels may be given.
    pub has_debug_utils: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// Whether another program owns it.
    is_adopted: bool,
}

/// The loader, opened once for the life of the process: unloading it would unload drivers that keep threads.
fn entry() -> Result<&'static ash::Entry, GpuError> {
    static ENTRY: OnceLock<Result<ash::Entry, String>> = OnceLock::new();
    ENTRY
        // SAFETY: the library found under the loader's name is the Vulkan loader, and is never unloaded.
        .get_or_init(|| unsafe { ash::Entry::load() }.map_err(|e| e.to_string()))
        .as_ref()
        .map_err(|reason| GpuError::NoLoader { reason: reason.clone() })
}

impl Instance {
    pub fn new(validate: bool) -> Result<Instance, GpuError> {
        let entry = entry()?;
        // SAFETY: the loader is open for the life of the process; so for every call of this function.
        let version = unsafe { entry.try_enumerate_instance_version() }
            .map_err(GpuError::call("vkEnumerateInstanceVersion"))?
            .unwrap_or(vk::API_VERSION_1_0);
        if version < vk::API_VERSION_1_1 {
            return Err(GpuError::NoLoader {
                reason: "the installed loader knows Vulkan 1.0 alone".to_owned(),
            });
        }
        if validate {
            require_validation_layer(entry)?;
        }
        // Asking the loader which extensions there are makes it load and unload every driver, 50 ms with lavapipe; so
        // debug names and labels, which every loader since 2018 has, are asked for outright.
        match Instance::create(entry, validate, true) {
            Err(GpuError::Vulkan { result: vk::Result::ERROR_EXTENSION_NOT_PRESENT, .. }) if !validate => {
                Instance::create(entry, validate, false)
            }
            created => created,
        }
    }

    fn create(entry: &ash::Entry, validate: bool, has_debug_utils: bool) -> Result<Instance, GpuError> {
        let mut layers = Vec::new();
        let mut extensions = Vec::new();
        if has_debug_utils {
            extensions.push(ext::debug_utils::NAME.as_ptr());
        }
        if validate {
            layers.push(VALIDATION_LAYER.as_ptr());
            extensions.push(ext::validation_features::NAME.as_ptr());
        }
        let log = Arc::new(ValidationLog::default());
        let application = vk::ApplicationInfo::default()
            .application_name(c"afterlight")
            .engine_name(c"afterlight")
            .api_version(vk::API_VERSION_1_3);
        let synchronization = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut validation =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&synchronization);
        let mut messenger_info = messenger_info(&log);
        let mut create = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        if validate {
            create = create.push_next(&mut validation).push_next(&mut messenger_info);
        }
        // SAFETY: `create` and what it points to live until the call returns.
        let raw = unsafe { entry.create_instance(&create, None) }.map_err(|result| match result {
            vk::Result::ERROR_LAYER_NOT_PRESENT => GpuError::NoValidationLayer,
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => {
                GpuError::NoDevice { wanted: "any device".to_owned(), found: "none (no driver)".to_owned() }
            }
            result => GpuError::Vulkan { call: "vkCreateInstance", result },
        })?;
        let mut instance = Instance { raw, log, has_debug_utils, messenger: None, is_adopted: false };
        if validate {
            let debug = ext::debug_utils::Instance::new(entry, &instance.raw);
            let info = self::messenger_info(&instance.log);
            // SAFETY: the log that the callback reaches is dropped after the messenger (see `Drop`).
            let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }
                .map_err(GpuError::call("vkCreateDebugUtilsMessengerEXT"))?;
            instance.messenger = Some((debug, messenger));
        }
        Ok(instance)
    }

    /// An instance that another program owns.
    pub fn adopted(raw: ash::Instance, has_debug_utils: bool) -> Instance {
        let log = Arc::new(ValidationLog::default());
        Instance { raw, log, has_debug_utils, messenger: None, is_adopted: true }
    }

    /// All physical devices in the loader's order, examined.
    pub fn devices(&self) -> Result<Vec<(vk::PhysicalDevice, Detected)>, GpuError> {
        // SAFETY: the instance is alive.
        let physical = match unsafe { self.raw.enumerate_physical_devices() } {
            Ok(physical) => physical,
            // A loader without a single working driver says so in this way.
            Err(vk::Result::ERROR_INITIALIZATION_FAILED) => Vec::new(),
            Err(result) => return Err(GpuError::Vulkan { call: "vkEnumeratePhysicalDevices", result }),
        };
        Ok(physical.into_iter().enumerate().map(|(i, p)| (p, detect(&self.raw, p, i as u32))).collect())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: whoever made children of the instance owns an `Instance` and drops it after them.
        unsafe {
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            if !self.is_adopted {
                self.raw.destroy_instance(None);
            }
        }
    }
}

fn require_validation_layer(entry: &ash::Entry) -> Result<(), GpuError> {
    // SAFETY: the loader is open.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .map_err(GpuError::call("vkEnumerateInstanceLayerProperties"))?;
    if layers.iter().any(|l| l.layer_name_as_c_str() == Ok(VALIDATION_LAYER)) {
        Ok(())
    } else {
        Err(GpuError::NoValidationLayer)
    }
}

fn messenger_info(log: &Arc<ValidationLog>) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(
            vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
        )
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(log).cast_mut().cast())
}

/// Called by the layer, on whichever thread made the offending call.
unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: `user` is the log given in `messenger_info`, which outlives the messenger; `data` is valid for this call.
    let (log, data) = unsafe { (&*user.cast::<ValidationLog>().cast_const(), &*data) };
    let text = if data.p_message.is_null() {
        String::new()
    } else {
        // SAFETY: the layer gives a terminated string, valid for this call.
        unsafe { CStr::from_ptr(data.p_message) }.to_string_lossy().into_owned()
    };
    let kind =
        if severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR) { "error" } else { "warning" };
    log.push(data.message_id_number, format!("{kind}: {text}"));
    vk::FALSE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_drops_repeats_and_counts_what_it_leaves_out() {
        let log = ValidationLog::default();
        log.push(1, "same".to_owned());
        log.push(1, "same".to_owned());
        assert_eq!(log.drain(), ["same"]);
        for i in 0..10 {
            log.push(7, format!("message {i}"));
        }
        let messages = log.drain();
        assert_eq!(messages.len(), MESSAGES_PER_ID + 1);
        assert!(messages[MESSAGES_PER_ID].contains("6 more"), "{messages:?}");
        assert!(log.drain().is_empty());
    }
}
