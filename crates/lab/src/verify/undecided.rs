//! Pixels whose surface Vulkan leaves open: where two triangles meet, and at the rim of an alpha mask.
//!
//! Rasterisers snap vertices to a fraction of a pixel and filter textures each in their own way, so a pixel whose centre lies within 1/16
//! pixel of an edge may show either surface. One such pixel with a bright and a dark surface puts an image of 100×80 pixels to 40 dB,
//! without a fault of any technique. At several samples a pixel a triangle that is thinner than the snapping is continued from where it shows
//! to the pixel's centre, and may be anything there. So an image that misses its bound is looked at again without its worst such pixels, and passes if
//! they are few; how many passed so is told.

use afterlight_image::{ImageError, Rgba8Image, psnr_db};
use afterlight_oracle::{
    raster::RayScene,
    sight::{Judge, Sight},
};
use afterlight_scene::Camera;

use super::MARKED_FROM;

/// Pixels that may be left out of a comparison are at most one of so many: faults of techniques at edges and masks show in more.
const ONE_OF: usize = 1000;

/// An image that keeps its bound without some pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// PSNR without them, dB.
    pub psnr_db: f64,
    /// How many were left out.
    pub pixels: u64,
}

/// Leaves out the worst pixels of an image of so many samples a pixel that no rule decides; `None` where it misses its bound without them as well.
///
/// # Errors
/// Images of different sizes.
pub fn settle(
    rays: &RayScene<'_>,
    camera: &Camera,
    samples: u32,
    (truth, image): (&Rgba8Image, &Rgba8Image),
    bound_db: f64,
) -> Result<Option<Settled>, ImageError> {
    let worst = worst_first(truth, image);
    let most = (image.pixels.len() / 4).div_ceil(ONE_OF);
    let without_db = |places: &[usize]| psnr_db(truth, &without(truth, image, places));
    // A wholly other image costs no ray.
    if without_db(&worst[..worst.len().min(most)])? < bound_db {
        return Ok(None);
    }
    let judge = Judge::new(rays, camera, [image.width, image.height]);
    // Where rounding moves surfaces by more than a pixel no ray decides.
    let is_decided = |sight: Option<Sight>| sight.is_some_and(|sight| sight.is_decided());
    let is_open = |place: &usize| {
        let pixel = [*place as u32 % image.width, *place as u32 / image.width];
        match samples {
            1 => !is_decided(judge.sight(pixel)) || !is_decided(judge.close_sight(pixel)),
            _ => judge.shows_a_sliver(pixel),
        }
    };
    let open: Vec<usize> = worst.into_iter().filter(is_open).take(most).collect();
    let settled = Settled { psnr_db: without_db(&open)?, pixels: open.len() as u64 };
    Ok((settled.psnr_db >= bound_db).then_some(settled))
}

/// An image with `truth`'s pixels at some places.
fn without(truth: &Rgba8Image, image: &Rgba8Image, places: &[usize]) -> Rgba8Image {
    let mut left = image.clone();
    for at in places.iter().map(|place| 4 * place..4 * place + 4) {
        left.pixels[at.clone()].copy_from_slice(&truth.pixels[at]);
    }
    left
}

/// Places of pixels that differ to be seen, those that differ most first.
fn worst_first(truth: &Rgba8Image, image: &Rgba8Image) -> Vec<usize> {
    let pairs = truth.pixels.chunks_exact(4).zip(image.pixels.chunks_exact(4));
    let error = |(a, b): (&[u8], &[u8])| (0..3).map(|c| u32::from(a[c].abs_diff(b[c])).pow(2)).sum::<u32>();
    let mut places: Vec<(u32, usize)> = pairs.map(error).zip(0..).collect();
    places.retain(|(error, _)| *error >= u32::from(MARKED_FROM).pow(2));
    places.sort_by_key(|(error, place)| (std::cmp::Reverse(*error), *place));
    places.into_iter().map(|(_, place)| place).collect()
}

#[cfg(test)]
mod tests {
    use afterlight_scene::builtin;

    use super::*;

    const SIZE_PX: [u32; 2] = [96, 54];

    /// Black, and white in some pixels.
    fn white_at(pixels: &[[u32; 2]]) -> Rgba8Image {
        let mut image = Rgba8Image {
            width: SIZE_PX[0],
            height: SIZE_PX[1],
            pixels: [0, 0, 0, 255].repeat((SIZE_PX[0] * SIZE_PX[1]) as usize),
        };
        for [x, y] in pixels {
            let at = 4 * (y * SIZE_PX[0] + x) as usize;
            image.pixels[at..at + 3].fill(255);
        }
        image
    }

    #[test]
    fn pixels_at_edges_are_left_out_if_they_are_few_and_no_others() {
        let scene = builtin::build("builtin:edge").expect("is there");
        let rays = RayScene::new(&scene);
        let camera = &scene.cameras[0];
        let judge = Judge::new(&rays, camera, SIZE_PX);
        let all: Vec<[u32; 2]> = (0..SIZE_PX[1]).flat_map(|y| (0..SIZE_PX[0]).map(move |x| [x, y])).collect();
        let (decided, open): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|pixel| judge.sight(*pixel).is_some_and(|sight| sight.is_decided()));
        assert!(open.len() > 6 && decided.len() > 4000, "{} open, {} decided", open.len(), decided.len());
        let black = white_at(&[]);
        let settle_at = |pixels: &[[u32; 2]], bound_db: f64| {
            settle(&rays, camera, 1, (&black, &white_at(pixels)), bound_db).expect("images of one size")
        };
        // White pixels that are left, as a bound that is just kept.
        let of_white = |pixels: &[[u32; 2]]| psnr_db(&black, &white_at(pixels)).expect("images of one size");
        let all_open = settle_at(&open[..3], 200.0).expect("nothing is left");
        assert_eq!((all_open.pixels, all_open.psnr_db), (3, f64::INFINITY));
        assert_eq!(settle_at(&decided[..3], of_white(&decided[..3]) + 0.01), None);
        let mixed = [&open[..3], &decided[..3]].concat();
        assert_eq!(settle_at(&mixed, of_white(&decided[..3]) + 0.01), None);
        assert_eq!(settle_at(&mixed, of_white(&decided[..3]) - 0.01).map(|settled| settled.pixels), Some(3));
        // 6 of 5,184 is one of 1,000, rounded up; the others stay.
        let left_db = of_white(&open[6..]);
        assert_eq!(settle_at(&open, left_db), Some(Settled { psnr_db: left_db, pixels: 6 }));
        assert_eq!(settle_at(&open, left_db + 0.01), None);
    }

    /// At several samples an edge alone decides nothing less: what is left out shows triangles thinner than the snapping of vertices.
    #[test]
    fn at_several_samples_pixels_of_slivers_are_left_out_and_no_others() {
        let pixel_of = |open: bool, source: &str| {
            let scene = builtin::build(source).expect("is there");
            let rays = RayScene::new(&scene);
            let camera = &scene.cameras[0];
            let judge = Judge::new(&rays, camera, SIZE_PX);
            let all = (0..SIZE_PX[1]).flat_map(|y| (0..SIZE_PX[0]).map(move |x| [x, y]));
            let found: Vec<[u32; 2]> = all.filter(|pixel| judge.shows_a_sliver(*pixel) == open).collect();
            let black = white_at(&[]);
            let pixels = &found[..found.len().min(3)];
            let settled = settle(&rays, camera, 4, (&black, &white_at(pixels)), 200.0).expect("one size");
            (found.len(), settled.map(|settled| settled.pixels))
        };
        // Spheres of triangles that are seen on their edges at the silhouettes.
        let (slivers, settled) = pixel_of(true, "builtin:spheres");
        assert!(slivers > 20, "{slivers} pixels of slivers");
        assert_eq!(settled, Some(3));
        assert_eq!(pixel_of(false, "builtin:spheres").1, None);
        assert_eq!(pixel_of(true, "builtin:edge").0, 0);
    }
}
