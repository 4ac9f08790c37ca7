//! The stage that stores the triangles which show, by screen-space derivatives of their attributes (Schied and Dachsbacher
//! 2015, sections 3.1, 3.2 and 4.2).
//!
//! The paper fills the triangle buffer from a raster pass through a memoization cache with locks, and wishes for a way without
//! a depth pre-pass. Here it is filled from a finished visibility buffer: a bit a triangle marks what shows, counts and a scan
//! turn bits into places, and a thread a marked triangle writes its record. No lock, no cache, each triangle once, in the order
//! of draws.

use afterlight_graph::{BufferHandle, BufferRole, ComputePass, Graph, PassRole, RasterPass};

use crate::surfaces::visible::Visible;
use afterlight_frame::{
    Frame, SourceSlots, TechniqueError,
    capacity::{self, FIRST_GUESS},
    params::{choices, parameters},
    scene::DRAW_TRIANGLES,
    set_constants, views,
};

/// Words of 32 bits for a draw's triangles.
const WORDS_A_DRAW: u64 = DRAW_TRIANGLES as u64 / 32;
/// Draws whose bits a group counts: `BLOCK_WORDS` in `blocks.glsl`, in draws.
const BLOCK_DRAWS: u32 = 32;

choices! {
    /// Where shading of normal maps has tangents from.
    pub enum Tangents {
        /// Interpolated from the vertices, as wherever else surfaces are shaded.
        Vertices = "vertices",
        /// Found from screen-space derivatives of position and texture coordinates (Schied and Dachsbacher 2015, section 4.3).
        Derivatives = "derivatives",
    }
}

parameters! {
    /// What is stored of a triangle.
    #[derive(Copy)]
    pub struct RecordParams {
        /// where normal maps have tangents from: of the vertices, kept in the record where the scene has normal maps; or by derivatives of position and texture coordinates (the paper's), which turns normal maps where coordinates bend, have no area or do not match the file's tangents
        tangents: Tangents = Tangents::Vertices, "tangents";
    }
}

impl RecordParams {
    /// Floats of a record in a scene with normal maps, without second texture coordinates and vertex colours.
    pub fn floats(&self) -> f64 {
        match self.tangents {
            Tangents::Vertices => 23.0,
            Tangents::Derivatives => 20.0,
        }
    }
}

/// What the records of a frame hold.
#[derive(Clone, Copy)]
pub struct RecordLayout {
    /// `TANGENTS` of `record.glsl`.
    tangents: u32,
    /// Bytes of a record.
    pub bytes: u64,
}

impl RecordLayout {
    /// The layout for a frame: 80 bytes, more where the scene has normal maps and tangents are kept, second texture coordinates, or
    /// vertex colours.
    pub fn of(frame: &Frame<'_>, params: RecordParams) -> Self {
        let has =
            |name: &str| frame.scene.constants.iter().any(|(known, value)| *known == name && *value != 0);
        let keeps = params.tangents == Tangents::Vertices && has("NORMAL_BUCKETS");
        let (tangents, tangent_bytes) = match (keeps, frame.tessellate_px.is_some()) {
            (false, _) => (0, 0),
            (true, false) => (1, 12),
            (true, true) => (2, 28),
        };
        let more = 24 * u64::from(has("HAS_UV1")) + 48 * u64::from(has("HAS_VERTEX_COLOR"));
        Self { tangents, bytes: 80 + tangent_bytes + more }
    }

    /// Specialization constants of `record.glsl`.
    pub fn constants(&self) -> [(&'static str, u32); 1] {
        [("TANGENTS", self.tangents)]
    }
}

/// Records of triangles.
pub struct Records {
    /// The records.
    pub words: BufferHandle,
    /// What they hold.
    pub layout: RecordLayout,
    /// Triangle ID of each record, for the views that ask for it.
    pub ids: Option<BufferHandle>,
    /// Records that there is room for.
    pub capacity: u32,
}

impl Records {
    /// Binds what `surfaces/triangles/interpolate.glsl` reads.
    pub fn bind(&self, pass: &mut (impl SourceSlots + ?Sized)) {
        pass.read_buffer("TriangleBuffer", &self.words);
        set_constants(pass, self.layout.constants());
    }
}

/// A filled triangle buffer with the index from triangles to their places.
pub struct TriangleBuffer {
    /// The triangles.
    pub records: Records,
    bits: BufferHandle,
    before: BufferHandle,
    base: BufferHandle,
}

impl TriangleBuffer {
    /// Binds what `surfaces/triangles/index.glsl` and `surfaces/triangles/interpolate.glsl` read.
    pub fn bind(&self, pass: &mut (impl SourceSlots + ?Sized)) {
        self.records.bind(pass);
        pass.read_buffer("VisibleBits", &self.bits);
        pass.read_buffer("VisibleBefore", &self.before);
        pass.read_buffer("BlockBase", &self.base);
    }
}

/// A triangle buffer that fragments append to: a triangle ID in the first word of each record or, in tessellated frames, the
/// triangle's vertices.
pub struct List {
    records: BufferHandle,
    count: BufferHandle,
    layout: RecordLayout,
    /// Triangles that there is room for.
    pub capacity: u32,
}

impl List {
    /// Declares an empty list of at most `most` triangles.
    ///
    /// # Errors
    /// More triangles than `most` or than one binding holds.
    pub fn new(
        graph: &mut Graph,
        frame: &Frame<'_>,
        technique: &str,
        params: RecordParams,
        most: u32,
    ) -> Result<Self, TechniqueError> {
        let layout = RecordLayout::of(frame, params);
        let (capacity, bytes) = room(frame, technique, layout)?;
        if capacity > most {
            let what = format!("{technique}: triangles that a visibility sample's reference tells apart");
            return Err(TechniqueError::TooLarge { what, found: capacity.into(), limit: most.into() });
        }
        let records = graph.buffer(&format!("{technique}/triangle buffer"), BufferRole::Triangles, bytes);
        let count = graph.buffer(&format!("{technique}/triangle count"), BufferRole::TriangleSets, 8);
        let count =
            graph.clear_buffer(&format!("{technique}/clear count"), PassRole::TriangleSelection, count, 0);
        Ok(Self { records, count, layout, capacity })
    }

    /// Specialization constants of the fragments that append to it.
    pub fn constants(&self) -> Vec<(String, u32)> {
        let of_layout = self.layout.constants();
        of_layout.iter().copied().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// Binds it to the pass that appends.
    pub fn written_by(self, pass: &mut RasterPass<'_>) -> Self {
        let records = pass.write("TriangleBuffer", self.records);
        let count = pass.write("TriangleCount", self.count);
        Self { records, count, ..self }
    }

    /// Declares the pass that overwrites what fragments stored of each triangle by its record, sized on the device, and
    /// returns the records.
    ///
    /// # Errors
    /// A shader that is not compiled in.
    pub fn derivatives(
        self,
        graph: &mut Graph,
        frame: &Frame<'_>,
        technique: &str,
    ) -> Result<Records, TechniqueError> {
        let groups = graph.buffer(&format!("{technique}/dispatch groups"), BufferRole::TriangleSets, 12);
        let shader = frame.shader("surfaces/triangles/size.comp")?;
        let mut pass =
            frame.compute(graph, &format!("{technique}/size"), PassRole::TriangleSelection, &shader);
        pass.push(&self.capacity);
        pass.read("TriangleCount", &self.count);
        let groups = pass.write("DispatchGroups", groups);
        pass.dispatch([1, 1, 1]);
        pass.finish();

        let ids = RecordIds::wanted(graph, frame, technique, self.capacity);
        let stored = if frame.tessellate_px.is_some() { "vertices" } else { "list" };
        let shader =
            frame.shader(&format!("surfaces/triangles/derivatives.comp#{stored}{}", ids.tag('-')))?;
        let mut pass =
            frame.compute(graph, &format!("{technique}/derivatives"), PassRole::Derivatives, &shader);
        set_constants(&mut pass, self.layout.constants());
        pass.read("TriangleCount", &self.count);
        let words = pass.write("TriangleBuffer", self.records);
        let ids = ids.written_by(&mut pass);
        pass.dispatch_indirect(&groups, 0);
        pass.finish();
        // The triangles of tessellation are mostly small: hardly any is stored twice.
        let slack = if frame.tessellate_px.is_some() { capacity::STEADY } else { capacity::UNSTEADY };
        frame.watch_varying(graph, "triangles", &self.count, self.capacity, slack);
        Ok(Records { words, layout: self.layout, ids, capacity: self.capacity })
    }
}

/// Triangle IDs of records, written beside them where the frame's view compares records to what the rasteriser shows.
struct RecordIds(Option<BufferHandle>);

impl RecordIds {
    fn wanted(graph: &mut Graph, frame: &Frame<'_>, technique: &str, capacity: u32) -> Self {
        let wanted = views::compares_triangles(frame.view) && frame.tessellate_px.is_none();
        let bytes = 4 * u64::from(capacity.max(1));
        Self(
            wanted.then(|| graph.buffer(&format!("{technique}/record ids"), BufferRole::TriangleSets, bytes)),
        )
    }

    /// Tag of the derivative pass's variant, with a separator before it; empty without IDs.
    fn tag(&self, separator: char) -> String {
        self.0.as_ref().map_or_else(String::new, |_| format!("{separator}ids"))
    }

    fn written_by(self, pass: &mut ComputePass<'_>) -> Option<BufferHandle> {
        self.0.map(|ids| pass.write("RecordIds", ids))
    }
}

/// Triangles that there should be room for: what earlier frames of the view needed, and more.
pub fn capacity(frame: &Frame<'_>) -> u32 {
    frame.capacity("triangles", FIRST_GUESS)
}

/// Triangles that there should be room for, and their bytes.
fn room(frame: &Frame<'_>, technique: &str, layout: RecordLayout) -> Result<(u32, u64), TechniqueError> {
    let capacity = capacity(frame);
    let bytes = layout.bytes * u64::from(capacity);
    frame.check_binding(technique, &format!("the triangle buffer for {capacity} triangles"), bytes)?;
    Ok((capacity, bytes.max(4)))
}

/// Declares the passes that store every triangle which shows in `visible`.
///
/// # Errors
/// More triangles than one binding holds.
pub fn fill(
    graph: &mut Graph,
    frame: &Frame<'_>,
    technique: &str,
    params: RecordParams,
    visible: &Visible,
) -> Result<TriangleBuffer, TechniqueError> {
    let name = |stage: &str| format!("{technique}/{stage}");
    let bits = bits(graph, frame, technique, 0);
    let shader = frame.shader(&format!("surfaces/triangles/mark.comp{}", visible.tag('#')))?;
    let mut pass = frame.compute(graph, &name("mark"), PassRole::TriangleSelection, &shader);
    pass.constant("SAMPLES", visible.samples());
    visible.bind(frame, &mut pass);
    let bits = pass.write("MarkedBits", bits);
    pass.dispatch(frame.groups(8));
    pass.finish();
    store_marked(graph, frame, (technique, params), bits, matches!(visible, Visible::Keys { .. }))
}

/// Draws of the scene, at least one.
fn draw_count(frame: &Frame<'_>) -> u32 {
    (frame.scene.draw_count() as u32).max(1)
}

/// Declares a bit for each triangle of the scene, 1,024 a draw, 32 of them the word `value`.
pub fn bits(graph: &mut Graph, frame: &Frame<'_>, technique: &str, value: u32) -> BufferHandle {
    let bytes = 4 * u64::from(draw_count(frame)) * WORDS_A_DRAW;
    let bits = graph.buffer(&format!("{technique}/visible bits"), BufferRole::TriangleSets, bytes);
    graph.clear_buffer(&format!("{technique}/clear bits"), PassRole::TriangleSelection, bits, value)
}

/// Declares the passes that store every triangle whose bit is set; `by_keys`: bits stand in the order of draws instead of that
/// of triangle IDs.
///
/// # Errors
/// More triangles than one binding holds.
pub fn store_marked(
    graph: &mut Graph,
    frame: &Frame<'_>,
    (technique, params): (&str, RecordParams),
    bits: BufferHandle,
    by_keys: bool,
) -> Result<TriangleBuffer, TechniqueError> {
    let name = |stage: &str| format!("{technique}/{stage}");
    let draws = draw_count(frame);
    let blocks = draws.div_ceil(BLOCK_DRAWS);
    let layout = RecordLayout::of(frame, params);
    let (capacity, bytes) = room(frame, technique, layout)?;
    let before =
        graph.buffer(&name("visible before"), BufferRole::TriangleSets, 4 * u64::from(draws) * WORDS_A_DRAW);
    let of_block = graph.buffer(&name("visible of block"), BufferRole::TriangleSets, 4 * u64::from(blocks));
    let base = graph.buffer(&name("block base"), BufferRole::TriangleSets, 4 * u64::from(blocks));
    let count = graph.buffer(&name("triangle count"), BufferRole::TriangleSets, 8);
    let groups = graph.buffer(&name("dispatch groups"), BufferRole::TriangleSets, 12);
    let words = graph.buffer(&name("triangle buffer"), BufferRole::Triangles, bytes);

    let mut pass = frame.compute(
        graph,
        &name("count"),
        PassRole::TriangleSelection,
        &frame.shader("surfaces/triangles/count.comp")?,
    );
    pass.constant("DRAWS", draws);
    pass.read("VisibleBits", &bits);
    let before = pass.write("VisibleBeforeOut", before);
    let of_block = pass.write("VisibleOfBlock", of_block);
    pass.dispatch(frame.groups_in_rows(blocks));
    pass.finish();

    let mut pass = frame.compute(
        graph,
        &name("scan"),
        PassRole::TriangleSelection,
        &frame.shader("surfaces/triangles/scan.comp")?,
    );
    pass.constant("BLOCKS", blocks).push(&capacity);
    pass.read("VisibleOfBlock", &of_block);
    let base = pass.write("BlockBaseOut", base);
    let count = pass.write("TriangleCount", count);
    let groups = pass.write("DispatchGroups", groups);
    pass.dispatch([1, 1, 1]);
    pass.finish();

    let ids = RecordIds::wanted(graph, frame, technique, capacity);
    let tag = if by_keys { format!("#keys{}", ids.tag('-')) } else { ids.tag('#') };
    let shader = frame.shader(&format!("surfaces/triangles/derivatives.comp{tag}"))?;
    let mut pass = frame.compute(graph, &name("derivatives"), PassRole::Derivatives, &shader);
    pass.constant("DRAWS", draws);
    set_constants(&mut pass, layout.constants());
    pass.read("TriangleCount", &count);
    pass.read("VisibleBits", &bits).read("VisibleBefore", &before).read("BlockBase", &base);
    if by_keys {
        pass.read("DrawCommands", &frame.buffers.commands);
    }
    let words = pass.write("TriangleBuffer", words);
    let ids = ids.written_by(&mut pass);
    pass.dispatch_indirect(&groups, 0);
    pass.finish();

    frame.watch(graph, "triangles", &count, capacity, false);
    Ok(TriangleBuffer { records: Records { words, layout, ids, capacity }, bits, before, base })
}
