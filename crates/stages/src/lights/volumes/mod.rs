//! Light volumes: an icosphere around every light's range, one instance a light.
//!
//! The mesh contains its sphere, so that no lit pixel is missed; back faces are drawn and tested against the depth behind
//! them, so that the eye may be inside.

use afterlight_graph::{
    Blend, DepthTest, Draw, DrawCall, RasterPass, RasterState, VertexAttribute, VertexLayout, VertexStream,
    gpu::vk,
};
use glam::Vec3;

use afterlight_frame::{Frame, TechniqueError};

/// Depth test of a volume's back faces: they pass where they lie behind the surface.
pub const BEHIND_SURFACE: DepthTest = DepthTest { compare: vk::CompareOp::LESS_OR_EQUAL, write: false };

/// Vertices and triangles of an icosahedron subdivided once, scaled so that the unit sphere is inside: 42 vertices, 80
/// triangles, counter-clockwise seen from outside.
pub fn icosphere() -> (Vec<[f32; 3]>, Vec<u16>) {
    let phi = 0.5 * (1.0 + 5f32.sqrt());
    let mut corners: Vec<Vec3> = Vec::new();
    for (a, b) in [(-1.0, phi), (1.0, phi), (-1.0, -phi), (1.0, -phi)] {
        corners.push(Vec3::new(a, b, 0.0));
        corners.push(Vec3::new(0.0, a, b));
        corners.push(Vec3::new(b, 0.0, a));
    }
    for c in &mut corners {
        *c = c.normalize();
    }
    let edge = corners[0].distance(
        *corners[1..]
            .iter()
            .min_by(|a, b| corners[0].distance(**a).total_cmp(&corners[0].distance(**b)))
            .unwrap_or(&corners[0]),
    );
    let near = |a: Vec3, b: Vec3| a.distance(b) < edge * 1.1;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let (a, b, c) = (corners[i], corners[j], corners[k]);
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (b - a).cross(c - a).dot(a) > 0.0;
                    faces.push(if outward { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    let mut indices = Vec::new();
    let mut middles = std::collections::BTreeMap::new();
    for [a, b, c] in faces {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
            *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                corners.push(((corners[p] + corners[q]) * 0.5).normalize());
                corners.len() - 1
            })
        });
        for triangle in [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]] {
            indices.extend(triangle.map(|i| i as u16));
        }
    }
    // The faces' planes cut the unit sphere: push them out to the nearest one's distance.
    let inner = indices
        .chunks_exact(3)
        .map(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| corners[i as usize]);
            (b - a).cross(c - a).normalize().dot(a)
        })
        .fold(1.0, f32::min);
    // A margin for the rounding of vertex positions.
    let scale = 1.0001 / inner;
    (corners.iter().map(|c| (*c * scale).into()).collect(), indices)
}

/// Number of indices of [`icosphere`].
pub const ICOSPHERE_INDICES: u32 = 240;

fn layout() -> VertexLayout {
    VertexLayout {
        streams: vec![VertexStream { stride_bytes: 12, per_instance: false }],
        attributes: vec![VertexAttribute {
            location: 0,
            stream: 0,
            format: vk::Format::R32G32B32_SFLOAT,
            offset_bytes: 0,
        }],
    }
}

/// State of a volume draw with a fragment shader, faces culled as said, each colour attachment blended as said; depth is clamped, not clipped.
///
/// # Errors
/// A shader that is not compiled in.
pub fn volume_state(
    frame: &Frame<'_>,
    fragment: Option<&str>,
    cull: vk::CullModeFlags,
    blend: Vec<Blend>,
) -> Result<RasterState, TechniqueError> {
    state(frame, "lights/volumes/volume.vert", fragment, cull, blend).map(|s| s.layout(layout()))
}

/// As [`volume_state`], with a table of lights, the slot `LightOrder`, whose places are the instances.
///
/// # Errors
/// A shader that is not compiled in.
pub fn ordered_state(
    frame: &Frame<'_>,
    fragment: &str,
    cull: vk::CullModeFlags,
    blend: Vec<Blend>,
) -> Result<RasterState, TechniqueError> {
    state(frame, "lights/volumes/volume.vert#ordered", Some(fragment), cull, blend)
        .map(|s| s.layout(layout()))
}

fn state(
    frame: &Frame<'_>,
    vertex: &str,
    fragment: Option<&str>,
    cull: vk::CullModeFlags,
    blend: Vec<Blend>,
) -> Result<RasterState, TechniqueError> {
    let vertex = frame.shader(vertex)?;
    let fragment = fragment.map(|name| frame.shader(name)).transpose()?;
    let mut state = RasterState::new(&vertex, fragment.as_ref()).cull(cull).blend(blend);
    state.constants = frame.constants(&std::iter::once(&vertex).chain(&fragment).collect::<Vec<_>>());
    // An orthographic far plane must not cut back faces.
    state.depth_clamp = true;
    Ok(state)
}

/// A draw of `count` volumes from light, or place in the table, `first` on.
pub fn volume_draw<'a>(frame: &'a Frame<'_>, state: RasterState, first: u32, count: u32) -> Draw<'a> {
    let call = DrawCall::Indexed {
        indices: ICOSPHERE_INDICES,
        instances: count,
        first_index: 0,
        vertex_offset: 0,
        first_instance: first,
    };
    Draw::new(state, call)
        .vertex_buffer(&frame.buffers.volume)
        .index_buffer(&frame.buffers.volume_indices, vk::IndexType::UINT16)
}

/// Draws every light in two calls, added to `targets` colour attachments: those without an end over the whole image, then the
/// volumes, their back faces where they lie behind the surface of a pass with depth.
///
/// # Errors
/// A shader that is not compiled in.
pub fn draw_all(
    frame: &Frame<'_>,
    pass: &mut RasterPass<'_>,
    fragment: &str,
    targets: usize,
) -> Result<(), TechniqueError> {
    draw_unbounded(frame, pass, fragment, targets)?;
    draw_bounded(frame, pass, fragment, targets, (BEHIND_SURFACE, &[]))
}

/// The same into one attachment by a fragment shader with specialization constants, and with another depth test.
///
/// # Errors
/// A shader that is not compiled in.
pub fn draw_all_by(
    frame: &Frame<'_>,
    pass: &mut RasterPass<'_>,
    fragment: &str,
    (depth, constants): (DepthTest, &[(String, u32)]),
) -> Result<(), TechniqueError> {
    draw_unbounded_by(frame, pass, fragment, 1, constants)?;
    draw_bounded(frame, pass, fragment, 1, (depth, constants))
}

fn draw_bounded(
    frame: &Frame<'_>,
    pass: &mut RasterPass<'_>,
    fragment: &str,
    targets: usize,
    (depth, constants): (DepthTest, &[(String, u32)]),
) -> Result<(), TechniqueError> {
    let bounded = frame.lights.bounded_count();
    if bounded > 0 {
        let added = vec![Blend::ADD; targets];
        let mut state = volume_state(frame, Some(fragment), vk::CullModeFlags::FRONT, added)?;
        state.constants.extend_from_slice(constants);
        pass.draw(volume_draw(frame, state.depth(depth), frame.lights.unbounded_count, bounded));
    }
    Ok(())
}

/// Draws the lights without an end over the whole image, added to `targets` colour attachments.
///
/// # Errors
/// A shader that is not compiled in.
pub fn draw_unbounded(
    frame: &Frame<'_>,
    pass: &mut RasterPass<'_>,
    fragment: &str,
    targets: usize,
) -> Result<(), TechniqueError> {
    draw_unbounded_by(frame, pass, fragment, targets, &[])
}

fn draw_unbounded_by(
    frame: &Frame<'_>,
    pass: &mut RasterPass<'_>,
    fragment: &str,
    targets: usize,
    constants: &[(String, u32)],
) -> Result<(), TechniqueError> {
    if frame.lights.unbounded_count > 0 {
        let mut state = state(
            frame,
            "lights/volumes/volume.vert#full-screen",
            Some(fragment),
            vk::CullModeFlags::NONE,
            vec![Blend::ADD; targets],
        )?;
        state.constants.extend_from_slice(constants);
        let call = DrawCall::Direct {
            vertices: 3,
            instances: frame.lights.unbounded_count,
            first_vertex: 0,
            first_instance: 0,
        };
        pass.draw(Draw::new(state, call));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_icosphere_contains_the_unit_sphere() {
        let (vertices, indices) = icosphere();
        assert_eq!((vertices.len(), indices.len() as u32), (42, ICOSPHERE_INDICES));
        for t in indices.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| Vec3::from(vertices[i as usize]));
            let distance = (b - a).cross(c - a).normalize().dot(a);
            assert!(distance >= 1.0, "a face at {distance} of the centre");
        }
        let farthest = vertices.iter().map(|v| Vec3::from(*v).length()).fold(0.0, f32::max);
        assert!(
            farthest < 1.1,
            "corners at {farthest}: light volumes would cover much that they do not light"
        );
    }
}
