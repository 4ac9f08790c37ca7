//! Textures made by code, sampled in f64 on their finest level.

use afterlight_scene::{Image, ImageData, Sampler, TextureRef, Wrap};
use glam::{DVec2, DVec4};

use crate::tonemap::linear_from_srgb;

/// The coordinates that a texture is sampled at: KHR_texture_transform applied.
pub fn transformed_uv(texture: &TextureRef, uv: DVec2) -> DVec2 {
    let row = |r: [f32; 3]| f64::from(r[0]) * uv.x + f64::from(r[1]) * uv.y + f64::from(r[2]);
    DVec2::new(row(texture.uv_transform[0]), row(texture.uv_transform[1]))
}

/// A texel's place on an axis of `size` texels, wrapped (Vulkan 1.3, section 16.8).
fn wrapped(i: i64, size: u32, wrap: Wrap) -> u32 {
    let n = i64::from(size);
    let i = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let k = i.rem_euclid(2 * n);
            if k < n { k } else { 2 * n - 1 - k }
        }
    };
    i as u32
}

/// Samples the finest level, linear or nearest as the sampler magnifies, sRGB texels made linear before the blend where
/// `srgb`. This is what a device does where the texture is magnified; elsewhere a device takes coarser levels. `None`
/// for images that are files: those are for the loader to decode.
pub fn sample_finest(image: &Image, sampler: &Sampler, uv: DVec2, srgb: bool) -> Option<DVec4> {
    let ImageData::Rgba8 { width, height, pixels } = &image.data else { return None };
    let texel = |x: i64, y: i64| {
        let (x, y) = (wrapped(x, *width, sampler.wrap_u), wrapped(y, *height, sampler.wrap_v));
        let i = 4 * (y as usize * *width as usize + x as usize);
        let color = |c: usize| {
            let value = f64::from(pixels[i + c]) / 255.0;
            if srgb && c < 3 { linear_from_srgb(value) } else { value }
        };
        DVec4::new(color(0), color(1), color(2), color(3))
    };
    let place = uv * DVec2::new(f64::from(*width), f64::from(*height));
    if sampler.mag_nearest {
        return Some(texel(place.x.floor() as i64, place.y.floor() as i64));
    }
    let place = place - 0.5;
    let (base, t) = (place.floor(), place - place.floor());
    let (x, y) = (base.x as i64, base.y as i64);
    let upper = texel(x, y).lerp(texel(x + 1, y), t.x);
    let lower = texel(x, y + 1).lerp(texel(x + 1, y + 1), t.x);
    Some(upper.lerp(lower, t.y))
}
