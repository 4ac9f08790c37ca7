//! Views of techniques whose samples refer to records of a triangle buffer.

use afterlight_graph::{BufferRole, ComputePass, Graph, ImageHandle, Load, PassRole, gpu::vk};

use crate::surfaces::shade::SurfaceSource;
use crate::surfaces::{geometry::SceneDraws, triangles::Records};
use afterlight_frame::views::TEXTURE_ERROR;
use afterlight_frame::{Frame, SourceSlots, TechniqueError};
use afterlight_scene::Aabb;

/// Name, after the technique's, of the buffer of errors that [`RecordSource::record`] keeps: two 32-bit floats a
/// pixel, rows from the top. Distance of the positions in a scene whose longest side is 2; largest difference of a channel of
/// linear base colour. −1 where nothing is compared.
pub const ATTRIBUTE_ERRORS: &str = "attribute errors";

/// Name, after the technique's, of the buffer of counts that [`afterlight_frame::views::TRIANGLE_SHARING`] keeps: a 32-bit word a record, the
/// image's visibility samples that refer to it; zero beyond the last record.
pub const RECORD_SAMPLES: &str = "record samples";

/// What the reference holds where it shows no surface: `NO_TRIANGLE`, all ones.
const NO_TRIANGLE_UINT: [u32; 4] = [u32::MAX; 4];

/// What holds the records that the samples of a pixel refer to.
pub struct RecordSource<'a> {
    /// The technique.
    pub technique: &'static str,
    /// Where its variants of the views' templates are listed.
    pub source: SurfaceSource<'a>,
    /// The records.
    pub records: &'a Records,
    /// Binds what it reads, the records as well.
    pub bind: &'a dyn Fn(&mut dyn SourceSlots),
}

impl RecordSource<'_> {
    /// Declares the frame's view, one of those that [`afterlight_frame::views::is_of_triangles`] names. Returns its image.
    ///
    /// # Errors
    /// A view of errors in a tessellated frame, whose triangles have no ID; a shader that is not compiled in.
    pub fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        match afterlight_frame::views::compares_triangles(frame.view) {
            true => self.attribute_error(graph, frame),
            false => self.sharing(graph, frame),
        }
    }

    /// Declares [`afterlight_frame::views::TRIANGLE_SHARING`]: a count of samples a record, then colours.
    ///
    /// # Errors
    /// A shader that is not compiled in.
    fn sharing(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let bytes = 4 * u64::from(self.records.capacity.max(1));
        let counts = graph.buffer(&self.name(RECORD_SAMPLES), BufferRole::Counters, bytes);
        let counts = graph.clear_buffer(&self.name("clear record samples"), PassRole::Upkeep, counts, 0);
        let mut pass = self.pass(graph, frame, "sharing count", "sharing_count")?;
        let counts = pass.write("RecordSamples", counts);
        pass.dispatch(frame.groups(8));
        pass.finish();

        graph.keep(&counts);

        let target = self.target(graph, frame);
        let mut pass = self.pass(graph, frame, "sharing", "sharing")?;
        pass.read("RecordSamples", &counts);
        let target = pass.write("hdr", target);
        pass.dispatch(frame.groups(8));
        pass.finish();
        Ok(target)
    }

    /// Declares [`super::ATTRIBUTE_ERROR`] and [`TEXTURE_ERROR`]: a raster pass over the scene, then colours and the buffer
    /// [`ATTRIBUTE_ERRORS`], which is kept.
    ///
    /// # Errors
    /// A tessellated frame, whose triangles have no ID; a shader that is not compiled in.
    fn attribute_error(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let Some(ids) = &self.records.ids else {
            return Err(TechniqueError::Conflict {
                technique: self.technique,
                found: format!("view {} of tessellated surfaces", frame.view),
                expected: "surfaces as they are: triangles that tessellation makes have no ID to compare by"
                    .to_owned(),
            });
        };
        let [position, color] = self.reference(graph, frame)?;
        let pixels = u64::from(frame.width_px) * u64::from(frame.height_px);
        let errors = graph.buffer(&self.name(ATTRIBUTE_ERRORS), BufferRole::Counters, 8 * pixels);
        let target = self.target(graph, frame);
        let mut pass = self.pass(graph, frame, "attribute error", "attribute_error")?;
        pass.constant("TEXTURE_ERROR", u32::from(frame.shows(TEXTURE_ERROR)));
        pass.read("RecordIds", ids);
        pass.read("reference_position", &position).read("reference_color", &color);
        pass.push(&unit_from_m(frame));
        let errors = pass.write("AttributeErrors", errors);
        let target = pass.write("hdr", target);
        pass.dispatch(frame.groups(8));
        pass.finish();
        graph.keep(&errors);
        Ok(target)
    }

    /// World position with triangle ID, and base colour, of what shows at pixel centres.
    fn reference(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<[ImageHandle; 2], TechniqueError> {
        let image = |graph: &mut Graph, name: &str, format| {
            graph.image(&self.name(name), BufferRole::Counters, frame.image_info(format))
        };
        let position = image(graph, "reference position", vk::Format::R32G32B32A32_UINT);
        let color = image(graph, "reference color", vk::Format::R32G32B32A32_SFLOAT);
        let depth = image(graph, "reference depth", vk::Format::D32_SFLOAT);
        let surfaces = SceneDraws::shaded(frame, "views/reference.frag", "views/reference.frag#mask")?;
        let mut pass = graph.raster(&self.name("reference"), PassRole::Upkeep);
        frame.bind_scene(&mut pass);
        let position = pass.color_uint(position, Load::Clear(NO_TRIANGLE_UINT));
        let color = pass.color(color, Load::DontCare);
        let _depth = pass.depth(depth, Load::Clear(0.0));
        surfaces.draw(frame, &mut pass);
        pass.finish();
        Ok([position, color])
    }

    fn name(&self, part: &str) -> String {
        format!("{}/{part}", self.technique)
    }

    fn target(&self, graph: &mut Graph, frame: &Frame<'_>) -> ImageHandle {
        graph.image(
            &self.name(frame.view),
            BufferRole::Targets,
            frame.image_info(vk::Format::R16G16B16A16_SFLOAT),
        )
    }

    /// A pass that goes through the records of every pixel.
    fn pass<'g>(
        &self,
        graph: &'g mut Graph,
        frame: &Frame<'_>,
        stage: &str,
        shader: &str,
    ) -> Result<ComputePass<'g>, TechniqueError> {
        let shader = frame.shader(&self.source.shader(&format!("{shader}.comp")))?;
        let mut pass = frame.compute(graph, &self.name(stage), PassRole::Upkeep, &shader);
        pass.constant("SAMPLES", self.source.samples);
        (self.bind)(&mut pass);
        Ok(pass)
    }
}

/// Factor from metres to a scene that fits into [−1, 1]³.
fn unit_from_m(frame: &Frame<'_>) -> f32 {
    let draws = frame.scene.rest.infos.iter();
    let bounds = draws.fold(Aabb::EMPTY, |bounds, draw| bounds.union(&draw.bounds_ws));
    let longest_m = bounds.size().max_element();
    if longest_m > 0.0 { 2.0 / longest_m } else { 1.0 }
}
