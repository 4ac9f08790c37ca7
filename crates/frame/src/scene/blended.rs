//! The order in which triangles with alpha blending are drawn: back to front, found on the CPU.

use std::{ops::Range, sync::Arc};

use afterlight_scene::{Aabb, Scene};
use afterlight_shader::structs::{BlendedTriangle, DrawData};
use glam::{Mat4, Vec3, Vec4};

use crate::scene::{
    DrawInfo,
    draw_list::{DrawCommand, Frustum, displaced, dot},
};
use crate::sort_words::{greatest_first, place_of};

/// What the CPU keeps of a scene's draws with alpha blending.
#[derive(Clone)]
pub struct Blended {
    draws: Vec<BlendedDraw>,
    /// Centroids of all triangles, draw by draw, object space, m.
    centroids_os: Arc<[Vec3]>,
    /// The same in world space.
    centroids_ws: Vec<Vec3>,
    /// Their corners, counted from the first vertex of their draw.
    corners: Arc<[[u32; 3]]>,
    /// The draw of each, by its place in `draws`.
    draw_of: Arc<[u32]>,
}

/// What the device orders triangles by, of all of them, draw by draw.
pub(super) fn records(blended: &Blended, infos: &[DrawInfo]) -> Vec<BlendedTriangle> {
    let of_draw = |(draw, info): (&BlendedDraw, &DrawInfo)| {
        let first = draw.triangles.start;
        let (number, first_index) = (draw.number, info.first_index);
        draw.triangles.clone().map(move |triangle| BlendedTriangle {
            centroid_os: blended.centroids_os[triangle].into(),
            draw: number,
            first_index: first_index + 3 * (triangle - first) as u32,
        })
    };
    blended.draws.iter().zip(infos).flat_map(of_draw).collect()
}

#[derive(Clone)]
struct BlendedDraw {
    /// Its number among all draws of the scene.
    number: u32,
    bounds_ws: Aabb,
    first_vertex: u32,
    /// Its triangles in [`Blended::corners`].
    triangles: Range<usize>,
}

/// How a view orders triangles.
pub struct ViewOrder {
    /// Leaves out draws outside of this view.
    pub cull: Option<Mat4>,
    /// The view distance of a point p is dot(xyz, p) + w, m.
    pub distance_from_world: Vec4,
    /// How far surfaces may be displaced along each axis, m.
    pub displacement_m: f32,
}

/// Triangles in drawing order.
#[derive(Default)]
pub struct Ordered {
    /// Three a triangle, counted from the first vertex of its draw.
    pub indices: Vec<u32>,
    /// One a run of triangles of one draw.
    pub commands: Vec<DrawCommand>,
    /// Draws in view.
    pub draw_count: u32,
}

impl Blended {
    /// Box of all of them.
    pub fn bounds_ws(&self) -> Aabb {
        self.draws.iter().fold(Aabb::EMPTY, |bounds, draw| bounds.union(&draw.bounds_ws))
    }

    /// Of draws given by their records and bounds; the first has the number `first_number`. `indices` are those that the
    /// draws refer to.
    pub fn new(
        scene: &Scene,
        indices: &[u32],
        records: &[DrawData],
        infos: &[DrawInfo],
        first_number: usize,
    ) -> Self {
        let (mut draws, mut all_corners, mut draw_of) = (Vec::new(), Vec::new(), Vec::new());
        let (mut centroids_os, mut centroids_ws) = (Vec::new(), Vec::new());
        for (k, (record, info)) in records.iter().zip(infos).enumerate() {
            let first = all_corners.len();
            let positions_os = &scene.positions_os[info.first_vertex as usize..];
            for corners in indices[info.first_index as usize..][..info.index_count as usize].chunks_exact(3) {
                let sum_os: Vec3 = corners.iter().map(|&i| Vec3::from(positions_os[i as usize])).sum();
                centroids_os.push(sum_os / 3.0);
                centroids_ws.push(to_world(record, sum_os / 3.0));
                all_corners.push([corners[0], corners[1], corners[2]]);
            }
            draw_of.resize(all_corners.len(), k as u32);
            draws.push(BlendedDraw {
                number: (first_number + k) as u32,
                bounds_ws: info.bounds_ws,
                first_vertex: info.first_vertex,
                triangles: first..all_corners.len(),
            });
        }
        Self {
            draws,
            centroids_os: centroids_os.into(),
            centroids_ws,
            corners: all_corners.into(),
            draw_of: draw_of.into(),
        }
    }

    /// Moves a draw, by its place among those with alpha blending, to where its record says, within these bounds.
    pub fn place(&mut self, place: usize, record: &DrawData, bounds_ws: Aabb) {
        let Some(draw) = self.draws.get_mut(place) else { return };
        draw.bounds_ws = bounds_ws;
        for triangle in draw.triangles.clone() {
            self.centroids_ws[triangle] = to_world(record, self.centroids_os[triangle]);
        }
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.corners.len()
    }

    /// Number of draws.
    pub fn draw_count(&self) -> usize {
        self.draws.len()
    }

    /// Places of the draws in view.
    fn in_view<'a>(&'a self, view: &'a ViewOrder) -> impl Iterator<Item = usize> + 'a {
        let frustum = view.cull.map(Frustum::new);
        let is_in_view = move |draw: &BlendedDraw| {
            let reached = displaced(&draw.bounds_ws, view.displacement_m);
            frustum.as_ref().is_none_or(|frustum| frustum.touches(&reached))
        };
        (0..self.draws.len()).filter(move |place| is_in_view(&self.draws[*place]))
    }

    /// Number of draws in view.
    pub fn in_view_count(&self, view: &ViewOrder) -> u32 {
        self.in_view(view).count() as u32
    }

    /// Orders the triangles of the draws in view from far to near by the view distance of their centroids; those of one distance as
    /// in the scene. The device comes to the same order (`compose/transparent/` of the stages).
    pub fn order(&self, view: &ViewOrder) -> Ordered {
        let visible: Vec<usize> = self.in_view(view).collect();
        let from_world = view.distance_from_world;
        let distance = |p: Vec3| dot(from_world.truncate(), p) + from_world.w;
        let mut ordered = Ordered { draw_count: visible.len() as u32, ..Ordered::default() };
        let triangles = visible.into_iter().flat_map(|place| self.draws[place].triangles.clone());
        let of_triangle = |triangle: usize| (distance(self.centroids_ws[triangle]), triangle);
        for triangle in back_to_front(triangles.map(of_triangle)) {
            let draw = &self.draws[self.draw_of[triangle] as usize];
            ordered.push(draw, &self.corners[triangle..=triangle]);
        }
        ordered
    }
}

/// Places from the greatest distance to the least; those of equal ones in their own order.
fn back_to_front(keyed: impl Iterator<Item = (f32, usize)>) -> impl Iterator<Item = usize> {
    let mut words: Vec<u64> =
        keyed.map(|(distance_m, place)| greatest_first(distance_m, place as u32)).collect();
    words.sort_unstable();
    words.into_iter().map(|word| place_of(word) as usize)
}

fn to_world(record: &DrawData, p_os: Vec3) -> Vec3 {
    let rows = [record.object_row0, record.object_row1, record.object_row2];
    Vec3::from(rows.map(|[x, y, z, w]| dot(Vec3::new(x, y, z), p_os) + w))
}

impl Ordered {
    /// Adds triangles of a draw, to the last run where that is of the same draw.
    fn push(&mut self, draw: &BlendedDraw, corners: &[[u32; 3]]) {
        if self.commands.last().is_none_or(|last| last.first_instance != draw.number) {
            self.commands.push(DrawCommand {
                index_count: 0,
                instance_count: 1,
                first_index: self.indices.len() as u32,
                vertex_offset: draw.first_vertex as i32,
                first_instance: draw.number,
            });
        }
        if let Some(last) = self.commands.last_mut() {
            last.index_count += 3 * corners.len() as u32;
        }
        self.indices.extend(corners.iter().flatten());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_scene::Camera;

    /// Draws whose triangles have their centroids at those distances, m; corners are numbered through a draw.
    fn blended(draws: &[&[f32]]) -> Blended {
        let (mut blended, mut corners) = (Vec::new(), Vec::new());
        let (mut centroids_ws, mut draw_of) = (Vec::new(), Vec::new());
        for (number, distances_m) in (10..).zip(draws) {
            let first = corners.len();
            let mut bounds_ws = Aabb::EMPTY;
            for (t, distance_m) in (0..).zip(*distances_m) {
                let centroid = Vec3::new(0.0, 0.0, -distance_m);
                bounds_ws.extend(centroid);
                centroids_ws.push(centroid);
                corners.push([3 * t, 3 * t + 1, 3 * t + 2]);
            }
            let triangles = first..corners.len();
            draw_of.resize(corners.len(), blended.len() as u32);
            blended.push(BlendedDraw { number, bounds_ws, first_vertex: 100 * number, triangles });
        }
        let centroids_os = centroids_ws.clone().into();
        let (corners, draw_of) = (corners.into(), draw_of.into());
        Blended { draws: blended, centroids_os, centroids_ws, corners, draw_of }
    }

    const VIEW: ViewOrder = ViewOrder { cull: None, distance_from_world: Vec4::NEG_Z, displacement_m: 0.0 };

    /// Draw and triangles of each run.
    fn runs(ordered: &Ordered) -> Vec<(u32, Vec<u32>)> {
        let run = |c: &DrawCommand| {
            let indices = &ordered.indices[c.first_index as usize..][..c.index_count as usize];
            assert_eq!((c.instance_count, c.vertex_offset as u32), (1, 100 * c.first_instance));
            (c.first_instance, indices.chunks_exact(3).map(|corners| corners[0] / 3).collect())
        };
        ordered.commands.iter().map(run).collect()
    }

    #[test]
    fn triangles_run_from_far_to_near() {
        let scene = blended(&[&[1.0, 5.0, 2.0], &[3.0, 4.0]]);
        let expected = vec![(10, vec![1]), (11, vec![1, 0]), (10, vec![2, 0])];
        assert_eq!(runs(&scene.order(&VIEW)), expected);
        // The other way round from the other side.
        let behind = ViewOrder { distance_from_world: Vec4::Z, ..VIEW };
        let expected = vec![(10, vec![0, 2]), (11, vec![0, 1]), (10, vec![1])];
        assert_eq!(runs(&scene.order(&behind)), expected);
    }

    #[test]
    fn equal_distances_keep_the_order_of_the_scene() {
        let scene = blended(&[&[2.0; 5], &[2.0; 3], &[2.0, 3.0]]);
        let expected = vec![(12, vec![1]), (10, vec![0, 1, 2, 3, 4]), (11, vec![0, 1, 2]), (12, vec![0])];
        assert_eq!(runs(&scene.order(&VIEW)), expected);
    }

    #[test]
    fn what_is_out_of_view_is_left_out() {
        let scene = blended(&[&[1.0, 2.0], &[-1.0, -2.0]]);
        let camera = Camera::look_at("along -z", Vec3::ZERO, Vec3::NEG_Z, 1.0, 0.1);
        let clip_from_world = camera.clip_from_view(1.0) * camera.view_from_world();
        let culled = ViewOrder { cull: Some(clip_from_world), ..VIEW };
        let ordered = scene.order(&culled);
        assert_eq!((runs(&ordered), ordered.draw_count), (vec![(10, vec![1, 0])], 1));
        let displaced = ViewOrder { displacement_m: 1.5, ..culled };
        assert_eq!(scene.order(&displaced).draw_count, 2);
    }
}
