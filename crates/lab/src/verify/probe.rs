//! The second opinion: pixels of the reference itself, judged by rays in f64.

use afterlight_measure::Probes;
use afterlight_oracle::{
    raster::RayScene,
    sight::{Judge, Seen},
};
use afterlight_renderer::StoredDepth;
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
    /// Depth of opaque surfaces.
    pub depth: &'a StoredDepth,
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
        let Some(mut sight) = judge.sight(pixel) else {
            judged.probes.unjudged += 1;
            continue;
        };
        judged.probes.surfaces += 1;
        let seen = Seen::of_depth(drawn.depth.values[place], drawn.depth.to_distance);
        if !sight.accepts(seen) {
            sight = judge.close_sight(pixel).unwrap_or(sight);
        }
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
        if (off > RADIANCE_OFF || !found.is_finite()) && most.max_element() < 6e4 {
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

#[cfg(test)]
mod tests {
    use afterlight_oracle::raster::pixel_ray;
    use afterlight_scene::Scene;

    use super::*;

    const SIZE_PX: [u32; 2] = [48, 32];
    /// Near plane of the scene's camera, m.
    const NEAR_M: f64 = 0.1;

    /// What a device without rounding would draw.
    fn ideal(rays: &RayScene<'_>, settings: &Settings) -> (Vec<f32>, Vec<f32>) {
        let (mut depth, mut radiance) = (Vec::new(), Vec::new());
        for pixel in (0..SIZE_PX[0] * SIZE_PX[1]).map(|i| [i % SIZE_PX[0], i / SIZE_PX[0]]) {
            let hit = rays.first_hit(&pixel_ray(&settings.camera, pixel, SIZE_PX));
            depth.push(hit.map_or(0.0, |hit| (NEAR_M / hit.distance_m) as f32));
            let shaded = rays.shade_pixel(&settings.lights, &settings.camera, pixel, SIZE_PX);
            radiance.extend(shaded.extend(1.0).as_vec4().to_array());
        }
        (depth, radiance)
    }

    fn scene() -> Scene {
        afterlight_scene::builtin::build("builtin:intersect").expect("is there")
    }

    /// Judges all that is drawn after a change of it; the number of pixels that are off, and of those that were shaded.
    fn off(change: impl Fn(&mut Vec<f32>, &mut Vec<f32>)) -> (u64, u64) {
        let scene = scene();
        let rays = RayScene::new(&scene);
        let settings = Settings::for_scene(&scene, SIZE_PX[0], SIZE_PX[1]);
        let (mut depth, mut radiance) = ideal(&rays, &settings);
        change(&mut depth, &mut radiance);
        let depth = StoredDepth { values: depth, to_distance: [0.0, NEAR_M as f32, 1.0, 0.0] };
        let drawn = Drawn { settings: &settings, depth: &depth, radiance: &radiance };
        let judged = judge(&rays, &drawn, 2_000, &mut SplitMix64::new(3));
        assert_eq!(judged.probes.off, judged.off.len() as u64);
        assert_eq!(judged.probes.surfaces + judged.probes.unjudged, 2_000);
        (judged.probes.off, judged.probes.radiances)
    }

    #[test]
    fn what_rays_show_is_accepted() {
        let (off, shaded) = off(|_, _| {});
        assert_eq!(off, 0);
        assert!(shaded > 100, "{shaded} shaded");
    }

    #[test]
    fn what_is_wrong_is_off() {
        let (nearer, _) = off(|depth, _| depth.iter_mut().for_each(|z| *z *= 1.01));
        let (hole, _) = off(|depth, _| depth.iter_mut().for_each(|z| *z = 0.0));
        let (shifted, _) = off(|depth, _| depth.rotate_right(1));
        let (filled, _) = off(|depth, _| depth.iter_mut().for_each(|z| *z = z.max(0.02)));
        let (_, shaded) = off(|_, _| {});
        let (brighter, _) = off(|_, radiance| radiance.iter_mut().for_each(|c| *c = *c * 1.01 + 0.001));
        for (what, off) in [("nearer", nearer), ("hole", hole), ("shifted", shifted), ("filled", filled)] {
            assert!(off > 200, "{what}: {off} of 2000 off");
        }
        assert!(2 * brighter > shaded, "brighter: {brighter} of {shaded} off");
    }
}
