//! The stage that finds how far the surface of each pixel has moved on screen since the frame before.
//!
//! See the README of this folder.

use afterlight_frame::{Frame, TechniqueError, Velocity};
use afterlight_graph::{BufferHandle, BufferRole, Graph, ImageHandle, Load, PassRole, RasterPass, gpu::vk};

use super::geometry::SceneDraws;

/// Velocity, along both axes, of a surface that was behind the eye in the frame before, pixels: where it was, there is no pixel. No velocity is
/// larger. Twin: `velocity.frag.glsl`.
pub const NOWHERE_PX: f32 = 32_768.0;

/// Name of the image of velocities.
pub const VELOCITY: &str = "shared/velocity";

/// Threads of a group of `remember.comp.glsl`.
const GROUP: u32 = 64;

/// Bytes of a position.
const POSITION_BYTES: u64 = 12;

/// Puts [`Velocity`] on the board, unless it is there: declares the pass `shared/velocity`, and where meshes deform in frames of a flight
/// `shared/remember positions`. Who needs velocities asks for them so; frames in which nobody does have none of it.
///
/// # Errors
/// A shader that is not compiled in, the device.
pub fn record(graph: &mut Graph, frame: &Frame<'_>) -> Result<(), TechniqueError> {
    if frame.board.has::<Velocity>() {
        return Ok(());
    }
    let before = Before::declare(graph, frame)?;
    let target = graph.image(VELOCITY, BufferRole::Shared, frame.image_info(vk::Format::R16G16_SFLOAT));
    let depth =
        graph.image("shared/velocity depth", BufferRole::Shared, frame.image_info(vk::Format::D32_SFLOAT));
    let mut draws = SceneDraws::new(
        frame,
        ("surfaces/geometry/surface.vert#velocity", Some("surfaces/velocity/velocity.frag")),
        ("surfaces/geometry/surface.vert#velocity-uv", "surfaces/velocity/velocity.frag#mask"),
    )?;
    draws.constants = before.constants();
    let mut pass = graph.raster(VELOCITY, PassRole::Shared);
    frame.bind_scene(&mut pass);
    before.bind(frame, &mut pass);
    let target = pass.color(target, Load::Clear([0.0; 4]));
    let _depth = pass.depth(depth, Load::Clear(0.0));
    draws.draw(frame, &mut pass);
    pass.finish();
    frame.board.put(Velocity(target));
    Ok(())
}

/// Where surfaces stood in the frame before; what is `None` stands still.
struct Before {
    records: Option<ImageHandle>,
    deformed: Option<Deformed>,
}

/// Positions of deformed vertices in the frame before.
struct Deformed {
    positions: BufferHandle,
    first: u32,
    end: u32,
}

impl Before {
    fn declare(graph: &mut Graph, frame: &Frame<'_>) -> Result<Self, TechniqueError> {
        if !frame.scene_moves {
            return Ok(Self { records: None, deformed: None });
        }
        let records = frame.inputs.declare_records_before(frame.device, graph, frame.scene)?;
        Ok(Self { records: Some(records), deformed: Deformed::declare(graph, frame)? })
    }

    /// Specialization constants of `surface.vert.glsl#velocity`.
    fn constants(&self) -> Vec<(String, u32)> {
        let (first, end) = self.deformed.as_ref().map_or((0, 0), |deformed| (deformed.first, deformed.end));
        vec![("FIRST_DEFORMED".to_owned(), first), ("END_DEFORMED".to_owned(), end)]
    }

    fn bind(&self, frame: &Frame<'_>, pass: &mut RasterPass<'_>) {
        let deformed = self.deformed.as_ref().map(|deformed| &deformed.positions);
        pass.read("draw_data_before", self.records.as_ref().unwrap_or(&frame.buffers.draw_data));
        pass.read("PositionsBefore", deformed.unwrap_or(&frame.buffers.positions));
    }
}

impl Deformed {
    /// Keeps the positions of this frame for the next one; `None` where nothing deforms.
    fn declare(graph: &mut Graph, frame: &Frame<'_>) -> Result<Option<Self>, TechniqueError> {
        let Some(deformed) = &frame.scene.deformed else { return Ok(None) };
        let (first, end) = (deformed.vertices.start, deformed.vertices.end);
        let bytes = POSITION_BYTES * u64::from(end - first);
        let history = graph.history_buffer("shared/deformed positions", BufferRole::Shared, bytes);
        let shader = frame.shader("surfaces/velocity/remember.comp")?;
        let mut pass = graph.compute("shared/remember positions", PassRole::Shared, &shader);
        let count = 3 * (end - first);
        pass.push(&[3 * first, count]);
        pass.read("Positions", &frame.buffers.positions);
        let _now = pass.write("Remembered", history.now);
        pass.dispatch(frame.groups_in_rows(count.div_ceil(GROUP)));
        pass.finish();
        Ok(Some(Self { positions: history.before, first, end }))
    }
}
