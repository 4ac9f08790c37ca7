//! The indices of the four nearest lights, packed into every pixel by blending, for `light-indexed` and `light-indexed-forward`:
//! see the README of this folder.

use std::sync::{Mutex, PoisonError};

use afterlight_graph::{Blend, BlendEquation, BufferRole, Graph, ImageHandle, Load, PassRole, gpu::vk};
use glam::Mat4;

use crate::lights::volumes;
use afterlight_cost::Workload;
use afterlight_frame::{Exactness, Frame, SceneLights, Slots, TechniqueError};
use afterlight_scene::Light;

mod params;

pub use params::{IndexParts, LightIndexParams};

/// What both techniques keep of the lights.
pub const EXACTNESS: Exactness = Exactness::Approximate {
    bound: "of the lights with an end that reach a pixel's surface the four nearest, by the view distance of their centres; exact where no more than four do",
    min_psnr_db: 5.0,
};

/// Values of a part: `PART_VALUES` of `parts.glsl`.
const PART_VALUES: u32 = 3;
/// Parts of one image, a channel each.
const IMAGE_PARTS: u32 = 4;
/// Most images of parts.
const MOST_IMAGES: u32 = 3;
/// Slots of the images, by `indices.glsl`.
const SLOTS: [&str; MOST_IMAGES as usize] = ["light_parts_0", "light_parts_1", "light_parts_2"];

/// Shifts the parts of the lights before by one place and puts those of a light there.
const SHIFT: Blend = Blend {
    equation: Some(BlendEquation {
        src_color: vk::BlendFactor::ONE,
        dst_color: vk::BlendFactor::CONSTANT_COLOR,
        color_op: vk::BlendOp::ADD,
        src_alpha: vk::BlendFactor::ONE,
        dst_alpha: vk::BlendFactor::CONSTANT_ALPHA,
        alpha_op: vk::BlendOp::ADD,
    }),
    write_mask: vk::ColorComponentFlags::RGBA,
};
/// A place: the factor of [`SHIFT`].
const PLACE: f32 = 0.25;

/// Lights that so many images tell apart, besides none.
fn room(images: u32) -> u32 {
    PART_VALUES.pow(IMAGE_PARTS * images) - 1
}

/// Images of four parts for `lights` lights with an end, or for how many there is room at most.
fn images(parts: IndexParts, lights: u32) -> Result<u32, u32> {
    let fixed = parts.count().map(|parts| parts / IMAGE_PARTS);
    let most = fixed.unwrap_or(MOST_IMAGES);
    (fixed.unwrap_or(1)..=most).find(|images| lights <= room(*images)).ok_or(room(most))
}

/// Floats a pixel of the packed indices, for predictions.
pub fn floats(workload: &Workload, params: LightIndexParams) -> f64 {
    let images = images(params.index_parts, workload.lights as u32).unwrap_or(MOST_IMAGES);
    f64::from(2 * images)
}

/// Packed indices of a frame: 8, 16 or 24 bytes a pixel.
pub struct LightIndices {
    images: Vec<ImageHandle>,
}

/// Declares `technique/indices`: lights with an end are drawn from far to near, each leaves its index in every pixel whose surface
/// lies within its range, and a pixel keeps the last four. `depth` is the surfaces' depth, reversed, with or without stencil.
///
/// # Errors
/// More lights than the parts of an index tell apart, a shader that is not compiled in.
pub fn build(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    params: LightIndexParams,
    depth: &ImageHandle,
) -> Result<LightIndices, TechniqueError> {
    let bounded = frame.lights.count - frame.lights.unbounded_count;
    let parts = params.index_parts;
    let count = images(parts, bounded).map_err(|limit| TechniqueError::TooLarge {
        what: format!("{technique}: lights with an end for index-parts={parts}"),
        found: bounded.into(),
        limit: limit.into(),
    })?;
    let image = |i| {
        let name = format!("{}/light indices {i}", technique);
        graph.image(&name, BufferRole::Lights, frame.image_info(vk::Format::R16G16B16A16_SFLOAT))
    };
    let cleared: Vec<ImageHandle> = (0..count).map(image).collect();
    // Kept for its memory.
    let keyed = Mutex::new(Vec::new());
    let order = frame.table_of_view(
        graph,
        ("light order", BufferRole::Lights),
        bounded as usize,
        move |view, words| {
            let mut keyed = keyed.lock().unwrap_or_else(PoisonError::into_inner);
            far_to_near(view.lights, view.camera.clip_from_world, &mut keyed);
            words.extend(keyed.iter().map(|(_, light)| *light));
        },
    )?;

    let mut pass = graph.raster(&format!("{}/indices", technique), PassRole::LightAssignment);
    frame.bind_scene(&mut pass);
    pass.read("surface_depth", depth).read("LightOrder", &order);
    let images = cleared.into_iter().map(|image| pass.color(image, Load::Clear([0.0; 4]))).collect();
    pass.depth_read_only(depth);
    if bounded > 0 {
        let fragment = format!("lights/indices/pack.frag#{count}");
        let blend = vec![SHIFT; count as usize];
        let state = volumes::ordered_state(frame, &fragment, vk::CullModeFlags::FRONT, blend)?
            .depth(volumes::BEHIND_SURFACE)
            .blend_constants([PLACE; 4]);
        pass.draw(volumes::volume_draw(frame, state, 0, bounded));
    }
    pass.finish();
    Ok(LightIndices { images })
}

impl LightIndices {
    /// Binds what `indices.glsl` reads.
    pub fn bind(&self, pass: &mut impl Slots) {
        for (i, slot) in SLOTS.iter().enumerate() {
            // Without an image its code is gone, its slot is not.
            pass.read_image(slot, &self.images[i.min(self.images.len() - 1)]);
        }
    }

    /// Specialization constant of what includes `indices.glsl`.
    pub fn constant(&self) -> (&'static str, u32) {
        ("PART_IMAGES", self.images.len() as u32)
    }
}

/// Numbers of the lights with an end, those whose centre is farthest along the view direction first; of equals the last first, so
/// that the first are kept; with how far that is.
fn far_to_near(lights: &SceneLights, clip_from_world: Mat4, keyed: &mut Vec<(f32, u32)>) {
    let key = |light: u32| (beyond_near(&lights.lights[light as usize], clip_from_world), light);
    keyed.clear();
    keyed.extend((lights.unbounded_count..lights.count).map(key));
    keyed.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
}

/// How far a light's centre lies beyond the near plane, in a unit of the projection: w − z, depth being reversed (Gribb and
/// Hartmann 2001). It grows with view distance, perspective or orthographic, behind the eye as well.
fn beyond_near(light: &Light, clip_from_world: Mat4) -> f32 {
    let p = clip_from_world * light.position_ws.extend(1.0);
    p.w - p.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use half::f16;
    use proptest::prelude::*;

    /// What a channel holds after parts were blended into it, by nearest rounding or towards zero.
    fn blended(parts: &[u32], nearest: bool) -> f32 {
        parts.iter().fold(0.0, |old, part| {
            let exact = *part as f32 + PLACE * old;
            let rounded = f16::from_f32(exact);
            let down = if rounded.to_f32() > exact && !nearest {
                f16::from_bits(rounded.to_bits() - 1)
            } else {
                rounded
            };
            down.to_f32()
        })
    }

    /// The last four parts, the last first, as `add_parts` reads them.
    fn read(channel: f32) -> [u32; 4] {
        let bits = (channel * 64.0) as u32;
        [bits >> 6, bits >> 4 & 3, bits >> 2 & 3, bits & 3]
    }

    fn last_four(parts: &[u32]) -> [u32; 4] {
        std::array::from_fn(|i| parts.len().checked_sub(i + 1).map_or(0, |at| parts[at]))
    }

    proptest! {
        /// However many lights a pixel meets, the parts of the last four are exact.
        #[test]
        fn the_last_four_survive(parts in prop::collection::vec(0..PART_VALUES, 0..40), nearest: bool) {
            prop_assert_eq!(read(blended(&parts, nearest)), last_four(&parts));
        }
    }

    #[test]
    fn the_largest_parts_never_carry() {
        for nearest in [false, true] {
            for count in 0..40 {
                let parts = vec![PART_VALUES - 1; count];
                assert_eq!(read(blended(&parts, nearest)), last_four(&parts), "{count} lights");
            }
        }
        // With all four values of two bits they do.
        let full = [0, 3, 3, 3, 3, 3, 3, 3, 3];
        assert_ne!(read(blended(&full, true)), last_four(&full));
    }

    #[test]
    fn images_have_room() {
        assert_eq!([1, 2, 3].map(room), [80, 6560, 531_440]);
        let auto = [0, 80, 81, 6560, 6561, 531_440, 531_441].map(|lights| images(IndexParts::Auto, lights));
        assert_eq!(auto, [Ok(1), Ok(1), Ok(2), Ok(2), Ok(3), Ok(3), Err(531_440)]);
        let (four, eight) = (IndexParts::Four, IndexParts::Eight);
        assert_eq!((images(eight, 3), images(eight, 6560), images(four, 81)), (Ok(2), Ok(2), Err(80)));
    }

    #[test]
    fn nearness_grows_towards_the_eye_in_every_projection() {
        use afterlight_scene::{Camera, LightKind, Projection};
        use glam::Vec3;
        let at = |z| Light {
            kind: LightKind::Point,
            position_ws: Vec3::new(0.3, 0.1, z),
            direction_ws: Vec3::NEG_Z,
            intensity: Vec3::ONE,
            range_m: 1.0,
        };
        let mut camera = Camera::look_at("c", Vec3::ZERO, Vec3::NEG_Z, 1.0, 0.1);
        let orthographic = Projection::Orthographic { half_height_m: 1.0, near_m: 0.1, far_m: 50.0 };
        for projection in [camera.projection, orthographic] {
            camera.projection = projection;
            let clip = camera.clip_from_view(1.5) * camera.view_from_world();
            let order = [2.0, -0.05, -0.2, -3.0, -20.0, -90.0].map(|z| beyond_near(&at(z), clip));
            assert!(order.is_sorted(), "{projection:?}: {order:?}");
        }
    }
}
