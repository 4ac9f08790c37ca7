//! `afterlight devices`

use std::fmt::Write as _;

use afterlight_graph::gpu::{Device, DeviceInfo, Features};
use afterlight_techniques::registry;
use serde_json::{Value, json};

use crate::args::ListArgs;
use crate::failure::{Failure, INSTALL_DEVICE};
use crate::output;

pub fn run(args: &ListArgs) -> Result<(), Failure> {
    let devices = Device::enumerate()?;
    if devices.is_empty() {
        return Err(Failure::NoDevice(format!("no Vulkan device; {INSTALL_DEVICE}")));
    }
    let list: Vec<Value> =
        devices.iter().map(|(info, features, missing)| device_json(info, features, missing)).collect();
    output::json(&args.json, &json!({ "schema": 1, "devices": list }))?;
    if !args.json.on_stdout() {
        for (info, features, missing) in &devices {
            output::print(&device_text(info, features, missing));
        }
    }
    Ok(())
}

/// Sample counts of a bit mask.
fn counts(mask: u32) -> Vec<u32> {
    (0..7).map(|bit| 1 << bit).filter(|count| mask & count != 0).collect()
}

/// What techniques of the literature may ask for beyond the common ground.
fn optional(features: &Features) -> Vec<(&'static str, bool)> {
    vec![
        ("descriptor indexing", features.descriptor_indexing),
        ("post-depth coverage", features.post_depth_coverage),
        ("fragment barycentrics", features.fragment_barycentric),
        ("mesh shaders", features.mesh_shader),
        ("fragment shading rate", features.fragment_shading_rate),
        ("fragment interlock", features.fragment_interlock_pixel),
        ("geometry shaders", features.geometry_shader),
        ("tessellation shaders", features.tessellation_shader),
        ("pipeline statistics", features.pipeline_statistics),
        ("64-bit buffer atomics", features.buffer_int64_atomics),
        ("multisampled storage images", features.storage_image_multisample),
        ("timestamps", features.timestamp_valid_bits > 0),
    ]
}

/// What techniques do where the device lacks a feature that they would use.
fn fallbacks(features: &Features) -> Vec<(&'static str, &'static str)> {
    let multisampled_integer = features.sample_counts_integer & !1 != 0;
    let all = [
        (
            features.post_depth_coverage,
            "post-depth coverage",
            "gbuffer-list fills its lists in compute, from the triangle IDs of the samples",
        ),
        (multisampled_integer, "multisampled integer colour", "triangle IDs of samples are stored as RGBA8"),
        (
            features.buffer_int64_atomics && features.shader_int64,
            "64-bit buffer atomics",
            "triangles are found by raster passes alone",
        ),
    ];
    all.into_iter().filter(|(is, ..)| !is).map(|(_, lacks, instead)| (lacks, instead)).collect()
}

fn device_json(info: &DeviceInfo, features: &Features, missing: &[&str]) -> Value {
    let techniques: Vec<Value> = registry()
        .iter()
        .map(|technique| {
            let lacks = technique.missing(features);
            let available = missing.is_empty() && lacks.is_empty();
            json!({ "technique": technique.info().id, "available": available, "missing": lacks })
        })
        .collect();
    let optional: serde_json::Map<String, Value> = optional(features)
        .into_iter()
        .map(|(name, there)| (name.replace([' ', '-'], "_"), there.into()))
        .collect();
    json!({
        "index": info.index,
        "name": info.name,
        "driver": info.driver,
        "api": info.api,
        "type": info.kind,
        "usable": missing.is_empty(),
        "missing": missing,
        "features": optional,
        "fallbacks": fallbacks(features)
            .into_iter()
            .map(|(lacks, instead)| json!({ "lacks": lacks, "instead": instead }))
            .collect::<Vec<_>>(),
        "subgroup_size": features.subgroup_size,
        "samples": {
            "color": counts(features.sample_counts_color),
            "depth": counts(features.sample_counts_depth),
            "integer": counts(features.sample_counts_integer),
        },
        "techniques": techniques,
    })
}

fn device_text(info: &DeviceInfo, features: &Features, missing: &[&str]) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{}: {} ({}), driver {}, Vulkan {}",
        info.index, info.name, info.kind, info.driver, info.api
    );
    if !missing.is_empty() {
        let _ = writeln!(text, "   not usable: lacks {}", missing.join(", "));
    }
    let there = |wanted: bool| -> String {
        let names: Vec<_> =
            optional(features).into_iter().filter(|(_, is)| *is == wanted).map(|(name, _)| name).collect();
        if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
    };
    let _ = writeln!(text, "   has    {}", there(true));
    let _ = writeln!(text, "   lacks  {}", there(false));
    let list = |mask| counts(mask).iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    let _ = writeln!(
        text,
        "   samples a pixel: colour {}; depth {}; integer colour {}",
        list(features.sample_counts_color),
        list(features.sample_counts_depth),
        list(features.sample_counts_integer)
    );
    for (lacks, instead) in fallbacks(features) {
        let _ = writeln!(text, "   without {lacks}: {instead}");
    }
    for technique in registry() {
        let lacks = technique.missing(features);
        let verdict = match (missing.is_empty(), lacks.is_empty()) {
            (false, _) => "no: the device is not usable".to_owned(),
            (true, true) => "runs".to_owned(),
            (true, false) => format!("no: lacks {}", lacks.join(", ")),
        };
        let _ = writeln!(text, "   {:<20} {verdict}", technique.info().id);
    }
    text
}
