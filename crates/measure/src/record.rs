//! The JSON of `compare` and `bench`.

use std::collections::BTreeMap;

use afterlight_roles::{BufferRole, PassRole, PassWork};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::Spread;

/// Version of the JSON that [`Run`] is written as.
pub const SCHEMA: u32 = 1;

/// What stands for the infinite PSNR of two equal images, since JSON has no infinity. Every other PSNR of 8-bit images is
/// far below: one channel of one pixel off by one in 65,536² pixels gives 150 dB.
pub const PSNR_IDENTICAL_DB: f64 = 999.0;

/// Named numbers.
pub type Counters = BTreeMap<String, Value>;

/// A run of one or more techniques over one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Where it ran.
    pub device: DeviceRecord,
    /// What was rendered.
    pub scene: SceneRecord,
    /// How.
    pub settings: SettingsRecord,
    /// One a technique.
    pub results: Vec<RunResult>,
    /// What the whole process took, where it did nothing but render one image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub process: Option<ProcessRecord>,
}

/// What a process took from its start to its first image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProcessRecord {
    /// Reading the scene while the device opens, ms.
    pub load_ms: f64,
    /// Decoding textures and copying the scene to the device, ms.
    pub upload_ms: f64,
    /// From the program's start to the image in its file, ms.
    pub first_image_ms: f64,
    /// The most memory that the process held, bytes; none where the system does not tell.
    pub peak_resident_bytes: Option<u64>,
}

/// A Vulkan device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceRecord {
    /// Its name.
    pub name: String,
    /// Its driver and the driver's version.
    pub driver: String,
    /// Vulkan version.
    pub api: String,
    /// `cpu`, `discrete`, `integrated`, `virtual` or `other`.
    #[serde(rename = "type")]
    pub kind: String,
}

/// A scene's size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneRecord {
    /// File or built-in name.
    pub name: String,
    /// Triangles of all draws.
    pub triangles: u64,
    /// Draws.
    pub draws: u64,
    /// Lights that shaded it.
    pub lights: u64,
}

/// Settings that all techniques of a run share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SettingsRecord {
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Samples a pixel.
    pub samples: u32,
    /// Frames measured after a warm-up frame.
    pub frames: u32,
    /// Camera.
    pub camera: String,
    /// Technique that images are compared to.
    pub reference: String,
    /// Anti-aliasing after shading: `none`, `fxaa`, `smaa` or `sraa`.
    #[serde(default = "none")]
    pub post: String,
    /// Length on screen of the edges that surfaces were tessellated to, pixels; none without tessellation.
    #[serde(default)]
    pub tessellate_px: Option<f32>,
    /// How far tessellated surfaces were displaced along each axis at most, mm.
    #[serde(default)]
    pub displacement_mm: f32,
    /// Indirect light: `none` or `rsm`.
    #[serde(default = "none")]
    pub indirect: String,
    /// Width and height of the reflective shadow map, texels; none where there is none.
    #[serde(default)]
    pub rsm_size: Option<u32>,
    /// Shadows: `none` or `map`.
    #[serde(default = "none")]
    pub shadows: String,
    /// Width and height of the shadow map, texels; none where there is none.
    #[serde(default)]
    pub shadow_map_size: Option<u32>,
    /// Surfaces with alpha blending: `none` or `sorted`.
    #[serde(default = "none")]
    pub transparency: String,
    /// Seed of the lights; none where the scene's own lights shade.
    pub light_seed: Option<u64>,
    /// Version of the program.
    pub version: String,
}

/// What records from before there was a choice had.
fn none() -> String {
    "none".to_owned()
}

/// How a technique's run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// It ran, and its image is within its bound.
    Ok,
    /// The device cannot run it.
    Unavailable,
    /// It broke off, or its image is off.
    Failed,
}

/// One technique's figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunResult {
    /// Its id.
    pub technique: String,
    /// Every parameter with its value.
    pub params: BTreeMap<String, Value>,
    /// How it ended.
    pub status: Status,
    /// Why it is not `ok`.
    pub reason: Option<String>,
    /// GPU time of a frame, ms.
    pub frame_ms: Option<Spread>,
    /// CPU time to record a frame's commands, ms.
    pub record_ms: Option<Spread>,
    /// Its passes in order.
    pub passes: Vec<Pass>,
    /// What it allocates.
    pub memory: Option<Memory>,
    /// What it counts.
    pub counters: Counters,
    /// Predicted costs.
    pub cost: Option<CostRecord>,
    /// How far its image is from the reference's.
    pub difference: Option<Difference>,
}

impl RunResult {
    /// Returns a result without figures.
    pub fn without_figures(technique: &str, status: Status, reason: impl Into<String>) -> RunResult {
        RunResult {
            technique: technique.to_owned(),
            params: BTreeMap::new(),
            status,
            reason: Some(reason.into()),
            frame_ms: None,
            record_ms: None,
            passes: Vec::new(),
            memory: None,
            counters: Counters::new(),
            cost: None,
            difference: None,
        }
    }
}

/// One pass of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// `technique/stage`, or `shared/stage` for work that is not the technique's own.
    pub name: String,
    /// What it is for; none in records from before there were roles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub role: Option<PassRole>,
    /// By what kind of commands the device does it; none in records from before there were roles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub work: Option<PassWork>,
    /// GPU time, ms.
    pub ms: Option<Spread>,
    /// What it reads of the buffers and images that the frame allocates, scene data left out. Bytes are of the whole resource.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reads: Vec<Buffer>,
    /// What it writes of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub writes: Vec<Buffer>,
    /// Pipeline statistics of one frame (`fragment_invocations`, `vertex_invocations`, …), beside the other fields.
    #[serde(flatten)]
    pub statistics: BTreeMap<String, u64>,
}

/// What a technique allocates, bytes as the allocator counts them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// What it adds to the final colour target.
    pub technique_bytes: u64,
    /// What is allocated at once, with resources that share memory counted once.
    pub peak_bytes: u64,
    /// Every buffer and image of its own.
    pub buffers: Vec<Buffer>,
}

/// A buffer or image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Buffer {
    /// Its name.
    pub name: String,
    /// What it holds; none in records from before there were roles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub role: Option<BufferRole>,
    /// Its size, bytes.
    pub bytes: u64,
}

/// Predicted costs of a frame (Petrescu et al. 2016, section 4).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CostRecord {
    /// Commands given to the device.
    pub cmd: f64,
    /// Processing.
    pub proc: f64,
    /// Memory, bytes.
    pub mem: f64,
    /// Memory traffic, bytes.
    pub band: f64,
}

/// Difference of two images after tone mapping, 8 bits a channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Peak signal-to-noise ratio, dB; [`PSNR_IDENTICAL_DB`] for equal images.
    pub psnr_db: f64,
    /// Greatest difference of a channel, 0 to 255.
    pub max_abs: u32,
    /// Mean FLIP error, 0 to 1.
    pub flip: Option<f64>,
}

impl Difference {
    /// Returns the PSNR with equal images as infinity.
    pub fn psnr_or_infinity_db(&self) -> f64 {
        if self.psnr_db >= PSNR_IDENTICAL_DB { f64::INFINITY } else { self.psnr_db }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run() -> Run {
        let mut result = RunResult::without_figures("tiled", Status::Ok, "");
        result.reason = None;
        result.frame_ms = Spread::of(&[1.0, 2.0, 4.0]);
        result.passes = vec![Pass {
            name: "tiled/shade".into(),
            role: Some(PassRole::Shading),
            work: Some(PassWork::Compute),
            ms: Spread::of(&[1.0]),
            reads: vec![Buffer { name: "tiled/list".into(), role: Some(BufferRole::Lights), bytes: 10 }],
            writes: Vec::new(),
            statistics: BTreeMap::from([("fragment_invocations".into(), 7)]),
        }];
        result.memory = Some(Memory {
            technique_bytes: 10,
            peak_bytes: 20,
            buffers: vec![Buffer { name: "tiled/list".into(), role: Some(BufferRole::Lights), bytes: 10 }],
        });
        result.cost = Some(CostRecord { cmd: 1.0, proc: 2.0, mem: 3.0, band: 4.0 });
        result.difference = Some(Difference { psnr_db: 51.5, max_abs: 2, flip: Some(0.001) });
        Run {
            schema: SCHEMA,
            device: DeviceRecord {
                name: "llvmpipe".into(),
                driver: "Mesa".into(),
                api: "1.3.230".into(),
                kind: "cpu".into(),
            },
            scene: SceneRecord { name: "s".into(), triangles: 1, draws: 2, lights: 3 },
            settings: SettingsRecord {
                width: 4,
                height: 5,
                samples: 1,
                frames: 3,
                camera: "0".into(),
                reference: "forward".into(),
                post: "smaa".into(),
                tessellate_px: None,
                displacement_mm: 0.0,
                indirect: "none".into(),
                rsm_size: None,
                shadows: "none".into(),
                shadow_map_size: None,
                transparency: "none".into(),
                light_seed: Some(1),
                version: "0".into(),
            },
            results: vec![result],
            process: None,
        }
    }

    #[test]
    fn json_has_the_names_of_the_contract() {
        let json: Value = serde_json::to_value(run()).expect("is JSON");
        assert_eq!(json["schema"], 1);
        assert_eq!(json["device"]["type"], "cpu");
        assert_eq!(json["scene"]["triangles"], 1);
        assert_eq!(json["settings"]["frames"], 3);
        let result = &json["results"][0];
        assert_eq!((&result["technique"], &result["status"]), (&"tiled".into(), &"ok".into()));
        assert!(result["reason"].is_null());
        assert_eq!(result["frame_ms"], serde_json::json!({"median": 2.0, "min": 1.0, "max": 4.0}));
        assert_eq!(result["passes"][0]["fragment_invocations"], 7);
        assert_eq!(result["passes"][0]["ms"]["median"], 1.0);
        assert_eq!(result["passes"][0]["role"], "shading");
        assert_eq!(result["passes"][0]["work"], "compute");
        assert_eq!(result["passes"][0]["reads"][0]["role"], "lights");
        assert_eq!(result["memory"]["buffers"][0]["role"], "lights");
        assert_eq!(result["passes"][0]["reads"][0]["bytes"], 10);
        assert_eq!(result["memory"]["buffers"][0]["bytes"], 10);
        assert_eq!(result["cost"]["band"], 4.0);
        assert_eq!(result["difference"]["psnr_db"], 51.5);
    }

    #[test]
    fn json_reads_back() {
        let text = serde_json::to_string(&run()).expect("is JSON");
        assert_eq!(serde_json::from_str::<Run>(&text).expect("reads"), run());
    }

    #[test]
    fn a_record_from_before_post_reads() {
        let mut json = serde_json::to_value(run()).expect("is JSON");
        json["settings"].as_object_mut().expect("is an object").remove("post");
        let old: Run = serde_json::from_value(json).expect("reads");
        assert_eq!(old.settings.post, "none");
    }

    #[test]
    fn a_record_from_before_roles_reads() {
        let pass: Pass = serde_json::from_value(serde_json::json!({
            "name": "tiled/shade", "ms": null, "fragment_invocations": 7,
            "reads": [{"name": "tiled/list", "bytes": 10}],
        }))
        .expect("reads");
        assert_eq!((pass.role, pass.work, pass.reads[0].role), (None, None, None));
        assert_eq!(pass.statistics["fragment_invocations"], 7);
        let written = serde_json::to_value(&pass).expect("is JSON");
        assert!(written.get("role").is_none() && written.get("work").is_none());
    }

    /// Every published record, whenever it was written.
    #[test]
    fn published_records_read() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/results");
        let mut runs = 0;
        for entry in std::fs::read_dir(folder).expect("is there") {
            let path = entry.expect("is there").path();
            if path.extension().is_none_or(|extension| extension != "json") {
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("reads");
            let json: Value = serde_json::from_str(&text).expect("is JSON");
            // The results of experiments have formats of their own.
            if json.get("settings").is_some()
                && json.get("results").is_some_and(|all| all[0].get("params").is_some())
            {
                let run: Run = serde_json::from_value(json).expect("is a run");
                runs += usize::from(!run.results.is_empty());
            }
        }
        assert!(runs > 0, "no run among the published records");
    }

    #[test]
    fn equal_images_are_infinite() {
        let same = Difference { psnr_db: PSNR_IDENTICAL_DB, max_abs: 0, flip: None };
        assert!(same.psnr_or_infinity_db().is_infinite());
        assert_eq!(Difference { psnr_db: 60.0, ..same }.psnr_or_infinity_db(), 60.0);
    }
}
