//! `builtin:colonnade`: a hall of 30 × 8 × 12 m, open to the sky, with an aisle behind an arcade on
//! either side. X runs along the hall, Z across it, the origin is in the middle of the floor.

use std::f64::consts::{PI, TAU};

use glam::{Affine3A, DVec2, DVec3, Vec3};

use super::{
    kit::{Front, MeshData, SceneBuilder},
    simple::{MASK, lamp},
    textures,
};
use crate::{AlphaMode, Camera, Environment, Light, LightKind, Material, Scene, rng::SplitMix64};

/// Half the hall's length, height, half its width, metres.
const HALL_M: DVec3 = DVec3::new(15.0, 8.0, 6.0);
/// Distance of the rows of columns from the middle, metres.
const ROW_Z_M: f64 = 3.2;
/// Distance between columns, metres.
const BAY_M: f64 = 3.0;
/// Bays of an arcade; one column more.
const BAYS: u32 = 9;
/// Height of the columns, where the arches spring, metres.
const SPRING_M: f64 = 3.5;
/// Height of the aisles' ceilings and of the arcade's upper edge, metres.
const AISLE_M: f64 = 5.3;
/// Radius of the arches' inner sides, metres.
const ARCH_M: f64 = 1.15;
/// Half the thickness of the arcade's wall, metres.
const WALL_M: f64 = 0.34;
/// Flutes of a column.
const FLUTES: u32 = 20;

/// Fewest triangles: with every patch at its coarsest. Below, columns lose their roundness and cards
/// their bend, which is what the scene is for.
pub(super) const TRIANGLES_MIN: u32 = 16_384;

/// Share of the triangles that the floor takes; it also takes up what rounding leaves.
const FLOOR_SHARE: f64 = 0.04;

/// Tessellation relative to the divisions written here, along one direction.
#[derive(Clone, Copy)]
struct Detail {
    scale: f64,
    /// Whether triangles are counted and not made.
    counting: bool,
}

impl Detail {
    /// Divisions scaled, at least one.
    fn grid(self, divisions: [u32; 2]) -> [u32; 2] {
        divisions.map(|n| ((f64::from(n) * self.scale).round() as u32).max(1))
    }

    /// Divisions scaled in steps of `step`, at least `step`.
    fn steps(self, n: u32, step: u32) -> u32 {
        ((f64::from(n) * self.scale / f64::from(step)).round() as u32).max(1) * step
    }

    /// An empty mesh.
    fn mesh(self) -> MeshData {
        if self.counting { MeshData::counter() } else { MeshData::default() }
    }
}

/// Materials by what they are of.
#[derive(Default)]
struct Materials {
    marble: u32,
    limestone: u32,
    brick: u32,
    drapes: [u32; 4],
    leaves: u32,
    terracotta: u32,
    soil: u32,
    bronze: u32,
    iron: u32,
    flame: u32,
    water: u32,
    glass: u32,
    rose: u32,
}

/// The scene with close to `triangles` triangles and textures of `texture_px`.
pub(super) fn make(triangles: u32, texture_px: u32) -> Scene {
    let mut b = SceneBuilder::default();
    let m = materials(&mut b, texture_px);
    furnish(&mut b, &m, detail_for(triangles));
    let rest = u64::from(triangles).saturating_sub(b.scene.triangle_count());
    floor(&mut b, m.marble, rest as u32);
    b.scene.lights = lights();
    b.scene.environment = Environment {
        ambient_radiance: Vec3::new(0.17, 0.19, 0.24),
        background_radiance: Vec3::new(0.42, 0.62, 0.95),
    };
    b.scene.cameras = cameras();
    b.scene
}

/// The detail at which everything but the floor comes close to its share of `triangles`, by bisection: the count grows
/// with the detail, in small steps.
fn detail_for(triangles: u32) -> Detail {
    let wanted = (f64::from(triangles) * (1.0 - FLOOR_SHARE)) as u64;
    let (mut low, mut high) = (0.01, 32.0);
    for _ in 0..30 {
        let scale = 0.5 * (low + high);
        let mut b = SceneBuilder::default();
        furnish(&mut b, &Materials::default(), Detail { scale, counting: true });
        *(if b.scene.triangle_count() > wanted { &mut high } else { &mut low }) = scale;
    }
    Detail { scale: low, counting: false }
}

fn materials(b: &mut SceneBuilder, texture_px: u32) -> Materials {
    let plain = |name: &str, color: [f32; 4], metallic_factor: f32, roughness_factor: f32| Material {
        name: name.to_owned(),
        base_color_factor: color,
        metallic_factor,
        roughness_factor,
        ..Material::default()
    };
    let baked = |b: &mut SceneBuilder, name: &str, texel: &(dyn Fn(f32, f32) -> textures::Texel + Sync)| {
        let material = textures::baked_material(b, name, texture_px, texel);
        b.material(material)
    };
    let marble = baked(b, "marble", &textures::marble);
    let limestone = baked(b, "limestone", &textures::limestone);
    let brick = baked(b, "brick", &textures::brick);
    let terracotta = baked(b, "terracotta", &textures::terracotta);
    let bronze = baked(b, "bronze", &textures::bronze);
    let gold = [0.85, 0.66, 0.28];
    let drapes = [
        ("crimson drape", [0.58, 0.07, 0.08]),
        ("blue drape", [0.09, 0.16, 0.46]),
        ("green drape", [0.1, 0.33, 0.17]),
        ("cream drape", [0.82, 0.74, 0.58]),
    ]
    .map(|(name, ground)| {
        let figure = if name == "cream drape" { [0.55, 0.1, 0.1] } else { gold };
        let index = baked(b, name, &textures::cloth(ground, figure));
        b.scene.materials[index as usize].double_sided = true;
        index
    });
    let leaves = baked(b, "leaves", &textures::leaves);
    b.scene.materials[leaves as usize].alpha_mode = MASK;
    b.scene.materials[leaves as usize].double_sided = true;
    let rose = baked(b, "stained glass", &textures::stained_glass);
    b.scene.materials[rose as usize].alpha_mode = AlphaMode::Blend;
    b.scene.materials[rose as usize].double_sided = true;
    let blend = |m: Material| Material { alpha_mode: AlphaMode::Blend, double_sided: true, ..m };
    Materials {
        marble,
        limestone,
        brick,
        drapes,
        leaves,
        terracotta,
        soil: b.material(plain("soil", [0.09, 0.06, 0.04, 1.0], 0.0, 1.0)),
        bronze,
        iron: b.material(plain("iron", [0.06, 0.055, 0.05, 1.0], 1.0, 0.5)),
        flame: b.material(Material {
            emissive_factor: [9.0, 5.6, 2.4],
            ..plain("lantern glass", [1.0, 0.8, 0.5, 1.0], 0.0, 0.3)
        }),
        water: b.material(blend(plain("water", [0.1, 0.3, 0.34, 0.55], 0.0, 0.05))),
        glass: b.material(blend(plain("glass", [0.5, 0.72, 0.62, 0.28], 0.0, 0.04))),
        rose,
    }
}

/// Puts everything but the floor in place.
fn furnish(b: &mut SceneBuilder, m: &Materials, d: Detail) {
    structure(b, m, d);
    arcade(b, m, d);
    fountain(b, m, d);
    hang_cloth(b, m, d);
    plants(b, m, d);
    lanterns(b, m, d);
    panes(b, m, d);
}

fn translated(x: f64, y: f64, z: f64) -> Affine3A {
    Affine3A::from_translation(DVec3::new(x, y, z).as_vec3())
}

/// Mirrors in the plane z = 0: what was modelled for the row at −Z stands at +Z.
fn mirrored_z() -> Affine3A {
    Affine3A::from_scale(Vec3::new(1.0, 1.0, -1.0))
}

/// Draws a mesh where it was modelled and mirrored in z = 0.
fn place_on_both_sides(b: &mut SceneBuilder, name: &str, mesh: u32) {
    b.place(name, mesh, Affine3A::IDENTITY);
    b.place(&format!("{name}, mirrored"), mesh, mirrored_z());
}

/// The floor, of close to `triangle_count` triangles.
fn floor(b: &mut SceneBuilder, material: u32, triangle_count: u32) {
    let quads = f64::from(triangle_count.max(2)) * 0.5;
    let n_z = (quads * HALL_M.z / HALL_M.x).sqrt().max(1.0).round();
    let divisions = [(quads / n_z).round().max(1.0) as u32, n_z as u32];
    let mut mesh = MeshData::default();
    let corner = DVec3::new(-HALL_M.x, 0.0, HALL_M.z);
    let edges = [DVec3::X * (2.0 * HALL_M.x), DVec3::NEG_Z * (2.0 * HALL_M.z)];
    mesh.rectangle(divisions, DVec3::Y, corner, edges, 0.25);
    b.add("floor", &mesh, material);
}

/// A part of a circle about the origin, and of the wall around it up to a rectangle's border.
#[derive(Clone, Copy)]
struct Sector {
    /// Angles of its ends, radians.
    angles: [f64; 2],
    /// Divisions along the circle.
    divisions: u32,
}

/// Splits the circle from angle 0 to `end_rad` where the rays to the corners of a rectangle of half extents `half_m` cross it, so that
/// the wall has the rectangle's corners. `divisions` are those of the whole.
fn sectors(half_m: DVec2, end_rad: f64, divisions: u32) -> Vec<Sector> {
    let corner = half_m.y.atan2(half_m.x);
    let corners = [corner, PI - corner, PI + corner, TAU - corner];
    let mut ends = vec![0.0];
    ends.extend(corners.into_iter().filter(|&angle| angle < end_rad));
    ends.push(end_rad);
    let sector = |angles: [f64; 2]| {
        let share = (angles[1] - angles[0]) / end_rad;
        Sector { angles, divisions: ((f64::from(divisions) * share).round() as u32).max(1) }
    };
    ends.windows(2).map(|pair| sector([pair[0], pair[1]])).collect()
}

impl Sector {
    /// The unit vector at a fraction of the sector.
    fn direction(self, s: f64) -> DVec2 {
        let angle = self.angles[0] + (self.angles[1] - self.angles[0]) * s;
        DVec2::new(angle.cos(), angle.sin())
    }

    /// Adds the wall at a `z`, from the circle of `radius_m` to the rectangle.
    fn wall(self, mesh: &mut MeshData, across: u32, front: DVec3, radius_m: f64, half_m: DVec2, z: f64) {
        let position = move |s: f64, t: f64| {
            let direction = self.direction(s);
            let reach = (half_m.x / direction.x.abs().max(1e-9)).min(half_m.y / direction.y.abs().max(1e-9));
            (direction * (radius_m + (reach - radius_m) * t)).extend(z)
        };
        let uv = |s: f64, t: f64| {
            let p = position(s, t);
            DVec2::new(p.x, -p.y) * 0.5
        };
        mesh.patch([self.divisions, across], Front::Along(front), position, uv);
    }
}

/// Outer walls, aisle ceilings, clerestory and the two ends with their rose windows.
fn structure(b: &mut SceneBuilder, m: &Materials, d: Detail) {
    let length = DVec3::X * (2.0 * HALL_M.x);
    let west = -HALL_M.x;
    let mut walls = d.mesh();
    walls.rectangle(
        d.grid([60, 12]),
        DVec3::Z,
        DVec3::new(west, 0.0, -HALL_M.z),
        [length, DVec3::Y * AISLE_M],
        0.4,
    );
    let upper = DVec3::Y * (HALL_M.y - AISLE_M);
    for (z, front) in [(-ROW_Z_M + WALL_M, DVec3::Z), (-ROW_Z_M - WALL_M, DVec3::NEG_Z)] {
        walls.rectangle(d.grid([60, 8]), front, DVec3::new(west, AISLE_M, z), [length, upper], 0.4);
    }
    let mesh = b.mesh("side wall", &walls, m.brick);
    place_on_both_sides(b, "side wall", mesh);

    let mut stone = d.mesh();
    let depth = HALL_M.z - ROW_Z_M - WALL_M;
    for (y, front) in [(AISLE_M, DVec3::NEG_Y), (AISLE_M + 0.12, DVec3::Y)] {
        stone.rectangle(
            d.grid([40, 5]),
            front,
            DVec3::new(west, y, -HALL_M.z),
            [length, DVec3::Z * depth],
            0.5,
        );
    }
    let top = DVec3::new(west, HALL_M.y, -ROW_Z_M - WALL_M);
    stone.rectangle(d.grid([40, 1]), DVec3::Y, top, [length, DVec3::Z * (2.0 * WALL_M)], 0.5);
    for y in [AISLE_M, HALL_M.y - 0.34] {
        cornice(&mut stone, d, y);
    }
    skirting(&mut stone, d);
    let mesh = b.mesh("ceiling and cornices", &stone, m.limestone);
    place_on_both_sides(b, "ceiling and cornices", mesh);

    end_walls(b, m, d);
}

/// A moulding along the clerestory, 0.34 m high: it leaves the wall, swells in three steps and returns.
fn cornice(mesh: &mut MeshData, d: Detail, y: f64) {
    let profile = |t: f64| {
        let step = |low: f64, high: f64| f64::from(textures::smoothstep(low as f32, high as f32, t as f32));
        let swell = 0.06 * step(0.0, 0.08) + 0.07 * step(0.25, 0.45) + 0.09 * step(0.55, 0.85);
        // A centimetre off the wall: where few triangles leave the ends of the profile alone, it must not lie in the wall.
        DVec2::new(0.01 + swell * step(1.0, 0.97), 0.34 * t)
    };
    let position = |s: f64, t: f64| {
        let p = profile(t);
        DVec3::new(HALL_M.x * (2.0 * s - 1.0), y + p.y, -ROW_Z_M + WALL_M + p.x)
    };
    mesh.patch(d.grid([60, 14]), Front::Along(DVec3::new(0.0, -0.3, 1.0)), position, |s, t| {
        DVec2::new(15.0 * s, 0.3 * (1.0 - t))
    });
}

/// A stone foot along the outer wall.
fn skirting(mesh: &mut MeshData, d: Detail) {
    let position = |s: f64, t: f64| {
        let out = 0.12 * (1.0 - textures::smoothstep(0.7, 1.0, t as f32) as f64);
        DVec3::new(HALL_M.x * (2.0 * s - 1.0), 0.6 * t, -HALL_M.z + out)
    };
    mesh.patch(d.grid([60, 5]), Front::Along(DVec3::Z), position, |s, t| {
        DVec2::new(15.0 * s, 0.3 * (1.0 - t))
    });
}

/// Radius of the rose windows, metres.
const ROSE_M: f64 = 1.7;
/// Height of their centres, metres.
const ROSE_Y_M: f64 = 5.4;

/// The wall at either end: a rose window in the nave, plain wall below and beside it.
fn end_walls(b: &mut SceneBuilder, m: &Materials, d: Detail) {
    // modelled around the window's centre, facing +Z, then turned to both ends
    let above = HALL_M.y - ROSE_Y_M;
    let mut wall = d.mesh();
    let half_m = DVec2::new(ROW_Z_M, above);
    let [around, across] = d.grid([64, 6]);
    for sector in sectors(half_m, TAU, around) {
        sector.wall(&mut wall, across, DVec3::Z, ROSE_M, half_m, 0.0);
    }
    let lower = ROSE_Y_M - above;
    wall.rectangle(
        d.grid([16, 8]),
        DVec3::Z,
        DVec3::new(-ROW_Z_M, -ROSE_Y_M, 0.0),
        [DVec3::X * (2.0 * ROW_Z_M), DVec3::Y * lower],
        0.5,
    );
    for x in [-HALL_M.z, ROW_Z_M] {
        let edges = [DVec3::X * (HALL_M.z - ROW_Z_M), DVec3::Y * (AISLE_M + 0.12)];
        wall.rectangle(d.grid([8, 12]), DVec3::Z, DVec3::new(x, -ROSE_Y_M, 0.0), edges, 0.5);
    }
    let wall = b.mesh("end wall", &wall, m.brick);
    let mut frame = d.mesh();
    let circle = |s: f64| DVec3::new((TAU * s).cos(), (TAU * s).sin(), 0.0) * ROSE_M;
    frame.tube(d.grid([72, 10]), circle, 0.14, DVec3::Z, DVec2::new(12.0, 1.0));
    let frame = b.mesh("rose frame", &frame, m.limestone);
    let mut pane = d.mesh();
    pane.patch(
        d.grid([48, 8]),
        Front::Along(DVec3::Z),
        |s, t| DVec3::new((TAU * s).cos(), (TAU * s).sin(), 0.0) * (ROSE_M * (0.02 + 0.98 * t)),
        |s, t| DVec2::splat(0.5) + 0.5 * (0.02 + 0.98 * t) * DVec2::new((TAU * s).cos(), -(TAU * s).sin()),
    );
    let pane = b.mesh("rose window", &pane, m.rose);
    for (name, x, angle) in [("west", -HALL_M.x, 0.5 * PI), ("east", HALL_M.x, -0.5 * PI)] {
        let placed = translated(x, ROSE_Y_M, 0.0) * Affine3A::from_rotation_y(angle as f32);
        for (what, mesh) in [("wall", wall), ("rose frame", frame), ("rose window", pane)] {
            b.place(&format!("{name} {what}"), mesh, placed);
        }
    }
}

/// Columns and arches.
fn arcade(b: &mut SceneBuilder, m: &Materials, d: Detail) {
    let column = column(d);
    let column = b.mesh("column", &column, m.limestone);
    let arch = arch(d);
    let arch = b.mesh("arch", &arch, m.limestone);
    for i in 0..=BAYS {
        let x = BAY_M * (f64::from(i) - 0.5 * f64::from(BAYS));
        for (row, z) in [("north", -ROW_Z_M), ("south", ROW_Z_M)] {
            // each turned by some flutes, so that no two show the same stains
            let turned = Affine3A::from_rotation_y((i as f32) * 3.0 * (TAU as f32) / FLUTES as f32);
            b.place(&format!("{row} column {i}"), column, translated(x, 0.0, z) * turned);
        }
        if i < BAYS {
            let placed = translated(x + 0.5 * BAY_M, SPRING_M, -ROW_Z_M);
            b.place(&format!("north arch {i}"), arch, placed);
            b.place(&format!("south arch {i}, mirrored"), arch, mirrored_z() * placed);
        }
    }
    let mut pier = d.mesh();
    let half_x = 0.5 * (HALL_M.x - 0.5 * BAY_M * f64::from(BAYS));
    for x in [-HALL_M.x + half_x, HALL_M.x - half_x] {
        let height = AISLE_M - SPRING_M;
        pier.cuboid(
            DVec3::new(x, SPRING_M + 0.5 * height, -ROW_Z_M),
            DVec3::new(half_x, 0.5 * height, WALL_M),
            0.5,
        );
    }
    let pier = b.mesh("end spandrels", &pier, m.limestone);
    place_on_both_sides(b, "end spandrels", pier);
}

/// A fluted column on a moulded base, with a capital, from the floor to [`SPRING_M`].
fn column(d: Detail) -> MeshData {
    /// Depth of the flutes, metres.
    const FLUTE_M: f64 = 0.035;
    let mut mesh = d.mesh();
    mesh.cuboid(DVec3::Y * 0.09, DVec3::new(0.47, 0.09, 0.47), 1.0);
    let base = |t: f64| {
        // two tori with a hollow between
        let bulge = 0.06 * (TAU * 1.25 * t - 0.5 * PI).sin();
        DVec2::new(0.40 - 0.055 * t + bulge, 0.18 + 0.3 * t)
    };
    let around = d.steps(48, 4);
    mesh.revolve([around, d.grid([18, 1])[0]], DVec3::ZERO, false, base, DVec2::new(2.0, 0.3));
    let (foot, head) = (0.48, 3.06);
    let shaft = |s: f64, t: f64| {
        let angle = TAU * s.fract();
        // entasis: a slight swelling below the middle
        let radius = 0.33 - 0.055 * t * t + 0.008 * (PI * t).sin();
        let ends =
            f64::from(textures::smoothstep(0.0, 0.04, t as f32) * textures::smoothstep(1.0, 0.96, t as f32));
        let radius = radius - FLUTE_M * ends * (0.5 * f64::from(FLUTES) * angle).sin().abs();
        DVec3::new(radius * angle.cos(), foot + (head - foot) * t, -radius * angle.sin())
    };
    let divisions = [d.steps(8 * FLUTES, FLUTES), d.grid([14, 1])[0]];
    let axis = DVec3::Y * (0.5 * (foot + head));
    mesh.patch(divisions, Front::AwayFrom(axis), shaft, |s, t| DVec2::new(2.0 * s, 2.6 * (1.0 - t)));
    let capital = |t: f64| {
        let ring = 0.03 * (PI * (t / 0.2).min(1.0)).sin();
        let flare = 0.17 * f64::from(textures::smoothstep(0.15, 1.0, t as f32));
        DVec2::new(0.275 + ring + flare, 3.06 + 0.28 * t)
    };
    mesh.revolve([around, d.grid([16, 1])[0]], DVec3::ZERO, false, capital, DVec2::new(2.0, 0.3));
    mesh.cuboid(DVec3::Y * 3.42, DVec3::new(0.46, 0.08, 0.46), 1.0);
    mesh
}

/// One bay's arch, the middle of its springing at the origin; the nave is at +Z.
fn arch(d: Detail) -> MeshData {
    let mut mesh = d.mesh();
    let height = AISLE_M - SPRING_M;
    let circle = |s: f64| DVec3::new((PI * s).cos(), (PI * s).sin(), 0.0);
    let half_m = DVec2::new(0.5 * BAY_M, height);
    let [along, across] = d.grid([36, 5]);
    for sector in sectors(half_m, PI, along) {
        for (z, front) in [(WALL_M, DVec3::Z), (-WALL_M, DVec3::NEG_Z)] {
            sector.wall(&mut mesh, across, front, ARCH_M, half_m, z);
        }
        mesh.patch(
            [sector.divisions, across],
            Front::Towards(DVec3::ZERO),
            |s, t| (sector.direction(s) * ARCH_M).extend(WALL_M * (2.0 * t - 1.0)),
            |s, t| DVec2::new((sector.angles[0] + (sector.angles[1] - sector.angles[0]) * s) * 0.6, 0.34 * t),
        );
    }
    for (radius, thick) in [(ARCH_M + 0.09, 0.07), (ARCH_M + 0.24, 0.035)] {
        let ring = |s: f64| circle(s) * radius + DVec3::Z * WALL_M;
        mesh.tube(d.grid([36, 8]), ring, thick, DVec3::Z, DVec2::new(4.0, 0.4));
    }
    // the undersides between the arch and the column's abacus
    for x in [-0.5 * BAY_M, ARCH_M] {
        let edges = [DVec3::X * (0.5 * BAY_M - ARCH_M), DVec3::Z * (2.0 * WALL_M)];
        mesh.rectangle([1, 1], DVec3::NEG_Y, DVec3::new(x, 0.0, -WALL_M), edges, 0.5);
    }
    mesh
}

/// A basin with water and a bronze knot in the middle of the nave.
fn fountain(b: &mut SceneBuilder, m: &Materials, d: Detail) {
    let mut stone = d.mesh();
    let (inner, rim) = (1.25, 0.62);
    let outside = |t: f64| DVec2::new(1.45 - 0.12 * (PI * t).sin() + 0.06 * (TAU * 2.0 * t).sin(), rim * t);
    stone.revolve(d.grid([72, 14]), DVec3::ZERO, false, outside, DVec2::new(6.0, 0.4));
    stone.revolve(
        d.grid([72, 6]),
        DVec3::ZERO,
        true,
        |t| DVec2::new(inner, 0.1 + (rim - 0.1) * t),
        DVec2::new(6.0, 0.4),
    );
    let ring = |y: f64, from: f64, to: f64| {
        move |s: f64, t: f64| {
            let (radius, angle) = (from + (to - from) * t, TAU * s.fract());
            DVec3::new(radius * angle.cos(), y, -radius * angle.sin())
        }
    };
    let flat_uv = |s: f64, t: f64| DVec2::new((TAU * s).cos(), (TAU * s).sin()) * (0.3 + 0.4 * t);
    stone.patch(d.grid([72, 3]), Front::Along(DVec3::Y), ring(rim, inner, 1.45), flat_uv);
    stone.patch(d.grid([48, 4]), Front::Along(DVec3::Y), ring(0.1, 0.2, inner), flat_uv);
    let pedestal =
        |t: f64| DVec2::new(0.34 - 0.16 * (PI * t).sin() + 0.02 * (9.0 * PI * t).sin(), 0.1 + 1.0 * t);
    stone.revolve(d.grid([40, 24]), DVec3::ZERO, false, pedestal, DVec2::new(3.0, 1.0));
    b.add("fountain", &stone, m.limestone);

    let mut water = d.mesh();
    let ripple = |s: f64, t: f64| {
        let p = ring(0.5, 0.2, inner)(s, t);
        p + DVec3::Y * (0.012 * (28.0 * t).sin() * (1.0 - 0.7 * t))
    };
    water.patch(d.grid([48, 16]), Front::Along(DVec3::Y), ripple, flat_uv);
    b.add("water", &water, m.water);

    let mut knot = d.mesh();
    let curve = |s: f64| {
        // a (2, 3) torus knot, standing
        let a = TAU * s;
        let r = 0.36 + 0.15 * (3.0 * a).cos();
        DVec3::new(r * (2.0 * a).cos(), 1.62 + r * (2.0 * a).sin(), -0.17 * (3.0 * a).sin())
    };
    knot.tube(d.grid([220, 18]), curve, 0.085, DVec3::new(0.05, 0.03, 1.0), DVec2::new(10.0, 1.0));
    b.add("bronze knot", &knot, m.bronze);
}

/// Curtains in some arches, banners on the clerestory, canopies across the nave.
fn hang_cloth(b: &mut SceneBuilder, m: &Materials, d: Detail) {
    let rod_y = SPRING_M - 0.22;
    for (i, bay) in [0, 2, 3, 5, 6, 8].into_iter().enumerate() {
        let x = BAY_M * (f64::from(bay) - 0.5 * f64::from(BAYS - 1));
        for (row, z) in [("north", -ROW_Z_M), ("south", ROW_Z_M)] {
            let material = m.drapes[(i + usize::from(z > 0.0)) % 3];
            let data = curtains(d, (i as f64) * 1.7 + z, rod_y);
            let mesh = b.mesh("curtains", &data, material);
            b.place(&format!("{row} curtains {bay}"), mesh, translated(x, 0.0, z));
        }
    }
    let mut rods = d.mesh();
    for bay in [0, 2, 3, 5, 6, 8] {
        let x = BAY_M * (f64::from(bay) - 0.5 * f64::from(BAYS - 1));
        let rod = |s: f64| DVec3::new(x + 2.5 * (s - 0.5), rod_y + 0.03, -ROW_Z_M);
        rods.tube(d.grid([4, 8]), rod, 0.028, DVec3::Y, DVec2::ONE);
    }
    let rods = b.mesh("curtain rods", &rods, m.iron);
    place_on_both_sides(b, "curtain rods", rods);
    for i in 0..4 {
        let x = -9.0 + 6.0 * f64::from(i);
        let mesh = banner(d, f64::from(i));
        let mesh = b.mesh("banner", &mesh, m.drapes[(i as usize + 1) % 3]);
        let north = translated(x, 0.0, -ROW_Z_M + WALL_M + 0.26);
        b.place(&format!("north banner {i}"), mesh, north);
        b.place(&format!("south banner {i}, mirrored"), mesh, mirrored_z() * north);
    }
    for (i, x) in [-10.5, 0.0, 10.5].into_iter().enumerate() {
        let mesh = canopy(d, i as f64);
        let mesh = b.mesh("canopy", &mesh, m.drapes[3]);
        b.place(&format!("canopy {i}"), mesh, translated(x, 0.0, 0.0));
    }
}

/// A pair of curtains from a rod at `rod_y`, gathered and tied back at the sides.
fn curtains(d: Detail, phase: f64, rod_y: f64) -> MeshData {
    let mut mesh = d.mesh();
    for side in [-1.0, 1.0] {
        let position = move |s: f64, t: f64| {
            // t runs down; the tie is at a third from below, where the cloth is narrowest
            let drop = 1.0 - (1.0 - t).powi(2) * 0.15;
            let gather = (-((t - 0.64) / 0.22).powi(2)).exp();
            let width = 1.08 * (1.0 - 0.66 * gather) * (1.0 - 0.12 * t);
            let x = side * (1.16 - width * s);
            let folds = TAU * (5.0 * s + 0.3 * (phase + 2.0 * t).sin());
            let depth = (0.05 + 0.05 * t) * (1.0 - 0.45 * gather);
            let z = depth * folds.sin() + 0.012 * (2.0 * folds + phase).sin() * t + 0.06 * gather;
            let y = rod_y - (rod_y - 0.05) * t * drop - 0.02 * (PI * s).sin() * t;
            DVec3::new(x, y, z)
        };
        // at least four divisions a fold: fewer would turn triangles against their normals
        let divisions = [d.steps(60, 20), d.steps(32, 8)];
        mesh.patch(divisions, Front::Along(DVec3::Z), position, |s, t| DVec2::new(s, 2.4 * t));
    }
    mesh
}

/// A long banner before the clerestory, forked below, that the wind has caught.
fn banner(d: Detail, phase: f64) -> MeshData {
    let position = move |s: f64, t: f64| {
        let across = 2.0 * s - 1.0;
        let length = 3.1 - 0.45 * (1.0 - across.abs()) * t;
        let wave =
            0.09 * t * (4.0 * t + 1.3 * s + phase).sin() + 0.02 * (9.0 * s + 6.0 * t + phase).sin() * t;
        DVec3::new(0.62 * across, 7.5 - length * t, wave + 0.05 * (1.0 - across * across))
    };
    d.mesh().with_patch(d.grid([20, 40]), Front::Along(DVec3::Z), position, |s, t| DVec2::new(s, 2.5 * t))
}

/// A cloth that sags from one row of columns to the other.
fn canopy(d: Detail, phase: f64) -> MeshData {
    let position = move |s: f64, t: f64| {
        let across = 2.0 * t - 1.0;
        let sag = 1.1 * (1.0 - across * across) + 0.12 * (PI * s).sin() * (1.0 - across.powi(4));
        let ripple = 0.05 * (14.0 * s + 2.0 * across + phase).sin();
        DVec3::new(1.9 * (s - 0.5), 7.55 - sag + ripple, (ROW_Z_M - WALL_M) * across)
    };
    d.mesh().with_patch(d.grid([28, 48]), Front::Along(DVec3::Y), position, |s, t| DVec2::new(s, 3.0 * t))
}

/// One spray of leaves: a card bent outwards from its foot.
struct Spray {
    foot: DVec3,
    /// Direction in which it leans, radians about +Y.
    heading_rad: f64,
    height_m: f64,
    /// How far it leans and bends over, metres at the tip.
    lean_m: f64,
    /// Whether it hangs.
    hanging: bool,
}

fn spray(mesh: &mut MeshData, d: Detail, spray: &Spray) {
    let out = DVec3::new(spray.heading_rad.cos(), 0.0, -spray.heading_rad.sin());
    let side = out.cross(DVec3::Y);
    let up = if spray.hanging { -1.0 } else { 1.0 };
    let half_width = 0.36 * spray.height_m;
    let position = |s: f64, t: f64| {
        let across = 2.0 * s - 1.0;
        let curl = -0.1 * half_width * across * across;
        spray.foot
            + side * (half_width * across)
            + out * (spray.lean_m * t * t + curl)
            + DVec3::Y * (up * spray.height_m * t * (1.0 - 0.18 * t))
    };
    mesh.patch(d.grid([4, 6]), Front::Along(out + DVec3::Y), position, |s, t| DVec2::new(s, 1.0 - t));
}

/// Potted plants beside the columns, and ivy that hangs from the cornice.
fn plants(b: &mut SceneBuilder, m: &Materials, d: Detail) {
    let mut rng = SplitMix64::new(7);
    let mut pot = d.mesh();
    let outside = |t: f64| {
        let lip = 0.035 * f64::from(textures::smoothstep(0.8, 0.84, t as f32));
        DVec2::new(0.2 + 0.1 * t + lip, 0.5 * t)
    };
    pot.revolve(d.grid([32, 16]), DVec3::ZERO, false, outside, DVec2::new(2.0, 1.0));
    pot.revolve(
        d.grid([32, 2]),
        DVec3::ZERO,
        true,
        |t| DVec2::new(0.335 - 0.035 * (1.0 - t), 0.4 + 0.1 * t),
        DVec2::ONE,
    );
    let pot = b.mesh("pot", &pot, m.terracotta);
    let mut soil = d.mesh();
    let disc = |s: f64, t: f64| {
        let angle = TAU * s.fract();
        DVec3::new(angle.cos() * 0.31 * t, 0.44 + 0.03 * (1.0 - t * t), -angle.sin() * 0.31 * t)
    };
    soil.patch(d.grid([24, 2]), Front::Along(DVec3::Y), disc, DVec2::new);
    let soil = b.mesh("soil", &soil, m.soil);
    let shrubs = [0, 1, 2].map(|kind| {
        let mut mesh = d.mesh();
        for i in 0..22 {
            let ring = f64::from(i) / 22.0;
            let heading_rad = 2.4 * f64::from(i) + f64::from(rng.between(-0.3, 0.3));
            let out = DVec3::new(heading_rad.cos(), 0.0, -heading_rad.sin());
            let height_m = f64::from(rng.between(0.75, 1.15)) * (1.15 - 0.45 * ring);
            let lean_m = 0.1 + 0.55 * ring + f64::from(rng.between(0.0, 0.15));
            let foot = out * (0.03 + 0.16 * ring) + DVec3::Y * 0.42;
            spray(&mut mesh, d, &Spray { foot, heading_rad, height_m, lean_m, hanging: false });
        }
        b.mesh(&format!("shrub {kind}"), &mesh, m.leaves)
    });
    for i in 0..BAYS + 1 {
        for (row, z) in [("north", -2.35), ("south", 2.35)] {
            if (i + u32::from(z > 0.0)) % 2 == 1 {
                continue;
            }
            let x = BAY_M * (f64::from(i) - 0.5 * f64::from(BAYS)) + f64::from(rng.between(-0.12, 0.12));
            let placed = translated(x, 0.0, z) * Affine3A::from_rotation_y(rng.between(0.0, TAU as f32));
            b.place(&format!("{row} pot {i}"), pot, placed);
            b.place(&format!("{row} soil {i}"), soil, placed);
            b.place(&format!("{row} shrub {i}"), shrubs[i as usize % 3], placed);
        }
    }
    let mut ivy = d.mesh();
    for i in 0..72 {
        let x = -HALL_M.x + 0.3 + 29.4 * f64::from(i) / 71.0 + f64::from(rng.between(-0.15, 0.15));
        let foot = DVec3::new(x, AISLE_M + 0.38 - f64::from(rng.between(0.0, 0.1)), -ROW_Z_M + WALL_M + 0.2);
        let heading_rad = -0.5 * PI + f64::from(rng.between(-0.5, 0.5));
        let height_m = f64::from(rng.between(0.45, 1.0));
        spray(&mut ivy, d, &Spray { foot, heading_rad, height_m, lean_m: 0.08, hanging: true });
    }
    let ivy = b.mesh("ivy", &ivy, m.leaves);
    place_on_both_sides(b, "ivy", ivy);
}

/// Where lanterns hang: in every second arch, and over the aisles' middles.
fn lantern_places() -> Vec<DVec3> {
    let mut places = Vec::new();
    for bay in [1, 4, 7] {
        let x = BAY_M * (f64::from(bay) - 0.5 * f64::from(BAYS - 1));
        for z in [-ROW_Z_M, ROW_Z_M] {
            places.push(DVec3::new(x, 3.35, z));
            places.push(DVec3::new(x + BAY_M, 3.1, z.signum() * 4.75));
        }
    }
    places
}

/// Lanterns: a chain, an iron cage, a glowing globe.
fn lanterns(b: &mut SceneBuilder, m: &Materials, d: Detail) {
    let mut globe = d.mesh();
    globe.sphere(d.steps(28, 4), DVec3::ZERO, 0.13);
    let globe = b.mesh("lantern globe", &globe, m.flame);
    let mut cage = d.mesh();
    for (y, radius) in [(-0.17, 0.1), (0.0, 0.17), (0.17, 0.1)] {
        let ring = move |s: f64| DVec3::new((TAU * s).cos() * radius, y, -(TAU * s).sin() * radius);
        cage.tube(d.grid([28, 6]), ring, 0.012, DVec3::Y, DVec2::ONE);
    }
    for k in 0..6 {
        let angle = TAU * f64::from(k) / 6.0;
        let out = DVec3::new(angle.cos(), 0.0, -angle.sin());
        let rib = move |s: f64| out * (0.17 - 0.07 * (2.0 * s - 1.0).powi(2)) + DVec3::Y * (0.34 * s - 0.17);
        cage.tube(d.grid([8, 5]), rib, 0.009, DVec3::new(out.z, 0.0, -out.x), DVec2::ONE);
    }
    let cap = |t: f64| DVec2::new(0.13 * (1.0 - t) + 0.012, 0.17 + 0.1 * t * t);
    cage.revolve(d.grid([20, 4]), DVec3::ZERO, false, cap, DVec2::ONE);
    cage.tube(d.grid([2, 5]), |s| DVec3::Y * (0.26 + 0.72 * s), 0.008, DVec3::X, DVec2::ONE);
    let cage = b.mesh("lantern cage", &cage, m.iron);
    for (i, p) in lantern_places().into_iter().enumerate() {
        let placed = translated(p.x, p.y, p.z);
        b.place(&format!("lantern globe {i}"), globe, placed);
        b.place(&format!("lantern cage {i}"), cage, placed);
    }
}

/// Screens of glass in iron frames across the aisles.
fn panes(b: &mut SceneBuilder, m: &Materials, d: Detail) {
    let mut frame = d.mesh();
    for z in [-0.8, 0.8] {
        frame.cuboid(DVec3::new(0.0, 1.2, z), DVec3::new(0.03, 1.2, 0.03), 1.0);
    }
    for y in [0.12, 1.2, 2.37] {
        frame.cuboid(DVec3::new(0.0, y, 0.0), DVec3::new(0.03, 0.03, 0.77), 1.0);
    }
    let frame = b.mesh("screen frame", &frame, m.iron);
    let mut glass = d.mesh();
    let edges = [DVec3::Z * 1.54, DVec3::Y * 2.22];
    glass.rectangle(d.grid([4, 6]), DVec3::X, DVec3::new(0.0, 0.15, -0.77), edges, 1.0);
    let glass = b.mesh("screen glass", &glass, m.glass);
    for (i, x) in [-7.5, -1.5, 4.5, 10.5].into_iter().enumerate() {
        for z in [-4.6, 4.6] {
            let side = if z < 0.0 { "north" } else { "south" };
            b.place(&format!("{side} screen frame {i}"), frame, translated(x, 0.0, z));
            b.place(&format!("{side} screen glass {i}"), glass, translated(x, 0.0, z));
        }
    }
}

/// The sun, a lamp in every lantern, and a spot on the fountain.
fn lights() -> Vec<Light> {
    let mut lights = vec![Light {
        kind: LightKind::Directional,
        position_ws: Vec3::ZERO,
        direction_ws: Vec3::new(0.42, -1.0, -0.36).normalize(),
        intensity: Vec3::new(2.9, 2.6, 2.15),
        range_m: f32::INFINITY,
    }];
    lights.extend(
        lantern_places()
            .into_iter()
            .map(|p| Light { range_m: 6.5, ..lamp(p.as_vec3() - Vec3::Y * 0.2, Vec3::new(8.0, 5.2, 2.6)) }),
    );
    lights.push(Light {
        kind: LightKind::Spot { inner_angle_rad: 0.16, outer_angle_rad: 0.42 },
        position_ws: Vec3::new(-2.6, 7.0, 0.8),
        direction_ws: Vec3::new(2.6, -5.6, -0.8).normalize(),
        intensity: Vec3::new(60.0, 66.0, 80.0),
        range_m: 14.0,
    });
    lights
}

/// The first shows columns, drapes and foliage close; the last two are hard cases for tests.
fn cameras() -> Vec<Camera> {
    let camera = |name: &str, eye: [f32; 3], target: [f32; 3], fov_deg: f32| {
        Camera::look_at(name, eye.into(), target.into(), fov_deg.to_radians(), 0.05)
    };
    vec![
        camera("nave", [-9.6, 1.75, 1.35], [-2.0, 2.55, -1.55], 58.0),
        camera("axis", [-13.2, 2.4, 0.0], [0.0, 3.2, 0.0], 60.0),
        camera("aisle", [-13.0, 1.7, -4.7], [0.0, 1.9, -4.5], 60.0),
        camera("fountain", [-2.6, 2.3, 2.2], [0.0, 1.2, 0.0], 50.0),
        camera("plan", [0.0, 24.0, 0.01], [0.0, 0.0, 0.0], 45.0),
        // inside the clerestory's masonry
        camera("wall", [0.5, 6.5, -3.2], [10.0, 6.5, -3.2], 60.0),
        // nothing but sky
        camera("away", [0.0, 20.0, 0.0], [0.0, 40.0, 1.0], 60.0),
    ]
}
