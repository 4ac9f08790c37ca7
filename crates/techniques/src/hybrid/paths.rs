//! Which draws take which path: what each is predicted to read and write, by the terms of the cost model, from the overdraw that its
//! place on the image and in the order of draws makes likely.

use std::ops::Range;

use afterlight_graph::Rect;
use glam::{Mat4, Vec3};

use afterlight_frame::{
    View,
    camera_view::screen_rect,
    scene::{BUCKETS, Bucket, DrawInfo},
};
use afterlight_scene::Aabb;

/// How a draw gets its colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Path {
    /// Once, into the G-buffer.
    Deferred,
    /// By being drawn again.
    Prepass,
}

/// Draws of a bucket, one after the other, that take one path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub bucket: Bucket,
    /// Places in the bucket's order.
    pub places: Range<u32>,
    pub path: Path,
}

/// The image is looked at in so many columns and rows.
const CELLS: [u32; 2] = [16, 9];
/// Draws that a cell remembers, the nearest: behind as many nothing is likely to be seen.
const REMEMBERED: usize = 32;
/// Share of the rectangle around a draw that its triangles cover: a box seen along its diagonal covers three quarters, what is not
/// convex less.
const FILL: f64 = 0.5;

/// Floats of a vertex.
const VERTEX: f64 = 10.0;
/// Floats of a fragment's interpolants, and of a texture that it reads.
const INTERPOLANTS: f64 = 6.0;
const TEXTURE: f64 = 4.0;

/// What is predicted of a draw.
#[derive(Clone, Copy, Debug)]
struct Footprint {
    /// Columns and rows of pixels around it; empty where it is not on the image.
    rect: [Span; 2],
    /// Of its centre beyond the near plane.
    distance: f32,
}

/// From and to, in cells.
type Span = [f64; 2];

/// All draws in view on one path.
pub(super) fn one_path(view: &View<'_>, path: Path) -> Vec<Run> {
    runs(view.visible().each_ref().map(|draws| vec![path; draws.len()]))
}

/// Every draw in view on the path that is predicted to read and write less; `prepass_weight` is a factor on what the light pre-pass
/// does.
pub(super) fn predicted(view: &View<'_>, prepass_weight: f32) -> Vec<Run> {
    let draws: Vec<&DrawInfo> =
        view.visible().iter().flatten().map(|draw| &view.placed.infos[*draw as usize]).collect();
    let size = [view.settings.width_px, view.settings.height_px];
    let displacement_m = view.displacement_m();
    let footprints: Vec<Footprint> = draws
        .iter()
        .map(|draw| Footprint::new(&draw.bounds_ws, view.camera.clip_from_world, size, displacement_m))
        .collect();
    let drawn = seen(footprints.iter());
    let mut left = seen(footprints.iter().rev());
    left.reverse();
    let cell_px = f64::from(size[0]) * f64::from(size[1]) / f64::from(CELLS[0] * CELLS[1]);
    let path = |i: usize| {
        let fragments = FILL * cell_px * footprints[i].cells() * drawn[i];
        choose(draws[i], fragments, fragments * left[i], f64::from(prepass_weight))
    };
    let mut chosen = (0..draws.len()).map(path);
    runs(view.visible().each_ref().map(|bucket| chosen.by_ref().take(bucket.len()).collect()))
}

/// The path that reads and writes less for a draw of which `fragments` are shaded and `pixels` stay to be seen: the terms of D and of
/// LPP that depend on the object, less the first pass over its vertices, which both have (Petrescu et al. 2016, sections 4.3, 4.5).
/// Textures of normals and of roughness are read in both passes of LPP, which the paper leaves out.
fn choose(draw: &DrawInfo, fragments: f64, pixels: f64, prepass_weight: f64) -> Path {
    let read = |textures: u8| INTERPOLANTS + TEXTURE * f64::from(textures);
    let (all, lobe) = (read(draw.fetches.all), read(draw.fetches.lobe));
    // A vertex a triangle.
    let vertices = f64::from(draw.index_count / 3);
    let deferred = fragments * (all + 3.0) + pixels * 3.0;
    let prepass = fragments * (lobe + 2.0) + VERTEX * vertices + pixels * (all + 2.0);
    if prepass * prepass_weight < deferred { Path::Prepass } else { Path::Deferred }
}

impl Footprint {
    fn new(bounds_ws: &Aabb, clip_from_world: Mat4, size_px: [u32; 2], displacement_m: f32) -> Self {
        let whole = Rect { x_px: 0, y_px: 0, width_px: size_px[0], height_px: size_px[1] };
        let margin = Vec3::splat(displacement_m);
        let reached = Aabb { min: bounds_ws.min - margin, max: bounds_ws.max + margin };
        let rect = screen_rect(clip_from_world, &reached, whole).unwrap_or(Rect {
            width_px: 0,
            height_px: 0,
            ..whole
        });
        let in_cells = |axis: usize, from: u32, length: u32| {
            let scale = f64::from(CELLS[axis]) / f64::from(size_px[axis]);
            [f64::from(from) * scale, (f64::from(from) + f64::from(length)) * scale]
        };
        let center = clip_from_world * bounds_ws.center().extend(1.0);
        Self {
            rect: [in_cells(0, rect.x_px, rect.width_px), in_cells(1, rect.y_px, rect.height_px)],
            distance: center.w - center.z,
        }
    }

    /// Area, cells.
    fn cells(&self) -> f64 {
        self.rect.iter().map(|[from, to]| to - from).product()
    }

    /// Cells that it touches, each with the share that its rectangle covers.
    fn covered(&self) -> impl Iterator<Item = (usize, f64)> {
        let [columns, rows] = self.rect;
        let within = |[from, to]: Span, axis: usize| {
            let end = (to.ceil() as u32).min(CELLS[axis]);
            (from.floor() as u32..end)
                .map(move |cell| (cell, to.min(f64::from(cell) + 1.0) - from.max(f64::from(cell))))
        };
        within(rows, 1).flat_map(move |(row, high)| {
            within(columns, 0).map(move |(column, wide)| ((row * CELLS[0] + column) as usize, high * wide))
        })
    }
}

/// Of each draw the share that nearer ones before it leave, 0 to 1: each hides what lies behind its triangles, which are
/// anywhere in its rectangle. In the order of draws it is what passes the depth test, in the opposite order what is not drawn over.
fn seen<'f>(footprints: impl Iterator<Item = &'f Footprint>) -> Vec<f64> {
    let mut nearest: Vec<Vec<(f32, f64)>> = vec![Vec::new(); (CELLS[0] * CELLS[1]) as usize];
    footprints
        .map(|footprint| {
            let (mut area, mut left) = (0.0, 0.0);
            for (cell, covered) in footprint.covered() {
                let before = &mut nearest[cell];
                let place = before.partition_point(|(distance, _)| *distance < footprint.distance);
                area += covered;
                left += covered * before[..place].iter().map(|(_, passes)| passes).product::<f64>();
                before.insert(place, (footprint.distance, 1.0 - FILL * covered));
                before.truncate(REMEMBERED);
            }
            if area > 0.0 { left / area } else { 1.0 }
        })
        .collect()
}

/// Paths of the draws of every bucket, in order, as runs.
fn runs(paths: [Vec<Path>; BUCKETS]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (bucket, paths) in paths.into_iter().enumerate() {
        for (place, path) in (0..).zip(paths) {
            match runs.last_mut() {
                Some(run) if run.bucket == Bucket(bucket) && run.path == path => run.places.end += 1,
                _ => runs.push(Run { bucket: Bucket(bucket), places: place..place + 1, path }),
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_frame::scene::TextureFetches;
    use afterlight_scene::Camera;

    fn footprint(x: Span, distance: f32) -> Footprint {
        Footprint { rect: [x, [0.0, 9.0]], distance }
    }

    /// Two draws over the same half of the image, one over the other half.
    #[test]
    fn what_is_nearer_hides_by_the_order_of_draws() {
        let (near, far) = (footprint([0.0, 8.0], 1.0), footprint([0.0, 8.0], 2.0));
        let beside = footprint([8.0, 16.0], 3.0);
        let far_first = [far, near, beside];
        assert_eq!(seen(far_first.iter()), [1.0, 1.0, 1.0], "all pass the depth test");
        assert_eq!(seen(far_first.iter().rev()), [1.0, 1.0, 0.5], "the far one, last here, is drawn over");
        assert_eq!(seen([near, far].iter()), [1.0, 0.5], "half of the far one fails the depth test");
        assert_eq!(seen([footprint([4.0, 12.0], 1.0), far].iter()), [1.0, 0.75]);
        assert_eq!(seen([footprint([3.0, 3.0], 1.0)].iter()), [1.0], "nothing on the image");
        let crowd = vec![near; 3 * REMEMBERED];
        assert!(seen(crowd.iter().chain([&far])).last() < Some(&1e-9));
    }

    #[test]
    fn boxes_fall_on_their_cells() {
        let camera = Camera::look_at("c", Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, 1.0, 0.1);
        let clip = camera.clip_from_view(16.0 / 9.0) * camera.view_from_world();
        let at = |center: Vec3, half: f32| {
            let bounds = Aabb { min: center - half, max: center + half };
            Footprint::new(&bounds, clip, [1600, 900], 0.0)
        };
        let small = at(Vec3::ZERO, 0.01);
        let cells: Vec<usize> = small.covered().map(|(cell, _)| cell).collect();
        // The image's centre: between columns 7 and 8, in row 4.
        assert_eq!(cells, [4 * 16 + 7, 4 * 16 + 8]);
        let covered: f64 = at(Vec3::ZERO, 1.0).covered().map(|(_, share)| share).sum();
        assert!((covered - at(Vec3::ZERO, 1.0).cells()).abs() < 1e-9);
        assert_eq!(at(Vec3::new(1e3, 0.0, 0.0), 1.0).cells(), 0.0);
        assert_eq!(at(Vec3::new(0.0, 0.0, 10.0), 1.0).cells(), 144.0, "around the eye: the whole image");
        assert!(at(Vec3::ZERO, 1.0).distance < at(Vec3::NEG_Z, 1.0).distance);
    }

    #[test]
    fn hidden_fragments_with_many_textures_take_the_prepass() {
        let draw = |all, lobe, triangles: u32| DrawInfo {
            bounds_ws: Aabb::EMPTY,
            index_count: 3 * triangles,
            first_index: 0,
            first_vertex: 0,
            fetches: TextureFetches { all, lobe },
        };
        let path = |draw: &DrawInfo, seen: f64| choose(draw, 1000.0, 1000.0 * seen, 1.0);
        // A fragment: 29 floats at once, or 8 and 28 again; a pixel: 3 more at once.
        let colors = draw(5, 0, 10);
        assert_eq!(path(&colors, 1.0), Path::Deferred);
        assert_eq!(path(&colors, 0.9), Path::Deferred);
        assert_eq!(path(&colors, 0.5), Path::Prepass);
        // Its vertices cost more than what is hidden: 10,000 floats against 8,500.
        assert_eq!(path(&draw(5, 0, 1000), 0.5), Path::Deferred);
        // Most of what is read is read twice.
        assert_eq!(path(&draw(3, 2, 10), 0.5), Path::Deferred);
        assert_eq!(path(&draw(3, 2, 10), 0.1), Path::Prepass);
        assert_eq!(choose(&colors, 1000.0, 1000.0, 0.0), Path::Prepass);
        assert_eq!(choose(&colors, 1000.0, 0.0, 1000.0), Path::Deferred);
    }

    #[test]
    fn runs_keep_the_order_of_draws() {
        use Path::{Deferred as D, Prepass as P};
        let mut paths: [Vec<Path>; BUCKETS] = Default::default();
        (paths[0], paths[2]) = (vec![D, D, P], vec![P, P, D]);
        let run = |bucket, places, path| Run { bucket: Bucket(bucket), places, path };
        let expected = [run(0, 0..2, D), run(0, 2..3, P), run(2, 0..2, P), run(2, 2..3, D)];
        assert_eq!(runs(paths), expected);
    }
}
