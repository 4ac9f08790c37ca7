//! The two passes over the scene of techniques whose fragments store their triangles (Schied and Dachsbacher 2015, Figure 3).

use afterlight_graph::{BufferHandle, BufferRole, DepthTest, Graph, PassRole, RasterPass};

use afterlight_frame::{DrawCommands, Frame, TechniqueError};
use afterlight_stages::surfaces::{claims::NOT_TAKEN, depth_first::FIRST_FRAGMENT, geometry::SceneDraws};

/// What the first pass draws: depth alone. In tessellated frames both passes have a geometry shader, so that their depths are
/// equal.
///
/// # Errors
/// A shader that is not compiled in.
pub(crate) fn depth_surfaces(frame: &Frame<'_>) -> Result<SceneDraws, TechniqueError> {
    let depth = SceneDraws::depth_only(frame)?;
    if frame.tessellate_px.is_some() { depth.through_geometry(frame) } else { Ok(depth) }
}

/// What the second pass draws, with an equal test: fragments that store their triangles. Of fragments of one depth a bit of stencil,
/// which the depth pass has cleared, lets the first pass; masked surfaces keep off what opaque ones have. In tessellated frames its
/// geometry shader numbers triangles and hands them on whole.
pub(crate) struct FillPass {
    /// Fragments that store their triangles.
    pub surfaces: SceneDraws,
    numbers: Option<BufferHandle>,
}

impl FillPass {
    /// `fragment` names the fragment shader, `tags` its variant besides `mask` and `whole`.
    ///
    /// # Errors
    /// In a tessellated frame, a device that counts in no geometry shader.
    pub fn new(
        graph: &mut Graph,
        frame: &Frame<'_>,
        technique: &'static str,
        fragment: &str,
        tags: &[&str],
    ) -> Result<Self, TechniqueError> {
        let whole = frame.tessellate_px.is_some();
        let tags = [if whole { &["whole"][..] } else { &[] }, tags].concat();
        let opaque = variant(fragment, &tags);
        let masked = variant(fragment, &[&["mask"], &tags[..]].concat());
        if !whole {
            let fill = SceneDraws::new(
                frame,
                ("surfaces/geometry/surface.vert#position", Some(&opaque)),
                ("surfaces/geometry/surface.vert#uv", &masked),
            )?;
            return Ok(Self { surfaces: equal_and_first(fill), numbers: None });
        }
        let fill = SceneDraws::shaded(frame, &opaque, &masked)?.whole_triangles(frame, technique)?;
        let numbers = graph.buffer(&format!("{technique}/triangle numbers"), BufferRole::Counters, 4);
        let numbers = graph.clear_buffer(
            &format!("{technique}/clear triangle numbers"),
            PassRole::Geometry,
            numbers,
            0,
        );
        Ok(Self { surfaces: equal_and_first(fill), numbers: Some(numbers) })
    }

    /// Binds what the pass counts triangles with and adds its draws.
    pub fn draw(self, frame: &Frame<'_>, pass: &mut RasterPass<'_>) {
        self.counted(pass).draw(frame, pass);
    }

    /// The same with the draws that commands of the frame's own list.
    pub fn draw_listed(self, frame: &Frame<'_>, pass: &mut RasterPass<'_>, draws: &DrawCommands) {
        self.counted(pass).draw_listed(frame, pass, draws);
    }

    /// Its surfaces, once what they count triangles with is bound.
    fn counted(self, pass: &mut RasterPass<'_>) -> SceneDraws {
        if let Some(numbers) = self.numbers {
            let _numbers = pass.write("TriangleNumbers", numbers);
        }
        self.surfaces
    }
}

/// With an equal test, by which the first fragment of a sample passes and no other.
fn equal_and_first(surfaces: SceneDraws) -> SceneDraws {
    let mut surfaces = surfaces.depth(DepthTest::EQUAL).stencil(FIRST_FRAGMENT, 1);
    surfaces.masked_stencil = Some(NOT_TAKEN);
    surfaces
}

/// Name of a shader's variant.
fn variant(name: &str, tags: &[&str]) -> String {
    if tags.is_empty() { name.to_owned() } else { format!("{name}#{}", tags.join("-")) }
}
