//! Scenes far from the origin of their file's coordinates.
//!
//! A 32-bit float has 24 bits: 1,400 km from the origin neighbours are 0.125 m apart. So a scene that lies far away gets an
//! origin of its own beside it, [`Scene::origin_file`], and everything in memory and on the device is relative to that. The
//! difference is taken in 64 bits, before anything is rounded. A scene near the file's origin keeps it.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use crate::{Aabb, Node, Scene};

/// A scene is far where its centre is this many times its extent away, whatever its size: its positions would have
/// fewer than 18 of 24 bits left to tell places within it apart.
const FAR_EXTENTS: f64 = 64.0;

/// A scene is far as well where its centre is this far away, metres, and farther than its own extent: from here on 32-bit
/// floats are more than 0.06 mm apart, which counts where people stand in large scenes.
const FAR_M: f64 = 1024.0;

/// Where the origin of what lies in a box is to be: zero where the box is near, else a point near its centre, with few
/// digits. A box that is empty or not finite keeps zero.
pub(crate) fn origin_of(min: DVec3, max: DVec3) -> DVec3 {
    let (center, size_m) = (0.5 * (min + max), (max - min).max_element());
    let distance_m = center.abs().max_element();
    let far = distance_m > FAR_EXTENTS * size_m || distance_m > FAR_M && distance_m > size_m;
    if !(center.is_finite() && size_m >= 0.0 && far) {
        return DVec3::ZERO;
    }
    // A multiple of a power of two no greater than the extent: no more of the extent is lost than the half of it.
    // What 64 bits do not resolve at that distance is no extent.
    let size_m = size_m.max(distance_m * f64::EPSILON);
    let step_m = size_m.log2().floor().exp2();
    (center / step_m).round() * step_m
}

/// The corners of a box, transformed.
fn corners(bounds: &Aabb, m: &DAffine3) -> impl Iterator<Item = DVec3> {
    let (min, max, m) = (bounds.min.as_dvec3(), bounds.max.as_dvec3(), *m);
    let used = if bounds.is_empty() { 0 } else { 8 };
    (0..used).map(move |i| {
        let pick = glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0);
        m.transform_point3(DVec3::select(pick, max, min))
    })
}

impl Scene {
    /// Gives a scene that lies far from its origin an origin beside it: moves instances, lights and cameras, and vertices
    /// that are far from the origin of their object, so that [`Self::origin_file`] plus what is stored is where it was.
    /// Loaded scenes have had this done, in 64 bits; a scene that code has put together is as exact as its 32-bit matrices are.
    pub fn recentre(&mut self) {
        let worlds: Vec<DAffine3> =
            self.instances.iter().map(|i| i.world_from_object.as_daffine3()).collect();
        let delta = self.settle(&worlds);
        let moved = |p: glam::Vec3| (p.as_dvec3() - delta).as_vec3();
        self.lights.iter_mut().for_each(|light| light.position_ws = moved(light.position_ws));
        for camera in &mut self.cameras {
            camera.world_from_view.translation = moved(camera.eye_ws()).into();
        }
    }

    /// Chooses the origin and places the instances relative to it. `worlds` has the matrices of the instances in 64 bits,
    /// relative to the origin so far. Returns how far the origin has moved.
    pub(crate) fn settle(&mut self, worlds: &[DAffine3]) -> DVec3 {
        let all = self.instances.iter().zip(worlds);
        let all = all.flat_map(|(i, world)| corners(&self.meshes[i.mesh as usize].bounds_os, world));
        let (min, max) = all.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
        let delta = origin_of(min, max);
        let shifts = self.shift_vertices(worlds, min, max);
        let mut nodes: HashMap<(u32, [u64; 3]), u32> = HashMap::new();
        for (k, world) in worlds.iter().enumerate() {
            let shift = shifts.get(&self.instances[k].mesh).copied().unwrap_or(DVec3::ZERO);
            let mut placed = *world * DAffine3::from_translation(shift);
            placed.translation -= delta;
            self.instances[k].world_from_object = placed.as_affine3a();
            if shift != DVec3::ZERO {
                // The vertices have moved: a node of their own keeps them in their place when the scene is posed.
                let parent = self.instances[k].node;
                let node = *nodes.entry((parent, shift.to_array().map(f64::to_bits))).or_insert_with(|| {
                    let name = self.nodes.get(parent as usize).map_or_else(String::new, |n| n.name.clone());
                    let local = DAffine3::from_translation(shift);
                    self.nodes.push(Node { name, parent: Some(parent), local });
                    self.nodes.len() as u32 - 1
                });
                self.instances[k].node = node;
                // Vertices of a skin are written relative to that node from now on; those of a shape alone have moved with the mesh.
                if let Some(d) = self.deformation_of(k) {
                    self.deformations[d].object_node = node;
                }
            }
        }
        self.origin_file += delta;
        delta
    }

    /// Moves vertices that stand far from the origin of their object, compared to the extent of the scene, and returns by how
    /// much for each mesh that moved. All meshes under one matrix move alike, so that what they share stays shared.
    fn shift_vertices(&mut self, worlds: &[DAffine3], min: DVec3, max: DVec3) -> HashMap<u32, DVec3> {
        let (center, size) = (0.5 * (min + max), max - min);
        let mut by_range: HashMap<(u32, u32), DVec3> = HashMap::new();
        for (instance, world) in self.instances.iter().zip(worlds) {
            let mesh = &self.meshes[instance.mesh as usize];
            by_range.entry((mesh.first_vertex, mesh.vertex_count)).or_insert_with(|| {
                // Where the scene's centre is, seen from the object's origin along the world's axes.
                let away = center - world.translation;
                let shift = world.matrix3.inverse() * origin_of(away - 0.5 * size, away + 0.5 * size);
                // Rounded to what vertices can be told apart by at that distance, so that their differences to it are exact.
                let step = (shift.abs().max_element().log2() - 20.0).floor().exp2();
                let rounded = (shift / step).round() * step;
                if rounded.is_finite() { rounded } else { DVec3::ZERO }
            });
        }
        by_range.retain(|_, shift| *shift != DVec3::ZERO);
        for ((first, count), shift) in &by_range {
            let range = *first as usize..(*first + *count) as usize;
            for p in &mut self.positions_os[range] {
                *p = (DVec3::from_array(p.map(f64::from)) - *shift).as_vec3().to_array();
            }
        }
        let mut shifts = HashMap::new();
        for (m, mesh) in self.meshes.iter_mut().enumerate() {
            let Some(shift) = by_range.get(&(mesh.first_vertex, mesh.vertex_count)) else { continue };
            let bounds = &mut mesh.bounds_os;
            (bounds.min, bounds.max) =
                ((bounds.min.as_dvec3() - *shift).as_vec3(), (bounds.max.as_dvec3() - *shift).as_vec3());
            shifts.insert(m as u32, *shift);
        }
        for d in self.deformations.iter().filter(|d| d.skin.is_none()) {
            if let Some((shift, shape)) = shifts.get(&d.mesh).zip(self.shapes.get_mut(d.shape as usize)) {
                shape.shift(*shift);
            }
        }
        shifts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_near_keeps_its_origin() {
        let of = |center: f64, size: f64| {
            origin_of(DVec3::splat(center - 0.5 * size), DVec3::splat(center + 0.5 * size))
        };
        for (center, size) in [(0.0, 1.0), (30.0, 1.0), (900.0, 20.0), (2000.0, 3000.0), (f64::NAN, 1.0)] {
            assert_eq!(of(center, size), DVec3::ZERO, "{center} {size}");
        }
        assert_eq!(origin_of(DVec3::INFINITY, DVec3::NEG_INFINITY), DVec3::ZERO, "empty");
        for (center, size) in
            [(14_000.3, 20.0), (-1.4e6, 3.0), (1.4e6, 1.0e5), (5.0, 0.01), (7.0, 0.0), (1e10, 1e-300)]
        {
            let origin = of(center, size);
            assert!(
                (origin - center).abs().max_element() <= (0.5 * size).max(0.5),
                "{center} {size}: {origin}"
            );
        }
    }
}
