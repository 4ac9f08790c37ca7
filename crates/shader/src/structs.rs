//! Structs that every technique's shaders share; their GLSL twins stand in `include/`.

use crate::shader_struct;

shader_struct! {
    /// What every pass of a frame knows (`include/frame.glsl`).
    pub struct FrameConstants {
        /// World to clip, columns.
        pub clip_from_world: [[f32; 4]; 4],
        /// Clip to world, columns.
        pub world_from_clip: [[f32; 4]; 4],
        /// View distance in metres of a depth d: (d x + y) / (d z + w).
        pub depth_to_distance: [f32; 4],
        /// View distance in metres of a world point p: dot(xyz, p) + w.
        pub distance_from_world: [f32; 4],
        /// Eye in world space and 1, or the direction to the eye and 0 under an orthographic camera.
        pub eye_ws: [f32; 4],
        /// Image size.
        pub size_px: [u32; 2],
        /// Tiles of 16×16 pixels in each direction.
        pub tile_count: [u32; 2],
        /// Radiance that reaches a surface from every direction.
        pub ambient_radiance: [f32; 3],
        /// Lights in the list.
        pub light_count: u32,
        /// Radiance of a pixel without a surface.
        pub background_radiance: [f32; 3],
        /// Lights without an end (directional, or no range): the first of the list.
        pub unbounded_light_count: u32,
        /// Nearest and farthest view distance that a surface of the scene can have, metres, the first above 0.
        pub distance_range_m: [f32; 2],
        /// Samples of a pixel.
        pub samples: u32,
        /// Number of the frame, modulo 2^32; 0 of a view alone.
        pub frame_index: u32,
        /// Time of the scene, s; 0 of a view alone.
        pub time_s: f32,
        /// What of the frame before is of use: `BEFORE_VIEW`, `BEFORE_HISTORY`; 0 after a cut.
        pub before: u32,
        /// World to clip of the frame before, columns; this frame's where none was before.
        pub clip_from_world_before: [[f32; 4]; 4],
    }

    /// How indirect light is gathered from a reflective shadow map (`include/indirect.glsl`).
    pub struct RsmConstants {
        /// World to clip of the light's view, columns.
        pub clip_from_world: [[f32; 4]; 4],
        /// Offset in shares of the map, area of the view's plane in m², unused.
        pub samples: [[f32; 4]; 64],
    }

    /// What a light reaches (`include/shadow.glsl`).
    pub struct ShadowConstants {
        /// World to texels of the shadow map and depth, homogeneous, columns.
        pub texel_from_world: [[f32; 4]; 4],
        /// Number of the light in the list.
        pub light_index: u32,
        /// Width and height of the map.
        pub size_px: u32,
    }

    /// Which draws a view needs, in which order (`shared/cull/choice.glsl` of the stages).
    pub struct DrawChoiceConstants {
        /// Half-spaces that a draw must reach: inside where dot(xyz, p) + w is not negative. Those that are not used hold every point.
        pub planes: [[f32; 4]; 8],
        /// View distance in metres of a world point p, by which its size on the image is: dot(xyz, p) + w.
        pub distance_from_world: [f32; 4],
        /// What distances are measured from.
        pub eye_ws: [f32; 3],
        /// How far surfaces may be displaced along each axis, m.
        pub displacement_m: f32,
        /// Draws whose diagonal over their least view distance is less are left out; 0 leaves out none.
        pub least_ratio: f32,
        /// What orders draws: `ORDER_…`.
        pub order: u32,
        /// Step of the farthest distance of the scene: draws at that distance are in the last bin.
        pub farthest_step: u32,
    }

    /// What of a draw its choice needs beside its record; two texels (`shared/cull/choice.glsl` of the stages).
    pub struct DrawBounds {
        /// Least corner, object space.
        pub min_os: [f32; 3],
        /// Indices, three a triangle.
        pub index_count: u32,
        /// Greatest corner, object space.
        pub max_os: [f32; 3],
        /// Not used: a texel is as long.
        pub unused: u32,
    }

    /// A triangle with alpha blending, by which it is put in order (`compose/transparent/order.glsl` of the stages).
    pub struct BlendedTriangle {
        /// Centroid, object space.
        pub centroid_os: [f32; 3],
        /// Its draw, by its number in the scene.
        pub draw: u32,
        /// First of its three indices in the scene's.
        pub first_index: u32,
    }

    /// One draw: at most 1,024 triangles of one instance; four texels, and the vertex stream of instances
    /// (`include/scene.glsl`).
    pub struct DrawData {
        /// First row of the matrix object → world.
        pub object_row0: [f32; 4],
        /// Second row.
        pub object_row1: [f32; 4],
        /// Third row.
        pub object_row2: [f32; 4],
        /// First index in the scene's index buffer.
        pub first_index: u32,
        /// First vertex of its mesh.
        pub first_vertex: u32,
        /// Material.
        pub material: u32,
        /// `DRAW_MIRRORED` or 0.
        pub flags: u32,
    }

    /// What a group of the pass `shared/deform` writes (`shared/deform/deform.comp.glsl`).
    pub struct DeformGroup {
        /// The deformation.
        pub deformation: u32,
        /// First vertex of it.
        pub first: u32,
    }

    /// What gives the vertices of a drawn mesh their places.
    pub struct Deformed {
        /// First drawn vertex.
        pub first_vertex: u32,
        /// Vertices.
        pub vertex_count: u32,
        /// First vertex of its shape.
        pub first_shape: u32,
        /// 1 where each triangle has vertices and a normal of its own.
        pub is_flat: u32,
        /// Sets of four joints a vertex, 0 without a skin.
        pub set_count: u32,
        /// First set of its shape.
        pub first_influence: u32,
        /// First matrix of the pose.
        pub first_joint: u32,
        /// Morph targets.
        pub target_count: u32,
        /// First of them.
        pub first_target: u32,
        /// First weight of the pose.
        pub first_weight: u32,
    }

    /// A material: five texels of an RGBA32UI image (`include/scene.glsl`).
    pub struct MaterialData {
        /// Linear colour and alpha.
        pub base_color_factor: [f32; 4],
        /// Linear radiance.
        pub emissive_factor: [f32; 3],
        /// Alpha below it is no surface (masked materials).
        pub alpha_cutoff: f32,
        /// 0 to 1.
        pub metallic_factor: f32,
        /// Perceptual, 0 to 1.
        pub roughness_factor: f32,
        /// Scale of the normal map's x and y.
        pub normal_scale: f32,
        /// 0 to 1.
        pub occlusion_strength: f32,
        /// `MATERIAL_*` bits.
        pub flags: u32,
        /// First of five texture transforms.
        pub uv_transform: u32,
        /// Base colour texture.
        pub base_color_slot: u32,
        /// Metal-rough texture.
        pub metallic_roughness_slot: u32,
        /// Normal map.
        pub normal_slot: u32,
        /// Occlusion texture.
        pub occlusion_slot: u32,
        /// Emission texture.
        pub emissive_slot: u32,
        /// Unused.
        pub _padding: u32,
    }

    /// A light: four texels of an RGBA32UI image (`include/shading.glsl`).
    pub struct LightData {
        /// World space, metres.
        pub position_ws: [f32; 3],
        /// 1 / range², 0 where it has no end.
        pub inverse_range_sq: f32,
        /// Candela, or lux where directional; linear colour.
        pub intensity: [f32; 3],
        /// 0 point, 1 spot, 2 directional.
        pub kind: u32,
        /// Unit direction in which it shines.
        pub direction_ws: [f32; 3],
        /// Metres; infinite where it has no end.
        pub range_m: f32,
        /// Scale of the cone's falloff.
        pub spot_scale: f32,
        /// Offset of the cone's falloff.
        pub spot_offset: f32,
        /// Unused.
        pub _padding: [u32; 2],
    }
}

/// Layouts that builds check by default.
pub const LAYOUTS: &[crate::StructLayout] = &[
    FrameConstants::LAYOUT,
    RsmConstants::LAYOUT,
    ShadowConstants::LAYOUT,
    DrawChoiceConstants::LAYOUT,
    DrawBounds::LAYOUT,
    BlendedTriangle::LAYOUT,
    DrawData::LAYOUT,
    DeformGroup::LAYOUT,
    Deformed::LAYOUT,
    MaterialData::LAYOUT,
    LightData::LAYOUT,
];

/// `DrawChoiceConstants::order`: as in the scene.
pub const ORDER_SCENE: u32 = 0;
/// `DrawChoiceConstants::order`: by the distance of the centre of their bounds.
pub const ORDER_CENTER: u32 = 1;
/// `DrawChoiceConstants::order`: by the distance of the nearest point of their bounds.
pub const ORDER_NEAR: u32 = 2;
/// `DrawData::flags`: negative determinant.
pub const DRAW_MIRRORED: u32 = 1;
/// `MaterialData::flags`: base colour is what leaves.
pub const MATERIAL_UNLIT: u32 = 1;
/// `MaterialData::flags`: back faces are drawn.
pub const MATERIAL_DOUBLE_SIDED: u32 = 2;
/// Texture slot of a texture that is not there.
pub const NO_TEXTURE: u32 = u32::MAX;
/// Bits of a triangle's number within its draw, in a 32-bit triangle ID; the draw's number takes the others.
/// `TRIANGLE_BITS` in `include/scene.glsl`.
pub const TRIANGLE_BITS: u32 = 10;

#[cfg(test)]
mod tests {
    use super::*;
    use core::mem::offset_of;

    /// Records that shaders read as texels: each texel's first field, as `include/scene.glsl` and `include/shading.glsl`
    /// take them apart.
    #[test]
    fn records_lie_in_texels_as_shaders_read_them() {
        assert_eq!(size_of::<DrawData>(), 4 * 16);
        assert_eq!(offset_of!(DrawData, object_row1), 16);
        assert_eq!(offset_of!(DrawData, object_row2), 2 * 16);
        assert_eq!(offset_of!(DrawData, first_index), 3 * 16);
        assert_eq!(offset_of!(DrawData, flags), 3 * 16 + 12);
        assert_eq!(size_of::<MaterialData>(), 5 * 16);
        assert_eq!(offset_of!(MaterialData, emissive_factor), 16);
        assert_eq!(offset_of!(MaterialData, alpha_cutoff), 16 + 12);
        assert_eq!(offset_of!(MaterialData, metallic_factor), 2 * 16);
        assert_eq!(offset_of!(MaterialData, occlusion_strength), 2 * 16 + 12);
        assert_eq!(offset_of!(MaterialData, flags), 3 * 16);
        assert_eq!(offset_of!(MaterialData, metallic_roughness_slot), 3 * 16 + 12);
        assert_eq!(offset_of!(MaterialData, normal_slot), 4 * 16);
        assert_eq!(offset_of!(MaterialData, emissive_slot), 4 * 16 + 8);
        assert_eq!(size_of::<LightData>(), 4 * 16);
        assert_eq!(offset_of!(LightData, inverse_range_sq), 12);
        assert_eq!(offset_of!(LightData, intensity), 16);
        assert_eq!(offset_of!(LightData, kind), 16 + 12);
        assert_eq!(offset_of!(LightData, direction_ws), 2 * 16);
        assert_eq!(offset_of!(LightData, spot_scale), 3 * 16);
    }
}
