//! Pieces of meshes: the triangles of each mesh in an order that keeps every 1,024 of them compact in space.

use afterlight_scene::{Aabb, Mesh, Scene};
use glam::Vec3;
use rayon::prelude::*;

use crate::scene::draws::DRAW_TRIANGLES;

/// All indices, the triangles of each mesh ordered so that its pieces of 1,024 are compact, and each piece's bounds in
/// object space. Files order triangles by material or tool, and a piece that spans the scene is neither culled nor sorted.
pub(super) fn compact_pieces(scene: &Scene) -> (Vec<u32>, Vec<Vec<Aabb>>) {
    let ordered: Vec<(Vec<u32>, Vec<Aabb>)> =
        scene.meshes.par_iter().map(|mesh| compact_mesh(scene, mesh)).collect();
    let mut indices = scene.indices.clone();
    for (mesh, (order, _)) in scene.meshes.iter().zip(&ordered) {
        let first = mesh.first_index as usize;
        let old = &scene.indices[first..first + mesh.index_count as usize];
        for (new, triangle) in indices[first..].chunks_exact_mut(3).zip(order) {
            new.copy_from_slice(&old[*triangle as usize * 3..][..3]);
        }
    }
    (indices, ordered.into_iter().map(|(_, bounds)| bounds).collect())
}

/// The new order of a mesh's triangles and the bounds of its pieces.
fn compact_mesh(scene: &Scene, mesh: &Mesh) -> (Vec<u32>, Vec<Aabb>) {
    let first = mesh.first_index as usize;
    let indices = &scene.indices[first..first + mesh.index_count as usize];
    let positions = &scene.positions_os[mesh.first_vertex as usize..];
    let corner = |triangle: u32, k: usize| Vec3::from(positions[indices[triangle as usize * 3 + k] as usize]);
    let mut order: Vec<u32> = (0..mesh.index_count / 3).collect();
    if order.len() > DRAW_TRIANGLES as usize {
        let centroids: Vec<Vec3> =
            order.iter().map(|&t| (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0).collect();
        split_by_place(&mut order, &centroids);
    }
    let bounds = order
        .chunks(DRAW_TRIANGLES as usize)
        .map(|piece| {
            let mut bounds = Aabb::EMPTY;
            piece.iter().for_each(|&t| (0..3).for_each(|k| bounds.extend(corner(t, k))));
            bounds
        })
        .collect();
    (order, bounds)
}

/// Splits triangles by the median of their centroids along the longest axis until pieces have at most 1,024; all pieces
/// but the last are full. Within a piece the old order stays, for the vertex cache.
fn split_by_place(order: &mut [u32], centroids: &[Vec3]) {
    let pieces = order.len().div_ceil(DRAW_TRIANGLES as usize);
    if pieces <= 1 {
        order.sort_unstable();
        return;
    }
    let mut bounds = Aabb::EMPTY;
    order.iter().for_each(|&t| bounds.extend(centroids[t as usize]));
    let axis = bounds.size().max_position();
    let middle = pieces / 2 * DRAW_TRIANGLES as usize;
    order.select_nth_unstable_by(middle, |&a, &b| {
        centroids[a as usize][axis].total_cmp(&centroids[b as usize][axis]).then(a.cmp(&b))
    });
    let (low, high) = order.split_at_mut(middle);
    split_by_place(low, centroids);
    split_by_place(high, centroids);
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_scene::load_source;

    /// Each mesh keeps its triangles, and pieces hold theirs.
    #[test]
    fn compact_pieces_keep_every_triangle() {
        let scene = load_source("builtin:colonnade?triangles=30000&texture=16", &Default::default()).unwrap();
        let (indices, bounds) = compact_pieces(&scene);
        let mut cut = 0;
        for (mesh, pieces) in scene.meshes.iter().zip(&bounds) {
            let range = mesh.first_index as usize..(mesh.first_index + mesh.index_count) as usize;
            let sorted = |list: &[u32]| {
                let mut triangles: Vec<[u32; 3]> = list.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
                triangles.sort_unstable();
                triangles
            };
            assert_eq!(
                sorted(&scene.indices[range.clone()]),
                sorted(&indices[range.clone()]),
                "{}",
                mesh.name
            );
            assert_eq!(pieces.len() as u32, (mesh.index_count / 3).div_ceil(DRAW_TRIANGLES));
            for (piece, held) in indices[range].chunks(3 * DRAW_TRIANGLES as usize).zip(pieces) {
                for &i in piece {
                    let p = Vec3::from(scene.positions_os[(mesh.first_vertex + i) as usize]);
                    assert!(p.cmpge(held.min).all() && p.cmple(held.max).all(), "{}", mesh.name);
                }
            }
            cut += pieces.len() - 1;
        }
        assert!(cut > 0, "no mesh of the scene is cut");
    }
}
