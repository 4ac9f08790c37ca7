//! The second opinion: pixels of the reference itself, judged by rays in f64.

use afterlight_measure::Probes;
use afterlight_oracle::{
    raster::RayScene,
    sight::{Judge, Seen},
};
use afterlight_scene::rng::SplitMix64;
use afterlight_techniques::Settings;
use glam::DVec3;

/// Of the pixels whose surface is judged, one of so many has its radiance judged as well, which visits every light several times.
const SHADED_OF: u32 = 4;

/// Most that a radiance may be off, of the greatest channel and [`DIM`]: 32-bit floats, and 16-bit floats where it is stored. Measured by
/// `interpolation_agrees_with_f64` in the techniques' tests to be below 0.002 from chosen views.
const RADIANCE_OFF: f64 = 0.004;
/// Radiance below which differences count by their own size.
const DIM: f64 = 0.05;

/// What the reference has drawn of a view at one sample, without shadows and indirect light.
pub struct Drawn<'a> {
    /// Its settings.
    pub settings: &'a Settings,
    /// Depth of opaque surfaces, and how it becomes a view distance.
    pub depth: &'a [f32],
    /// See [`afterlight_renderer::Prepared::depth`].
    pub depth_to_distance: [f32; 4],
    /// Linear radiance, RGBA.
    pub radiance: &'a [f32],
}

/// What the rays say of a view.
#[derive(Default)]
pub struct Judged {
    /// How many pixels.
    pub probes: Probes,
    /// Pixels that are off, and why.
    pub off: Vec<([u32; 2], String)>,
}

/// Judges `count` pixels, drawn at random.
pub fn judge(rays: &RayScene<'_>, drawn: &Drawn<'_>, count: u32, rng: &mut SplitMix64) -> Judged {
    let settings = drawn.settings;
    let size_px = [settings.width_px, settings.height_px];
    let judge = Judge::new(rays, &settings.camera, size_px);
    let mut judged = Judged::default();
    for number in 0..count {
        let pixel = size_px.map(|size| ((rng.next_f32() * size as f32) as u32).min(size - 1));
        let place = pixel[1] as usize * size_px[0] as usize + pixel[0] as usize;
        let Some(sight) = judge.sight(pixel) else {
            judged.probes.unjudged += 1;
            continue;
        };
        judged.probes.surfaces += 1;
        let seen = Seen::of_depth(drawn.depth[place], drawn.depth_to_distance);
        if !sight.accepts(seen) {
            let reason = format!("found {}, expected {}", text(seen), sight.text());
            judged.off.push((pixel, reason));
            continue;
        }
        if number % SHADED_OF != 0 {
            continue;
        }
        let Some([least, most]) = judge.radiance(&sight, pixel, &settings.lights) else { continue };
        judged.probes.radiances += 1;
        let found = DVec3::from_array([0, 1, 2].map(|c| f64::from(drawn.radiance[4 * place + c])));
        let off = (least - found).max(found - most).max_element() / (most.max_element() + DIM);
        // 16-bit floats end at 65,504.
        if !(off <= RADIANCE_OFF) && most.max_element() < 6e4 {
            let reason =
                format!("found radiance {found:.5}, expected {least:.5} to {most:.5}: off by {off:.4}");
            judged.off.push((pixel, reason));
        }
    }
    judged.probes.off = judged.off.len() as u64;
    judged
}

fn text(seen: Seen) -> String {
    match seen {
        Seen::Nothing => "no surface".to_owned(),
        Seen::Surface([near_m, far_m]) => format!("a surface at {near_m:.6} to {far_m:.6} m"),
    }
}
