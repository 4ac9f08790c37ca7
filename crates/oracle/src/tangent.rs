//! The tangent of a vertex in world space, that of degenerate transforms included.

use glam::DVec3;

/// Sine of the angle between normal and tangent below which they span no frame.
const PARALLEL_SINE: f64 = 1e-3;

/// The unit tangent beside a unit normal: `tangent_ws` made unit or, where it has no length or lies along the normal, the X axis
/// projected into the surface, the Z axis where the normal's x is 0.9 or more.
pub fn tangent_of(normal_ws: DVec3, tangent_ws: DVec3) -> DVec3 {
    let tangent_ws = tangent_ws.normalize_or_zero();
    if normal_ws.cross(tangent_ws).length() > PARALLEL_SINE * normal_ws.length() {
        return tangent_ws;
    }
    let axis = if normal_ws.x.abs() < 0.9 { DVec3::X } else { DVec3::Z };
    axis.reject_from_normalized(normal_ws).normalize_or_zero()
}
