//! Materials as shaders read them.

use afterlight_scene::{AlphaMode, Image, Material, TextureRef};
use afterlight_shader::structs::{MATERIAL_DOUBLE_SIDED, MATERIAL_UNLIT, MaterialData, NO_TEXTURE};

use crate::scene::textures::{Role, TextureTable};

pub(super) fn uses_uv1(materials: &[Material]) -> bool {
    materials.iter().any(|m| slots(m).iter().any(|(t, _)| t.is_some_and(|t| t.uv_set == 1)))
}

/// A material's textures in the order of the slots in `MaterialData`.
pub(super) fn slots(m: &Material) -> [(Option<TextureRef>, Role); 5] {
    [
        (m.base_color_texture, Role::BaseColor),
        (m.metallic_roughness_texture, Role::Data),
        (m.normal_texture, Role::Normal),
        (m.occlusion_texture, Role::Data),
        (m.emissive_texture, Role::Emissive),
    ]
}

const IDENTITY_TRANSFORM: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// Material records and the rows of all texture transforms, five transforms for each material that has one.
pub(super) fn material_records(
    materials: &[Material],
    table: &TextureTable,
) -> (Vec<MaterialData>, Vec<[f32; 4]>) {
    let mut transforms = Vec::new();
    let records = materials
        .iter()
        .map(|m| {
            let slots = slots(m);
            let first = (transforms.len() / 2) as u32;
            let transformed = |t: &TextureRef| t.uv_transform != IDENTITY_TRANSFORM;
            if slots.iter().any(|(t, _)| t.as_ref().is_some_and(transformed)) {
                for (t, _) in &slots {
                    let rows = t.map_or(IDENTITY_TRANSFORM, |t| t.uv_transform);
                    transforms.extend(rows.map(|[a, b, c]| [a, b, c, 0.0]));
                }
            }
            let [base_color, metallic_roughness, normal, occlusion, emissive] = slots.map(|(t, role)| {
                t.map_or(NO_TEXTURE, |t| {
                    table.slot(&t, role) | t.uv_set.min(1) << 24 | u32::from(transformed(&t)) << 25
                })
            });
            MaterialData {
                base_color_factor: m.base_color_factor,
                emissive_factor: m.emissive_factor,
                alpha_cutoff: if let AlphaMode::Mask { cutoff } = m.alpha_mode { cutoff } else { 0.0 },
                metallic_factor: m.metallic_factor,
                roughness_factor: m.roughness_factor,
                normal_scale: m.normal_scale,
                occlusion_strength: m.occlusion_strength,
                flags: (u32::from(m.unlit) * MATERIAL_UNLIT)
                    | (u32::from(m.double_sided) * MATERIAL_DOUBLE_SIDED),
                uv_transform: first,
                base_color_slot: base_color,
                metallic_roughness_slot: metallic_roughness,
                normal_slot: normal,
                occlusion_slot: occlusion,
                emissive_slot: emissive,
                _padding: 0,
            }
        })
        .collect();
    (records, transforms)
}

/// Names of images for messages.
pub(super) fn image_name(images: &[Image], index: u32) -> &str {
    images.get(index as usize).map_or("image", |i| i.name.as_str())
}
