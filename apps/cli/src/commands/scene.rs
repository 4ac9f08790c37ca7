//! `afterlight scene`

use std::fmt::Write as _;

use afterlight_report::bytes_text;
use afterlight_report::text::grouped;
use afterlight_scene::{AlphaMode, LightKind, LoadOptions, Projection, Scene, VertexAttributes, load_source};
use serde_json::{Value, json};

use crate::args::SceneArgs;
use crate::failure::Failure;
use crate::output;

pub fn run(args: &SceneArgs) -> Result<(), Failure> {
    args.json.check()?;
    let scene = load_source(&args.scene, &LoadOptions { time_s: args.time })?;
    output::json(&args.json, &scene_json(&args.scene, &scene))?;
    if !args.json.on_stdout() {
        output::print(&scene_text(&scene));
    }
    Ok(())
}

/// Bytes of a scene's geometry, and of its textures with all mip levels at four bytes a texel.
struct MemoryUse {
    geometry_bytes: u64,
    texture_bytes: u64,
}

fn memory(scene: &Scene) -> MemoryUse {
    let vertices = scene.positions_os.len() as u64;
    let vertex_bytes = (size_of::<[f32; 3]>() + size_of::<VertexAttributes>()) as u64;
    MemoryUse {
        geometry_bytes: vertices * vertex_bytes + scene.indices.len() as u64 * 4,
        texture_bytes: scene.images.iter().map(|image| mip_texels(image.width, image.height) * 4).sum(),
    }
}

fn mip_texels(mut width: u32, mut height: u32) -> u64 {
    let mut texels = u64::from(width) * u64::from(height);
    while width > 1 || height > 1 {
        (width, height) = ((width / 2).max(1), (height / 2).max(1));
        texels += u64::from(width) * u64::from(height);
    }
    texels
}

/// Numbers of point, spot and directional lights.
fn light_counts(scene: &Scene) -> [usize; 3] {
    let count =
        |wanted: fn(&LightKind) -> bool| scene.lights.iter().filter(|light| wanted(&light.kind)).count();
    [
        count(|kind| matches!(kind, LightKind::Point)),
        count(|kind| matches!(kind, LightKind::Spot { .. })),
        count(|kind| matches!(kind, LightKind::Directional)),
    ]
}

fn scene_json(source: &str, scene: &Scene) -> Value {
    let [points, spots, directionals] = light_counts(scene);
    let bounds = scene.bounds_ws();
    let memory = memory(scene);
    let alpha = |wanted: fn(&AlphaMode) -> bool| {
        scene.materials.iter().filter(|material| wanted(&material.alpha_mode)).count()
    };
    let cameras: Vec<Value> = scene
        .cameras
        .iter()
        .enumerate()
        .map(|(index, camera)| {
            let eye = scene.file_from_world(camera.eye_ws());
            let projection = match camera.projection {
                Projection::Perspective { fov_y_rad, near_m } => {
                    json!({ "kind": "perspective", "fov_y_deg": fov_y_rad.to_degrees(), "near_m": near_m })
                }
                Projection::Orthographic { half_height_m, near_m, far_m } => {
                    json!({ "kind": "orthographic", "half_height_m": half_height_m, "near_m": near_m, "far_m": far_m })
                }
            };
            json!({ "index": index, "name": &*camera.name, "eye_ws": [eye.x, eye.y, eye.z], "projection": projection })
        })
        .collect();
    let corner = |corner_ws| match bounds.is_empty() {
        true => Value::Null,
        false => json!(scene.file_from_world(corner_ws).to_array()),
    };
    json!({
        "schema": 1,
        "source": source,
        "name": scene.name,
        "triangles": scene.triangle_count(),
        "draws": scene.instances.len(),
        "meshes": scene.meshes.len(),
        "vertices": scene.positions_os.len(),
        "materials": {
            "count": scene.materials.len(),
            "mask": alpha(|mode| matches!(mode, AlphaMode::Mask { .. })),
            "blend": alpha(|mode| matches!(mode, AlphaMode::Blend)),
            "double_sided": scene.materials.iter().filter(|material| material.double_sided).count(),
        },
        "textures": scene.images.len(),
        "lights": { "point": points, "spot": spots, "directional": directionals },
        "cameras": cameras,
        "animations": scene.animations.len(),
        "bounds_ws": { "min": corner(bounds.min), "max": corner(bounds.max) },
        "memory": { "geometry_bytes": memory.geometry_bytes, "texture_bytes": memory.texture_bytes },
        "warnings": scene.warnings,
    })
}

fn scene_text(scene: &Scene) -> String {
    let mut text = String::new();
    let [points, spots, directionals] = light_counts(scene);
    let (bounds, memory) = (scene.bounds_ws(), memory(scene));
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<11} {value}");
    };
    line("name", scene.name.clone());
    line("triangles", grouped(scene.triangle_count()));
    line("draws", format!("{} of {} meshes", grouped(scene.instances.len() as u64), scene.meshes.len()));
    line("vertices", grouped(scene.positions_os.len() as u64));
    line("materials", scene.materials.len().to_string());
    line("textures", scene.images.len().to_string());
    line("lights", format!("{points} point, {spots} spot, {directionals} directional"));
    for (index, camera) in scene.cameras.iter().enumerate() {
        let eye = scene.file_from_world(camera.eye_ws());
        line("camera", format!("{index} '{}' at {:.2}, {:.2}, {:.2} m", camera.name, eye.x, eye.y, eye.z));
    }
    if !scene.animations.is_empty() {
        line("animations", scene.animations.len().to_string());
    }
    let [min, max] = [bounds.min, bounds.max].map(|corner| scene.file_from_world(corner));
    line(
        "bounds",
        if bounds.is_empty() {
            "empty".to_owned()
        } else {
            format!("{:.2}, {:.2}, {:.2} to {:.2}, {:.2}, {:.2} m", min.x, min.y, min.z, max.x, max.y, max.z)
        },
    );
    line(
        "memory",
        format!(
            "{} geometry, {} textures",
            bytes_text(memory.geometry_bytes),
            bytes_text(memory.texture_bytes)
        ),
    );
    for warning in &scene.warnings {
        line("warning", warning.clone());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::mip_texels;

    #[test]
    fn mip_levels_end_at_one_texel() {
        assert_eq!(mip_texels(1, 1), 1);
        assert_eq!(mip_texels(4, 4), 16 + 4 + 1);
        assert_eq!(mip_texels(4, 1), 4 + 2 + 1);
    }
}
