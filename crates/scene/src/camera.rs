//! Choice of a camera, and a camera made to fit.

use std::cmp::Ordering;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

pub use crate::path::{CameraPath, Keyframe};
use crate::{Aabb, Camera, Instance, Projection, Scene, SceneError};

/// Near plane of a camera given by numbers, and the farthest of one made to fit, metres.
pub(crate) const NEAR_MAX_M: f32 = 0.1;
/// Extent of a scene over the near plane of a camera made to fit. Depth is reversed and in floating
/// point, so the ratio costs no precision; a greater near plane would cut what stands before the eye.
const EXTENT_PER_NEAR: f32 = 10_000.0;
/// Vertical angle of view of a camera inside a scene, degrees.
pub(crate) const INTERIOR_FOV_DEG: f32 = 60.0;
/// Vertical angle of view of a camera before a scene, degrees.
pub(crate) const EXTERIOR_FOV_DEG: f32 = 45.0;
/// Height of a standing person's eye, metres.
const EYE_HEIGHT_M: f32 = 1.7;
/// Most triangles looked at to tell an interior from an object.
const INTERIOR_TRIANGLES_MAX: u64 = 200_000;

/// The camera that `--camera` asks for: a name, an index into [`Scene::cameras`], or
/// `x,y,z,tx,ty,tz,fov_deg[,near_m]` (eye and target in the file's coordinates, vertical angle of view in degrees, near plane, 0.1 m where it is left out), or
/// `x,y,z,tx,ty,tz,orthographic,half_height_m,near_m,far_m` for a view without perspective.
/// Without a request the scene's first camera, or [`default_camera`] where it has none.
///
/// # Errors
/// [`SceneError::BadParameter`] lists the cameras that exist.
pub fn select(scene: &Scene, spec: Option<&str>) -> Result<Camera, SceneError> {
    let Some(spec) = spec else {
        return Ok(scene.cameras.first().cloned().unwrap_or_else(|| default_camera(scene)));
    };
    if let Some(camera) = scene.cameras.iter().find(|c| &*c.name == spec) {
        return Ok(camera.clone());
    }
    if let Some(camera) = spec.parse().ok().and_then(|index: usize| scene.cameras.get(index)) {
        return Ok(camera.clone());
    }
    from_numbers(scene, spec).ok_or_else(|| SceneError::BadParameter {
        name: "--camera".to_owned(),
        found: format!("'{}'", crate::error::one_line(spec)),
        expected: format!(
            "{}, or x,y,z,tx,ty,tz,fov_deg[,near_m] with fov_deg between 0 and 180 and a target off the eye, or \
             x,y,z,tx,ty,tz,orthographic,half_height_m,near_m,far_m",
            known_cameras(scene)
        ),
    })
}

/// Names and indices that [`select`] takes.
fn known_cameras(scene: &Scene) -> String {
    /// Cameras listed by name in a message.
    const LISTED_MAX: usize = 16;
    if scene.cameras.is_empty() {
        return "a camera (this scene has none)".to_owned();
    }
    let mut names: Vec<_> = scene
        .cameras
        .iter()
        .take(LISTED_MAX)
        .enumerate()
        .map(|(i, c)| format!("{i} '{}'", crate::error::one_line(&c.name)))
        .collect();
    if scene.cameras.len() > LISTED_MAX {
        names.push(format!("up to {}", scene.cameras.len() - 1));
    }
    format!("one of {}", names.join(", "))
}

/// The word that stands in the place of the angle of view of a camera without perspective.
const ORTHOGRAPHIC: &str = "orthographic";

/// A camera of numbers with commas between: eye, target, and a lens. The lens is a vertical angle of view in degrees, followed by the near
/// plane where that is not 0.1 m; or the word `orthographic`, half the height of the view, the near and the far plane.
fn from_numbers(scene: &Scene, spec: &str) -> Option<Camera> {
    let parts: Vec<&str> = spec.split(',').map(str::trim).collect();
    let (place, lens) = parts.split_at_checked(6)?;
    let number = |part: &&str| part.parse::<f32>().ok().filter(|number| number.is_finite());
    let place: Vec<f64> = place.iter().map(|part| part.parse().ok()).collect::<Option<_>>()?;
    let &[x, y, z, tx, ty, tz] = place.as_slice() else { return None };
    let [eye_ws, target_ws] =
        [DVec3::new(x, y, z), DVec3::new(tx, ty, tz)].map(|point| scene.world_from_file(point));
    (target_ws - eye_ws).try_normalize().filter(|_| eye_ws.is_finite())?;
    let projection = match lens {
        [ORTHOGRAPHIC, sizes @ ..] => {
            let sizes: Vec<f32> = sizes.iter().map(number).collect::<Option<_>>()?;
            let &[half_height_m, near_m, far_m] = sizes.as_slice() else { return None };
            let sound = half_height_m > 0.0 && near_m >= 0.0 && far_m > near_m;
            sound.then_some(Projection::Orthographic { half_height_m, near_m, far_m })?
        }
        [fov_deg, near_m @ ..] if near_m.len() <= 1 => {
            let fov_deg = number(fov_deg).filter(|fov_deg| *fov_deg > 0.0 && *fov_deg < 180.0)?;
            let near_m = near_m.first().map_or(Some(NEAR_MAX_M), number).filter(|near_m| *near_m > 0.0)?;
            Projection::Perspective { fov_y_rad: fov_deg.to_radians(), near_m }
        }
        _ => return None,
    };
    Some(Camera { projection, ..Camera::look_at("command line", eye_ws, target_ws, 1.0, NEAR_MAX_M) })
}

/// Near plane of a camera that is made to fit a scene of this extent, metres.
pub fn near_of_extent_m(extent_m: f32) -> f32 {
    (extent_m / EXTENT_PER_NEAR).min(NEAR_MAX_M)
}

/// A camera made to fit the scene.
///
/// What is nearest to the centre of the bounds in each direction tells what the scene is: where most of it shows its
/// front (double-sided triangles count half), it is an interior. Then the eye stands inside near one end
/// of the longest horizontal axis, before what blocks the view from the centre, a fifth of the height up
/// (1.7 m where the scene is higher than that and a fifth is less), and looks along the axis. Else
/// the bounding sphere is framed from the front (+Z in glTF), slightly from above.
pub fn default_camera(scene: &Scene) -> Camera {
    let bounds_ws = scene.bounds_ws();
    let extent_m = bounds_ws.size().max_element();
    if !(extent_m.is_finite() && extent_m > 0.0 && bounds_ws.center().is_finite()) {
        return Camera::look_at(
            "default",
            Vec3::new(0.0, 0.0, 3.0),
            Vec3::ZERO,
            EXTERIOR_FOV_DEG.to_radians(),
            NEAR_MAX_M,
        );
    }
    let near_m = near_of_extent_m(extent_m);
    if is_interior(scene, bounds_ws.center()) {
        interior_camera(scene, &bounds_ws, near_m)
    } else {
        exterior_camera(&bounds_ws, near_m)
    }
}

/// Frames the bounding sphere from the front, slightly from above.
fn exterior_camera(bounds_ws: &Aabb, near_m: f32) -> Camera {
    let fov_y_rad = EXTERIOR_FOV_DEG.to_radians();
    let radius_m = 0.5 * bounds_ws.size().length();
    let distance_m = 1.02 * radius_m / (0.5 * fov_y_rad).sin();
    let eye_ws = bounds_ws.center() + distance_m * Vec3::new(0.0, 0.26, 1.0).normalize();
    Camera::look_at("default", eye_ws, bounds_ws.center(), fov_y_rad, near_m)
}

/// Stands near one end of the longest horizontal axis and looks along it.
fn interior_camera(scene: &Scene, bounds_ws: &Aabb, near_m: f32) -> Camera {
    let size_m = bounds_ws.size();
    let axis_ws = if size_m.x >= size_m.z { Vec3::X } else { Vec3::Z };
    let half_m = 0.5 * size_m.dot(axis_ws);
    let mut height_m = 0.2 * size_m.y;
    if size_m.y > EYE_HEIGHT_M {
        height_m = height_m.max(EYE_HEIGHT_M).min(0.9 * size_m.y);
    }
    let mut center_ws = bounds_ws.center();
    center_ws.y = bounds_ws.min.y + height_m;
    // 0.9: an eye closer to the wall would see it cut by the near plane when the view turns
    let free_m = [axis_ws, -axis_ws].map(|d| 0.9 * first_hit_m(scene, center_ws, d).min(half_m));
    let (back_ws, back_m) = if free_m[0] > free_m[1] { (axis_ws, free_m[0]) } else { (-axis_ws, free_m[1]) };
    let eye_ws = center_ws + back_m * back_ws;
    Camera::look_at("default", eye_ws, eye_ws - back_ws, INTERIOR_FOV_DEG.to_radians(), near_m)
}

/// Whether the nearest surfaces around a point show it their fronts.
///
/// Each triangle stands for the direction of its centroid; of the triangles in one direction the nearest counts, so that the
/// outer walls of a building do not. Triangles seen edge-on tell nothing, double-sided ones count half.
fn is_interior(scene: &Scene, point_ws: Vec3) -> bool {
    let total = scene.triangle_count();
    // odd, so that rays do not all hit the same half of quads that are split into two triangles
    let stride = (total.div_ceil(INTERIOR_TRIANGLES_MAX) | 1) as usize;
    let mut nearest = [(f32::INFINITY, 0.0f32); DIRECTION_BINS];
    let mut skip = 0;
    for instance in &scene.instances {
        let material = scene.materials.get(scene.meshes[instance.mesh as usize].material as usize);
        let double_sided = material.is_some_and(|m| m.double_sided);
        let triangle_count = scene.meshes[instance.mesh as usize].index_count as usize / 3;
        while skip < triangle_count {
            let [a, b, c] = world_triangle(scene, instance, skip);
            skip += stride;
            let to_centroid = (a + b + c) / 3.0 - point_ws;
            let distance_m = to_centroid.length();
            let normal = (b - a).cross(c - a);
            let facing = -normal.dot(to_centroid);
            // an angle of less than six degrees between triangle and direction
            if !distance_m.is_finite() || facing.abs() <= 0.1 * normal.length() * distance_m {
                continue;
            }
            let bin = &mut nearest[direction_bin(to_centroid)];
            if distance_m < bin.0 {
                *bin = (distance_m, if double_sided { 0.5 } else { f32::from(u8::from(facing > 0.0)) });
            }
        }
        skip -= triangle_count;
    }
    let seen = nearest.iter().filter(|(distance_m, _)| distance_m.is_finite());
    let (front, count) = seen.fold((0.0, 0), |(front, count), bin| (front + bin.1, count + 1));
    count > 0 && front > 0.6 * count as f32
}

/// Directions told apart: 4×4 on each side of a cube.
const DIRECTION_BINS: usize = 6 * 4 * 4;

/// The bin of a direction of any length.
fn direction_bin(direction: Vec3) -> usize {
    let axis = direction.abs().max_position();
    let (u, v) = (direction[(axis + 1) % 3], direction[(axis + 2) % 3]);
    let largest = direction[axis].abs();
    let cell = |x: f32| ((x / largest * 0.5 + 0.5) * 4.0).clamp(0.0, 3.0) as usize;
    (axis * 2 + usize::from(direction[axis] < 0.0)) * 16 + cell(u) * 4 + cell(v)
}

/// Corners of a triangle of an instance, counter-clockwise from its front whatever the instance mirrors.
pub(crate) fn world_triangle(scene: &Scene, instance: &Instance, triangle: usize) -> [Vec3; 3] {
    let mesh = &scene.meshes[instance.mesh as usize];
    let first = mesh.first_index as usize + 3 * triangle;
    let corner = |k: usize| {
        let vertex = mesh.first_vertex as usize + scene.indices[first + k] as usize;
        instance.world_from_object.transform_point3(Vec3::from_array(scene.positions_os[vertex]))
    };
    let mirrored = instance.world_from_object.matrix3.determinant() < 0.0;
    if mirrored { [corner(0), corner(2), corner(1)] } else { [corner(0), corner(1), corner(2)] }
}

/// Distance to the first triangle along a unit direction, metres; infinite where there is none.
fn first_hit_m(scene: &Scene, origin_ws: Vec3, direction_ws: Vec3) -> f32 {
    let hit = |instance: &Instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        let object_from_world = instance.world_from_object.inverse();
        let origin_os = object_from_world.transform_point3(origin_ws);
        let direction_os = object_from_world.transform_vector3(direction_ws);
        if !origin_os.is_finite() || !hits_box(&mesh.bounds_os, origin_os, direction_os) {
            return f32::INFINITY;
        }
        let first = mesh.first_index as usize;
        scene.indices[first..first + mesh.index_count as usize]
            .par_chunks_exact(3)
            .with_min_len(1 << 14)
            .map(|triangle| {
                let [a, b, c] = [0, 1, 2].map(|k| {
                    Vec3::from_array(scene.positions_os[(mesh.first_vertex + triangle[k]) as usize])
                });
                hit_triangle([a, b, c], origin_os, direction_os)
            })
            .reduce(|| f32::INFINITY, f32::min)
    };
    scene.instances.iter().map(hit).fold(f32::INFINITY, f32::min)
}

/// Whether a ray meets a box.
fn hits_box(bounds: &Aabb, origin: Vec3, direction: Vec3) -> bool {
    let inverse = direction.recip();
    let (t0, t1) = ((bounds.min - origin) * inverse, (bounds.max - origin) * inverse);
    let enter = t0.min(t1).max_element().max(0.0);
    // a direction with a zero gives NaN for an origin in a face's plane: such a box may be met
    enter.partial_cmp(&t0.max(t1).min_element()) != Some(Ordering::Greater)
}

/// Parameter of the hit of a ray with a triangle, from either side (Möller, Trumbore 1997).
fn hit_triangle([a, b, c]: [Vec3; 3], origin: Vec3, direction: Vec3) -> f32 {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let inverse = 1.0 / ab.dot(p);
    let u = (origin - a).dot(p) * inverse;
    let q = (origin - a).cross(ab);
    let v = direction.dot(q) * inverse;
    let t = ac.dot(q) * inverse;
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 { t } else { f32::INFINITY }
}

impl Camera {
    /// Distance of the near plane, metres.
    pub fn clip_near_m(&self) -> f32 {
        match self.projection {
            Projection::Perspective { near_m, .. } | Projection::Orthographic { near_m, .. } => near_m,
        }
    }
}
