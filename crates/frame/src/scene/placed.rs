//! Where the surfaces of a scene stand: what of them changes when nodes move.

use afterlight_scene::Aabb;
use afterlight_shader::structs::{DRAW_MIRRORED, DrawBounds, DrawData};
use glam::Affine3A;

use crate::scene::{DrawInfo, blended::Blended, deformed::PosedShapes, draw_list::displaced};

/// What a draw is a piece of.
#[derive(Clone, Copy, Debug)]
pub struct DrawSource {
    /// The instance, by its number in the scene.
    pub instance: u32,
    /// Bounds of the piece, object space.
    pub bounds_os: Aabb,
}

/// Where the surfaces of a scene stand at one time.
#[derive(Clone)]
pub struct Placed {
    /// Of all draws, those with alpha blending last.
    pub records: Vec<DrawData>,
    /// What the CPU needs of the draws in buckets.
    pub infos: Vec<DrawInfo>,
    /// Draws with alpha blending.
    pub blended: Blended,
    /// Joints and weights that give deformed meshes their shapes.
    pub shapes: PosedShapes,
    /// What the device chooses draws by, of all draws. Only shapes change it.
    pub draw_bounds: Vec<DrawBounds>,
    /// Box of the draws in buckets, and of those with alpha blending: kept, since every frame asks and scenes have many draws.
    bounds_ws: [Aabb; 2],
}

/// An instance that a motion has turned inside out: its draws would belong to another bucket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TurnedOver {
    /// The instance, by its number in the scene.
    pub instance: u32,
}

impl Placed {
    /// Draws where their records and bounds say.
    pub(super) fn new(
        records: Vec<DrawData>,
        infos: Vec<DrawInfo>,
        blended: Blended,
        shapes: PosedShapes,
        draw_bounds: Vec<DrawBounds>,
    ) -> Self {
        let bounds_ws = find_bounds(&infos, &blended);
        Self { records, infos, blended, shapes, draw_bounds, bounds_ws }
    }

    /// Box of all surfaces without alpha blending in world space, which displacement moves along each axis at most as far as said, m.
    pub fn bounds_ws(&self, displacement_m: f32) -> Aabb {
        displaced(&self.bounds_ws[0], displacement_m)
    }

    /// The same of all surfaces, those with alpha blending too.
    pub fn all_bounds_ws(&self, displacement_m: f32) -> Aabb {
        self.bounds_ws(displacement_m).union(&displaced(&self.bounds_ws[1], displacement_m))
    }

    /// Moves all draws to where their instances are: `sources` has one entry a draw, `world_from_objects` one an instance. `deformed` has the
    /// boxes, object space, of instances whose shapes a pose changes, by rising number of the instance.
    ///
    /// # Errors
    /// [`TurnedOver`], after which what is placed is undefined.
    pub fn place(
        &mut self,
        sources: &[DrawSource],
        world_from_objects: &[Affine3A],
        deformed: &[(u32, Aabb)],
    ) -> Result<(), TurnedOver> {
        let in_buckets = self.infos.len();
        for (i, (record, source)) in self.records.iter_mut().zip(sources).enumerate() {
            let Some(m) = world_from_objects.get(source.instance as usize) else { continue };
            let is_mirrored = m.matrix3.determinant() < 0.0;
            if is_mirrored != (record.flags & DRAW_MIRRORED != 0) {
                return Err(TurnedOver { instance: source.instance });
            }
            let rows = object_rows(m);
            let reshaped = deformed.binary_search_by_key(&source.instance, |(instance, _)| *instance).ok();
            let is_still = rows == [record.object_row0, record.object_row1, record.object_row2];
            if is_still && reshaped.is_none() {
                continue;
            }
            [record.object_row0, record.object_row1, record.object_row2] = rows;
            let bounds_os = reshaped.map_or(source.bounds_os, |at| deformed[at].1);
            if reshaped.is_some() {
                let of_draw = &mut self.draw_bounds[i];
                (of_draw.min_os, of_draw.max_os) = (bounds_os.min.into(), bounds_os.max.into());
            }
            let bounds_ws = bounds_os.transformed(m);
            match i.checked_sub(in_buckets) {
                None => self.infos[i].bounds_ws = bounds_ws,
                Some(place) => self.blended.place(place, record, bounds_ws),
            }
        }
        self.bounds_ws = find_bounds(&self.infos, &self.blended);
        Ok(())
    }
}

/// Boxes of the draws in buckets, and of those with alpha blending.
fn find_bounds(infos: &[DrawInfo], blended: &Blended) -> [Aabb; 2] {
    [infos.iter().fold(Aabb::EMPTY, |bounds, draw| bounds.union(&draw.bounds_ws)), blended.bounds_ws()]
}

/// Rows of a matrix as a draw's record has them.
pub(super) fn object_rows(m: &Affine3A) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|i| {
        let row = m.matrix3.row(i);
        [row.x, row.y, row.z, m.translation[i]]
    })
}
