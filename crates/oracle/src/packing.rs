//! Packed unit vectors, decoded in f64.

use glam::{DVec2, DVec3};

/// A 16-bit signed normalised number (Vulkan 1.3, section 3.10).
fn snorm16(bits: u32) -> f64 {
    (f64::from(bits as u16 as i16) / 32767.0).max(-1.0)
}

/// The unit vector of octahedral coordinates in [−1, 1]² (Cigolle et al. 2014, listing 1).
pub fn octahedral_decode(e: DVec2) -> DVec3 {
    let z = 1.0 - e.x.abs() - e.y.abs();
    let sign = |x: f64| if x >= 0.0 { 1.0 } else { -1.0 };
    let (x, y) =
        if z < 0.0 { ((1.0 - e.y.abs()) * sign(e.x), (1.0 - e.x.abs()) * sign(e.y)) } else { (e.x, e.y) };
    DVec3::new(x, y, z).normalize()
}

/// Octahedral coordinates in [−1, 1]² of a unit vector.
pub fn octahedral_encode(n: DVec3) -> DVec2 {
    let p = n / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f64| if x >= 0.0 { 1.0 } else { -1.0 };
    if p.z < 0.0 {
        DVec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    } else {
        DVec2::new(p.x, p.y)
    }
}

/// The unit normal of packed bits (`VertexAttributes::normal_os_oct`).
pub fn unpack_normal(bits: u32) -> DVec3 {
    octahedral_decode(DVec2::new(snorm16(bits), snorm16(bits >> 16)))
}

/// The unit tangent of packed bits, zero where they say that there is none, and the bitangent's sign (`VertexAttributes::tangent_os_oct`).
pub fn unpack_tangent(bits: u32) -> (DVec3, f64) {
    let sign = if bits & 0x1_0000 != 0 { -1.0 } else { 1.0 };
    if bits as u16 as i16 == i16::MIN {
        return (DVec3::ZERO, sign);
    }
    (unpack_normal(bits & !0x1_0000), sign)
}
