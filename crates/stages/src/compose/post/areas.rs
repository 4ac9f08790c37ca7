//! The two textures of SMAA, made here: how much of a pixel a line cuts off, and how far a run of edges goes on
//! (Jimenez et al. 2012, sections 3.2 to 3.4).
//!
//! A boundary between two colours is a chain of pixel edges. Where it is a horizontal run, what was rasterised is a line that
//! passes near the run, through the middle of the step at each end: half a pixel above the run where the boundary goes up
//! there, below it where it goes down. Where the chain is a staircase of 45°, the same holds for the height above the line
//! through the middles of its steps; there an end is a step twice as long. So both kinds of areas come from one profile of
//! heights, the second sheared.
//!
//! Departure: the original has one texture of areas whose ends are encoded by the sampler's weights; here the shader tells ends
//! apart itself, so that no texel is unused. Where both ends go to one side, the original's line has the shape of a V, which
//! takes too much from convex shapes; here it is flat in the middle half (spheres at 320×180 against 8×8 samples: FLIP 0.0217
//! instead of 0.0251 with the V and 0.0250 without a filter).

/// Distances of an orthogonal pattern, square roots of pixels.
const ORTHOGONAL_TEXELS: usize = 16;
/// Distances of a diagonal pattern, steps.
const DIAGONAL_TEXELS: usize = 20;
/// Ends of an orthogonal pattern: nothing, up, down, both.
const ORTHOGONAL_ENDS: usize = 4;
/// Ends of a diagonal pattern: nothing, along the row, along the column.
const DIAGONAL_ENDS: usize = 3;
/// First column of the diagonal patterns.
const DIAGONAL_FIRST: usize = ORTHOGONAL_TEXELS * ORTHOGONAL_ENDS;

/// Width of the area texture, texels.
pub(super) const AREA_WIDTH: usize = DIAGONAL_FIRST + DIAGONAL_TEXELS * DIAGONAL_ENDS;
/// Height of the area texture, texels.
pub(super) const AREA_HEIGHT: usize = ORTHOGONAL_TEXELS * ORTHOGONAL_ENDS;
/// Values of four edges summed with the sampler's weights, in 1/32: 0 to 32.
const SEARCH_CODES: usize = 33;
/// Width of the search texture, texels: runs to the left, then to the right.
pub(super) const SEARCH_WIDTH: usize = 2 * SEARCH_CODES;
/// Height of the search texture, texels.
pub(super) const SEARCH_HEIGHT: usize = SEARCH_CODES;

/// Weights of four edges in 1/32 where the sampler is a quarter of a pixel off along a run and an eighth across it: the nearer
/// and the farther pixel on this side, then on the other. All sums differ.
const SEARCH_WEIGHTS: [usize; 4] = [21, 7, 3, 1];

/// How far from its only telling end a line reaches the run, as a share of the run.
const END_REACH: f64 = 0.5;
/// The same where both ends lie on one side, as on top of a disc.
const BOW_REACH: f64 = 0.25;

/// Heights of a line over the two ends of a run, pixels: 0.5 up, −0.5 down, 0 nothing.
type Heights = [f64; 2];

/// What two orthogonal ends say of the line. An end that goes both ways follows the other one: a straight line through both.
fn orthogonal_heights(ends: [usize; 2]) -> Heights {
    let height = |end: usize| [0.0, 0.5, -0.5, 0.0][end];
    let both = |end: usize, other: usize| if end == 3 { -height(other) } else { height(end) };
    [both(ends[0], ends[1]), both(ends[1], ends[0])]
}

/// What the lower and the upper end of a staircase say of the line, above the middles of its steps. A step that goes on along
/// the row lies half a pixel above them at the lower end, below them at the upper one.
fn diagonal_heights(ends: [usize; 2]) -> Heights {
    [[0.0, 0.5, -0.5][ends[0]], [0.0, -0.5, 0.5][ends[1]]]
}

/// Height of the line at a place of a run: straight where the ends lie on two sides, else from each end to 0.
fn height_at(heights: Heights, length: f64, x: f64) -> f64 {
    let [first, last] = heights;
    if first * last < 0.0 {
        return first + (last - first) * x / length;
    }
    let reach = length * if first * last > 0.0 { BOW_REACH } else { END_REACH };
    first * (1.0 - x / reach).max(0.0) + last * (1.0 - (length - x) / reach).max(0.0)
}

/// Mean of `clamp(y, 0, 1)` for y that goes linearly from `a` to `b`.
fn mean_of_clamped(a: f64, b: f64) -> f64 {
    /// Below it the mean of the ends is exact enough.
    const FLAT: f64 = 1e-9;
    let integral = |y: f64| {
        if y <= 0.0 {
            0.0
        } else if y < 1.0 {
            0.5 * y * y
        } else {
            y - 0.5
        }
    };
    if (b - a).abs() < FLAT { (0.5 * (a + b)).clamp(0.0, 1.0) } else { (integral(b) - integral(a)) / (b - a) }
}

/// Integrates `clamp(of(x, height), 0, 1)` over the pixel from `left` to `left + 1` of a run; `of` is linear in both.
fn integrate(heights: Heights, left: f64, length: f64, of: impl Fn(f64, f64) -> f64) -> f64 {
    let bends = [0.0, BOW_REACH, END_REACH, 1.0 - BOW_REACH, 1.0];
    let places = bends.map(|bend| (bend * length).clamp(left, left + 1.0));
    places
        .windows(2)
        .map(|ends| {
            let value = |x: f64| of(x, height_at(heights, length, x));
            (ends[1] - ends[0]) * mean_of_clamped(value(ends[0]), value(ends[1]))
        })
        .sum()
}

/// Shares of the two pixels beside a run's edge, `left` pixels of the run before it and `right` after: of the pixel below
/// beyond the line, of the pixel above beyond it.
pub(super) fn orthogonal_areas(ends: [usize; 2], left: usize, right: usize) -> [f64; 2] {
    let heights = orthogonal_heights(ends);
    let (from, length) = (left as f64, (left + right + 1) as f64);
    [-1.0, 1.0].map(|sign| integrate(heights, from, length, |_, height| sign * height))
}

/// The same for the edge of a staircase that rises to the right, `low` steps of it below and `high` above.
pub(super) fn diagonal_areas(ends: [usize; 2], low: usize, high: usize) -> [f64; 2] {
    let heights = diagonal_heights(ends);
    let (from, length) = (low as f64, (low + high + 1) as f64);
    // The middles of the steps lie at x − 1/2, this edge at `from`.
    let above_edge = move |x: f64, height: f64| x - 0.5 + height - from;
    [-1.0, 1.0].map(|sign| integrate(heights, from, length, |x, height| sign * above_edge(x, height)))
}

/// The area texture, RG8, rows from the top. First 4×4 blocks of orthogonal patterns, by the end before (columns of blocks) and
/// after (rows), in each the distances before and after, as square roots. Then 3×3 blocks of diagonal patterns, by the lower
/// and the upper end, in each the steps below and above.
pub(super) fn area_texture() -> Vec<u8> {
    let mut texels = vec![0u8; AREA_WIDTH * AREA_HEIGHT * 2];
    let mut put = |x: usize, y: usize, areas: [f64; 2]| {
        let at = 2 * (y * AREA_WIDTH + x);
        texels[at..at + 2].copy_from_slice(&areas.map(|area| (area * 255.0).round() as u8));
    };
    for (end_before, end_after) in pairs(ORTHOGONAL_ENDS) {
        for (before, after) in pairs(ORTHOGONAL_TEXELS) {
            put(
                end_before * ORTHOGONAL_TEXELS + before,
                end_after * ORTHOGONAL_TEXELS + after,
                orthogonal_areas([end_before, end_after], before * before, after * after),
            );
        }
    }
    for (low_end, high_end) in pairs(DIAGONAL_ENDS) {
        for (low, high) in pairs(DIAGONAL_TEXELS) {
            put(
                DIAGONAL_FIRST + low_end * DIAGONAL_TEXELS + low,
                high_end * DIAGONAL_TEXELS + high,
                diagonal_areas([low_end, high_end], low, high),
            );
        }
    }
    texels
}

fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |a| (0..count).map(move |b| (a, b)))
}

/// The search texture, R8UI: by the codes of the edges across a run (column) and along it (row), how many of the two pixels
/// that were looked at belong to the run. To the left, where the first of the two may be the pixel that the step before ended
/// in, one is added: 0 is a run that ended there.
pub(super) fn search_texture() -> Vec<u8> {
    let mut texels = vec![0u8; SEARCH_WIDTH * SEARCH_HEIGHT];
    for (across, along) in pairs(16) {
        let (column, row) = (search_code(across), search_code(along));
        texels[row * SEARCH_WIDTH + column] = pixels_before(across, along);
        texels[row * SEARCH_WIDTH + SEARCH_CODES + column] = pixels_after(across, along);
    }
    texels
}

/// Code of four edges, a bit each in the order of [`SEARCH_WEIGHTS`].
fn search_code(edges: usize) -> usize {
    (0..4).filter(|bit| edges >> bit & 1 == 1).map(|bit| SEARCH_WEIGHTS[bit]).sum()
}

/// Edges of the nearer and of the farther pixel: along the run those of this side count, across it those of both sides.
fn edges_of(across: usize, along: usize) -> [[bool; 2]; 2] {
    let bit = |edges: usize, index: usize| edges >> index & 1 == 1;
    [[bit(along, 0), bit(along, 1)], [bit(across, 0) || bit(across, 2), bit(across, 1) || bit(across, 3)]]
}

/// To the left: an edge across lies at the left side of its pixel, so the pixel itself still belongs to the run.
fn pixels_before(across: usize, along: usize) -> u8 {
    let [[near, far], [across_near, across_far]] = edges_of(across, along);
    let _ = across_far; // the run ends behind the far pixel, or goes on: the far pixel belongs to it
    match (near, across_near, far) {
        (false, _, _) => 0,
        (true, true, _) | (true, false, false) => 1,
        (true, false, true) => 2,
    }
}

/// To the right: an edge across lies before its pixel, which then no more belongs to the run.
fn pixels_after(across: usize, along: usize) -> u8 {
    let [[near, far], [across_near, across_far]] = edges_of(across, along);
    match (near && !across_near, far && !across_far) {
        (false, _) => 0,
        (true, false) => 1,
        (true, true) => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOTHING: usize = 0;
    const UP: usize = 1;
    const DOWN: usize = 2;
    const BOTH: usize = 3;

    fn close(found: [f64; 2], expected: [f64; 2]) {
        let off = (found[0] - expected[0]).abs().max((found[1] - expected[1]).abs());
        assert!(off < 1e-12, "found {found:?}, expected {expected:?}");
    }

    /// A line from half a pixel over the end to the run's middle: the trapezoid under it in each pixel.
    #[test]
    fn an_l_is_cut_into_trapezoids() {
        // Six pixels: the line falls from 1/2 to 0 over three of them, by 1/6 each.
        for (left, expected) in [5.0 / 12.0, 3.0 / 12.0, 1.0 / 12.0, 0.0, 0.0, 0.0].into_iter().enumerate() {
            close(orthogonal_areas([UP, NOTHING], left, 5 - left), [0.0, expected]);
            close(orthogonal_areas([DOWN, NOTHING], left, 5 - left), [expected, 0.0]);
        }
        // Three pixels: the line ends in the middle one, in a triangle 1/2 wide and 1/6 high.
        close(orthogonal_areas([UP, NOTHING], 1, 1), [0.0, 0.5 * 0.5 / 6.0]);
    }

    /// From half a pixel up to half a pixel down: straight, through the run's middle.
    #[test]
    fn a_z_is_one_line() {
        close(orthogonal_areas([UP, DOWN], 0, 0), [0.125, 0.125]);
        close(orthogonal_areas([UP, DOWN], 0, 3), [0.0, 0.375]);
        close(orthogonal_areas([UP, DOWN], 3, 0), [0.375, 0.0]);
        close(orthogonal_areas([UP, DOWN], 1, 1), [1.0 / 24.0, 1.0 / 24.0]);
    }

    /// Over a whole run a Z takes as much as it gives; an L takes d/8, a bow d/16 an end.
    #[test]
    fn areas_of_a_run_add_up() {
        for length in 1..40usize {
            let total = |ends| {
                (0..length)
                    .map(|left| orthogonal_areas(ends, left, length - 1 - left))
                    .fold([0.0, 0.0], |[a, b], [c, d]| [a + c, b + d])
            };
            let eighth = length as f64 / 8.0;
            close(total([UP, DOWN]), [eighth, eighth]);
            close(total([UP, UP]), [0.0, eighth]);
            close(total([NOTHING, DOWN]), [eighth, 0.0]);
            close(total([BOTH, DOWN]), [eighth, eighth]);
            close(total([NOTHING, BOTH]), [0.0, 0.0]);
            close(total([BOTH, BOTH]), [0.0, 0.0]);
        }
    }

    #[test]
    fn patterns_are_symmetric() {
        let turned = |end: usize| [NOTHING, DOWN, UP, BOTH][end];
        for (a, b) in pairs(ORTHOGONAL_ENDS) {
            for (left, right) in pairs(12) {
                let areas = orthogonal_areas([a, b], left, right);
                close(orthogonal_areas([b, a], right, left), areas);
                close(orthogonal_areas([turned(a), turned(b)], left, right), [areas[1], areas[0]]);
                assert!(areas.iter().all(|area| (0.0..=0.5).contains(area)), "{areas:?}");
            }
        }
        for (a, b) in pairs(DIAGONAL_ENDS) {
            for (low, high) in pairs(12) {
                // Half a turn exchanges the ends and the two pixels.
                let [this, other] = diagonal_areas([a, b], low, high);
                close(diagonal_areas([b, a], high, low), [other, this]);
            }
        }
    }

    /// A staircase that goes on for ever cuts an eighth off each pixel; one between two longer steps along the rows is a line
    /// through the middles of those steps.
    #[test]
    fn stairs_are_lines() {
        close(diagonal_areas([0, 0], 7, 4), [0.125, 0.125]);
        // Steps from (−1, 0) to (1, 0), up to (1, 1), to (3, 1): a line from (0, 0) to (2, 1), half a pixel a pixel.
        close(diagonal_areas([1, 1], 0, 1), [0.0, 0.25]);
        close(diagonal_areas([1, 1], 1, 0), [0.25, 0.0]);
        // The same along the columns: from (0, −1) to (2, 2), three halves a pixel. Below (0, 0) to (1, 0) it cuts off
        // the triangle left of (2/3, 0); above, the one right of it.
        close(diagonal_areas([2, 2], 0, 1), [1.0 / 3.0, 0.5 * (1.0 / 3.0) * 0.5]);
    }

    #[test]
    fn texels_are_where_the_shader_reads_them() {
        let texels = area_texture();
        assert_eq!(texels.len(), AREA_WIDTH * AREA_HEIGHT * 2);
        let at =
            |x: usize, y: usize| [texels[2 * (y * AREA_WIDTH + x)], texels[2 * (y * AREA_WIDTH + x) + 1]];
        let bytes = |areas: [f64; 2]| areas.map(|area| (area * 255.0).round() as u8);
        assert_eq!(at(UP * 16 + 3, DOWN * 16 + 2), bytes(orthogonal_areas([UP, DOWN], 9, 4)));
        assert_eq!(at(64 + 20 + 7, 2 * 20 + 5), bytes(diagonal_areas([1, 2], 7, 5)));
        assert_eq!(at(0, 0), [0, 0]);
    }

    #[test]
    fn codes_of_four_edges_differ() {
        let mut codes: Vec<usize> = (0..16).map(search_code).collect();
        codes.sort_unstable();
        codes.dedup();
        assert_eq!(codes.len(), 16);
        assert!(codes.iter().all(|code| *code < SEARCH_CODES));
        // What the shader goes on with: both pixels of this side, whatever the other side has.
        assert!((0..16).all(|edges| (search_code(edges) >= 28) == (edges & 3 == 3)));
    }

    /// Walks rows of edges by the texture, as the shader does, and by hand.
    #[test]
    fn the_search_finds_every_run() {
        let texels = search_texture();
        const PIXELS: usize = 12;
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 40
        };
        for _ in 0..2000 {
            // Edges along (mostly) and across (seldom), on this side and on the other.
            let along: Vec<[bool; 2]> = (0..PIXELS).map(|_| [random() % 8 != 0, random() % 2 == 0]).collect();
            let across: Vec<[bool; 2]> =
                (0..=PIXELS).map(|_| [random() % 12 == 0, random() % 12 == 0]).collect();
            let edges = |list: &[[bool; 2]], at: i64, side: usize| {
                usize::try_from(at).ok().and_then(|at| list.get(at)).is_some_and(|edges| edges[side])
            };
            let code = |list: &[[bool; 2]], near: i64, far: i64| {
                let bits =
                    [edges(list, near, 0), edges(list, far, 0), edges(list, near, 1), edges(list, far, 1)];
                search_code(bits.iter().enumerate().map(|(bit, set)| usize::from(*set) << bit).sum())
            };
            for start in (0..PIXELS as i64).filter(|at| edges(&along, *at, 0)) {
                let crossed = |at: i64| edges(&across, at, 0) || edges(&across, at, 1);
                let (mut first, mut last) = (start, start);
                while edges(&along, first - 1, 0) && !crossed(first) {
                    first -= 1;
                }
                while edges(&along, last + 1, 0) && !crossed(last + 1) {
                    last += 1;
                }
                let walk = |side: usize, near_first: i64, step: i64| {
                    (0..).find_map(|k: i64| {
                        let near = near_first + 2 * k * step;
                        let (x, y) = (code(&across, near, near + step), code(&along, near, near + step));
                        (y < 28 || x > 0)
                            .then(|| 2 * k + i64::from(texels[y * SEARCH_WIDTH + side * SEARCH_CODES + x]))
                    })
                };
                assert_eq!(walk(0, start, -1).map(|pixels| pixels - 1), Some(start - first));
                assert_eq!(walk(1, start + 1, 1), Some(last - start));
            }
        }
    }
}
