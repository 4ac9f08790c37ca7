//! Textures made by code: a height field and a colour a point, baked to base colour, normal map, and occlusion, roughness, metal.

use std::f32::consts::TAU;

use rayon::prelude::*;

use super::kit::SceneBuilder;
use crate::{Material, Sampler, TextureRef};

/// A texture as most materials use it: repeated, linear, set 0.
pub(super) fn texture(image: u32) -> TextureRef {
    TextureRef {
        image,
        sampler: Sampler::default(),
        uv_set: 0,
        uv_transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    }
}

/// What a surface is at a point of a texture.
#[derive(Clone, Copy)]
pub(super) struct Texel {
    /// sRGB colour, 0 to 1.
    pub color: [f32; 3],
    /// Alpha.
    pub alpha: f32,
    /// Height over the surface, as a fraction of the texture's width.
    pub height: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Metalness.
    pub metal: f32,
    /// Share of the ambient light that arrives.
    pub occlusion: f32,
}

impl Default for Texel {
    fn default() -> Self {
        Self { color: [1.0; 3], alpha: 1.0, height: 0.0, roughness: 1.0, metal: 0.0, occlusion: 1.0 }
    }
}

/// Bakes `texel(u, v)` over the unit square (v downwards, periodic) and returns a material that uses the
/// three textures.
pub(super) fn baked_material(
    b: &mut SceneBuilder,
    name: &str,
    size_px: u32,
    texel: impl Fn(f32, f32) -> Texel + Sync,
) -> Material {
    bake(b, name, size_px, &texel)
}

/// [`baked_material`], compiled once rather than for each texture's function.
fn bake(
    b: &mut SceneBuilder,
    name: &str,
    size_px: u32,
    texel: &(dyn Fn(f32, f32) -> Texel + Sync),
) -> Material {
    let size = size_px as usize;
    let at = |i: usize| (i as f32 + 0.5) / size_px as f32;
    let texels: Vec<Texel> = (0..size * size)
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| texel(at(i % size), at(i / size)))
        .collect();
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let pixels = |pixel: &(dyn Fn(usize) -> [u8; 4] + Sync)| -> Vec<u8> {
        (0..size * size).into_par_iter().with_min_len(4096).flat_map_iter(pixel).collect()
    };
    let base = pixels(&|i| {
        let [r, g, b] = texels[i].color;
        [byte(r), byte(g), byte(b), byte(texels[i].alpha)]
    });
    let orm = pixels(&|i| [byte(texels[i].occlusion), byte(texels[i].roughness), byte(texels[i].metal), 255]);
    let height = |x: usize, y: usize| texels[(y % size) * size + x % size].height;
    let normals = pixels(&|i| {
        let (x, y) = (i % size, i / size);
        let slope_u = (height(x + 1, y) - height(x + size - 1, y)) * 0.5 * size_px as f32;
        let slope_v = (height(x, y + 1) - height(x, y + size - 1)) * 0.5 * size_px as f32;
        // green is up, v is down
        let n = glam::Vec3::new(-slope_u, slope_v, 1.0).normalize();
        [byte(0.5 * n.x + 0.5), byte(0.5 * n.y + 0.5), byte(0.5 * n.z + 0.5), 255]
    });
    let [base, orm, normals] = [("color", base), ("orm", orm), ("normal", normals)]
        .map(|(kind, pixels)| texture(b.image(&format!("{name} {kind}"), size_px, pixels)));
    Material {
        name: name.to_owned(),
        base_color_texture: Some(base),
        metallic_roughness_texture: Some(orm),
        occlusion_texture: Some(orm),
        normal_texture: Some(normals),
        ..Material::default()
    }
}

/// A hash of a lattice point, in [0, 1).
fn hash(x: u32, y: u32, seed: u32) -> f32 {
    let mut h = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ seed.wrapping_mul(0xcb1a_b31f);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    (h >> 8) as f32 / 16_777_216.0
}

fn smooth(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

/// 0 below `low`, 1 above `high`, smooth between.
pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    smooth(((x - low) / (high - low)).clamp(0.0, 1.0))
}

pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

pub(super) fn mix3(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    [mix(a[0], b[0], t), mix(a[1], b[1], t), mix(a[2], b[2], t)]
}

/// Value noise in [0, 1] with `period` lattice cells over the unit square.
fn noise(u: f32, v: f32, period: u32, seed: u32) -> f32 {
    let (x, y) = (u * period as f32, v * period as f32);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (smooth(x - x0), smooth(y - y0));
    // the cell's borders, wrapped without a division by an integer: this is the textures' innermost loop
    let borders = |i: f32| {
        let low = (i - (i / period as f32).floor() * period as f32) as u32;
        let low = if low >= period { 0 } else { low };
        [low, if low + 1 == period { 0 } else { low + 1 }]
    };
    let (columns, rows) = (borders(x0), borders(y0));
    let corner = |i: usize, j: usize| hash(columns[i], rows[j], seed);
    mix(mix(corner(0, 0), corner(1, 0), fx), mix(corner(0, 1), corner(1, 1), fx), fy)
}

/// A sum of octaves of value noise, each of twice the frequency and half the amplitude; in [0, 1].
pub(super) fn fbm(u: f32, v: f32, period: u32, octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut total) = (0.0, 0.5, 0.0);
    for octave in 0..octaves {
        sum += weight * noise(u, v, period << octave, seed + octave);
        total += weight;
        weight *= 0.5;
    }
    sum / total
}

/// Slabs of two marbles with veins and narrow joints: four by four over the square.
pub(super) fn marble(u: f32, v: f32) -> Texel {
    let (x, y) = (u * 4.0, v * 4.0);
    let (cell_x, cell_y) = (x as u32 % 4, y as u32 % 4);
    let dark = (cell_x + cell_y) % 2 == 1;
    let border = [x.fract(), 1.0 - x.fract(), y.fract(), 1.0 - y.fract()].into_iter().fold(1.0, f32::min);
    let slab = smoothstep(0.008, 0.024, border);
    let warp = fbm(u, v, 8, 4, 11 + cell_x * 7 + cell_y * 31);
    let vein = 1.0 - (2.0 * fbm(u + 0.13 * warp, v + 0.09 * warp, 6, 4, 40 + u32::from(dark)) - 1.0).abs();
    let vein = smoothstep(0.86, 1.0, vein);
    let tone = 0.9 + 0.2 * hash(cell_x, cell_y, 5);
    let stone = if dark {
        mix3([0.34, 0.24, 0.21], [0.62, 0.5, 0.43], vein)
    } else {
        mix3([0.84, 0.79, 0.71], [0.6, 0.54, 0.48], 0.8 * vein)
    };
    Texel {
        color: mix3([0.3, 0.27, 0.24], stone.map(|c| c * tone), slab),
        height: 0.0022 * slab + 0.0003 * warp,
        roughness: mix(0.9, 0.24 + 0.14 * warp, slab),
        occlusion: mix(0.6, 1.0, slab),
        ..Texel::default()
    }
}

/// Weathered limestone: soft bands, fine grain, a few shallow pits.
pub(super) fn limestone(u: f32, v: f32) -> Texel {
    let coarse = fbm(u, v, 3, 5, 71);
    let fine = fbm(u, v, 48, 3, 83);
    let band = fbm(0.25 * coarse, v + 0.06 * coarse, 12, 3, 59);
    let pit = smoothstep(0.7, 0.86, fbm(u, v, 40, 2, 97));
    let warm = mix3([0.86, 0.8, 0.69], [0.74, 0.66, 0.53], smoothstep(0.25, 0.75, 0.6 * coarse + 0.4 * band));
    Texel {
        color: mix3(warm, [0.6, 0.51, 0.4], 0.5 * pit).map(|c| c * (0.94 + 0.12 * fine)),
        height: 0.003 * coarse + 0.0008 * fine - 0.0015 * pit,
        roughness: 0.7 + 0.2 * fine,
        occlusion: 1.0 - 0.2 * pit,
        ..Texel::default()
    }
}

/// Bricks in running bond, eight courses of four over the square.
pub(super) fn brick(u: f32, v: f32) -> Texel {
    let y = v * 8.0;
    let course = y as u32 % 8;
    let x = u * 4.0 + 0.5 * (course % 2) as f32;
    let column = x as u32 % 4;
    // a course is half as high as a brick is long
    let border =
        [2.0 * x.fract(), 2.0 - 2.0 * x.fract(), y.fract(), 1.0 - y.fract()].into_iter().fold(1.0, f32::min);
    let grain = fbm(u, v, 32, 3, 7);
    let face = smoothstep(0.05, 0.13, border + 0.05 * (grain - 0.5));
    let tone = hash(column, course, 3);
    let clay = mix3([0.62, 0.36, 0.25], [0.76, 0.53, 0.37], tone).map(|c| c * (0.8 + 0.4 * grain));
    Texel {
        color: mix3([0.69, 0.64, 0.56], clay, face),
        height: 0.006 * face * (0.8 + 0.2 * tone) + 0.002 * grain,
        roughness: mix(0.95, 0.78, face),
        occlusion: mix(0.55, 1.0, face),
        ..Texel::default()
    }
}

/// Woven cloth of one colour with a second one in a pattern of lozenges and stripes.
pub(super) fn cloth(ground: [f32; 3], figure: [f32; 3]) -> impl Fn(f32, f32) -> Texel + Sync {
    move |u, v| {
        let threads = 96.0;
        let (x, y) = (u * threads, v * threads);
        let over = (x as u32 + y as u32).is_multiple_of(2);
        let across = if over { x } else { y }.fract() - 0.5;
        let thread = (1.0 - 4.0 * across * across).max(0.0).sqrt();
        let lozenge = ((2.0 * u).fract() - 0.5).abs() + ((2.0 * v).fract() - 0.5).abs();
        let ring = smoothstep(0.02, 0.0, (lozenge - 0.36).abs() - 0.03).max(smoothstep(0.12, 0.1, lozenge));
        let stripe = smoothstep(0.03, 0.02, (u - 0.5).abs() - 0.46 + 0.03);
        let pattern = ring.max(1.0 - stripe);
        let worn = 0.85 + 0.3 * fbm(u, v, 8, 3, 19);
        Texel {
            color: mix3(ground, figure, pattern).map(|c| c * worn * (0.8 + 0.2 * thread)),
            height: 0.0016 * thread,
            roughness: mix(0.92, 0.55, pattern),
            metal: 0.35 * pattern,
            occlusion: 0.8 + 0.2 * thread,
            ..Texel::default()
        }
    }
}

/// A spray of leaves on a stem, cut out by alpha; the stem rises from the middle of the lower border.
pub(super) fn leaves(u: f32, v: f32) -> Texel {
    /// Leaves on either side of the stem.
    const PAIRS: u32 = 6;
    let up = 1.0 - v;
    let sway = 0.03 * (5.0 * up).sin();
    let stem = 0.012 * (1.0 - 0.6 * up);
    let mut best = Texel { alpha: 0.0, color: [0.22, 0.36, 0.1], roughness: 0.6, ..Texel::default() };
    if (u - 0.5 - sway).abs() < stem && up < 0.92 {
        best = Texel { alpha: 1.0, color: [0.36, 0.3, 0.14], roughness: 0.8, ..best };
    }
    for i in 0..2 * PAIRS + 1 {
        let side = if i == 2 * PAIRS { 0.0 } else { [-1.0, 1.0][i as usize % 2] };
        let root = 0.1 + 0.72 * (i / 2) as f32 / (PAIRS - 1) as f32;
        let root = if side == 0.0 { 0.8 } else { root };
        let angle = side * (0.95 - 0.35 * root) + 0.25 * (hash(i, 0, 23) - 0.5);
        let length = mix(0.34, 0.2, root);
        let (dx, dy) = (u - 0.5 - sway, up - root);
        let along = (dx * angle.sin() + dy * angle.cos()) / length;
        let across = (dx * angle.cos() - dy * angle.sin()) / length;
        if !(0.0..1.0).contains(&along) {
            continue;
        }
        let half_width =
            0.62 * along.powf(0.7) * (1.0 - along).powf(0.8) * (1.0 + 0.04 * (60.0 * along).sin());
        if across.abs() < half_width {
            let rib = smoothstep(0.03, 0.0, across.abs());
            let veins = 0.5 + 0.5 * (40.0 * (along - 0.8 * across.abs())).sin();
            let tone = 0.75 + 0.5 * hash(i, 1, 23);
            let green = mix3([0.24, 0.42, 0.1], [0.5, 0.62, 0.2], (0.6 * rib + 0.2 * veins).min(1.0));
            best = Texel {
                color: green.map(|c| c * tone),
                alpha: 1.0,
                height: 0.012 * (1.0 - (across / half_width).powi(2)) - 0.003 * rib + 0.001 * veins,
                roughness: 0.42 + 0.15 * veins,
                occlusion: 0.8 + 0.2 * along,
                ..best
            };
        }
    }
    best
}

/// Fired clay of the flower pots, with turned grooves.
pub(super) fn terracotta(u: f32, v: f32) -> Texel {
    let grain = fbm(u, v, 16, 4, 131);
    let groove = 0.5 + 0.5 * (24.0 * TAU * v).sin();
    Texel {
        color: mix3([0.6, 0.3, 0.19], [0.74, 0.44, 0.3], grain),
        height: 0.001 * groove + 0.003 * grain,
        roughness: 0.8 + 0.15 * grain,
        ..Texel::default()
    }
}

/// Hammered bronze with some green in its hollows.
pub(super) fn bronze(u: f32, v: f32) -> Texel {
    let dent = fbm(u, v, 16, 3, 151);
    let patina = smoothstep(0.55, 0.75, fbm(u, v, 6, 5, 167));
    Texel {
        color: mix3([0.82, 0.62, 0.36], [0.36, 0.5, 0.42], patina),
        height: 0.004 * dent,
        roughness: mix(0.24 + 0.2 * dent, 0.8, patina),
        metal: 1.0 - 0.85 * patina,
        occlusion: 1.0 - 0.25 * patina,
        ..Texel::default()
    }
}

/// Panes of coloured glass between dark cames; alpha is what the glass covers.
pub(super) fn stained_glass(u: f32, v: f32) -> Texel {
    let (dx, dy) = (u - 0.5, v - 0.5);
    let radius = 2.0 * (dx * dx + dy * dy).sqrt();
    let petal = (dy.atan2(dx) / TAU + 0.5) * 12.0;
    let ring = (radius * 3.5) as u32;
    let near_petal = (petal.fract() - 0.5).abs() * radius;
    let came = smoothstep(0.46, 0.48, near_petal / radius.max(0.2)).max(smoothstep(
        0.46,
        0.49,
        ((radius * 3.5).fract() - 0.5).abs(),
    ));
    let palette =
        [[0.86, 0.2, 0.16], [0.16, 0.32, 0.82], [0.94, 0.72, 0.2], [0.2, 0.62, 0.36], [0.6, 0.22, 0.66]];
    let pick = (hash(petal as u32 % 12 % 3, ring, 211) * 5.0) as usize;
    Texel {
        color: mix3(palette[pick.min(4)], [0.06; 3], came),
        alpha: mix(0.45, 1.0, came),
        height: 0.004 * came,
        roughness: mix(0.08, 0.6, came),
        metal: came,
        ..Texel::default()
    }
}
