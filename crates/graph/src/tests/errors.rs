//! Every mistake of a declaration is an error that names pass, slot, found and expected.

use afterlight_gpu::vk;
use afterlight_shader::{BindingKind, Stage};

use super::{FakeDevice, Slot, shader, with_constant, with_outputs, with_push};
use crate::{
    BufferRole, DepthTest, Draw, DrawCall, Graph, GraphError, ImageInfo, Load, PassRole, RasterState,
    Subresource,
};

const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;

fn message(g: Graph) -> String {
    match g.plan(&FakeDevice) {
        Ok(_) => "no error".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[track_caller]
fn names_all(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "{message:?} does not name {part:?}");
    }
}

#[test]
fn a_missing_slot() {
    let mut g = Graph::new();
    let (a, list) = (g.buffer("a", BufferRole::Lights, 4), g.buffer("b", BufferRole::Lights, 4));
    let slots =
        [Slot("lights", BindingKind::StorageBuffer, "r"), Slot("list", BindingKind::StorageBuffer, "w")];
    let cull = shader("tiled/cull.comp", Stage::Compute, &slots);
    let _ = g.clear_buffer("clear", PassRole::Upkeep, a, 0);
    let mut pass = g.compute("tiled/cull", PassRole::LightAssignment, &cull);
    let _ = pass.write("list", list);
    pass.dispatch([1; 3]);
    names_all(&message(g), &["tiled/cull", "tiled/cull.comp", "\"lights\"", "storage buffer", "binds list"]);
}

#[test]
fn a_doubly_bound_slot() {
    let mut g = Graph::new();
    let (a, b) = (g.buffer("first", BufferRole::Lights, 4), g.buffer("second", BufferRole::Lights, 4));
    let cull = shader("cull", Stage::Compute, &[Slot("lights", BindingKind::StorageBuffer, "r")]);
    let mut pass = g.compute("tiled/cull", PassRole::LightAssignment, &cull);
    pass.read("lights", &a).read("lights", &b);
    names_all(&message(g), &["tiled/cull", "\"lights\"", "first", "second"]);
}

#[test]
fn a_wrong_kind() {
    let mut g = Graph::new();
    let image = g.image("map", BufferRole::Targets, ImageInfo::new(COLOR, 4, 4));
    let image = g.clear_image("clear", PassRole::Upkeep, image, [0.0; 4]);
    let cull = shader("cull", Stage::Compute, &[Slot("lights", BindingKind::StorageBuffer, "r")]);
    let mut pass = g.compute("tiled/cull", PassRole::LightAssignment, &cull);
    pass.read("lights", &image).has_effect();
    names_all(&message(g), &["tiled/cull", "\"lights\"", "image \"map\"", "storage buffer"]);
}

#[test]
fn wrong_samples() {
    let mut g = Graph::new();
    let image = g.image("map", BufferRole::Targets, ImageInfo::new(COLOR, 4, 4).samples(4));
    let cull = shader("cull", Stage::Compute, &[Slot("map", BindingKind::SampledImage, "r")]);
    let mut pass = g.compute("p", PassRole::LightAssignment, &cull);
    pass.read("map", &image);
    names_all(&message(g), &["\"map\"", "4 samples"]);
}

#[test]
fn a_write_through_a_readonly_binding() {
    let mut g = Graph::new();
    let buffer = g.buffer("b", BufferRole::Lights, 4);
    let cull = shader("cull", Stage::Compute, &[Slot("lights", BindingKind::StorageBuffer, "r")]);
    let mut pass = g.compute("p", PassRole::LightAssignment, &cull);
    let _ = pass.write("lights", buffer);
    names_all(&message(g), &["pass p", "\"lights\"", "found a write", "expected a read"]);
}

#[test]
fn a_read_through_a_writable_binding() {
    let mut g = Graph::new();
    let buffer = g.buffer("b", BufferRole::Lights, 4);
    let buffer = g.clear_buffer("clear", PassRole::Upkeep, buffer, 0);
    let cull = shader("cull", Stage::Compute, &[Slot("lights", BindingKind::StorageBuffer, "rw")]);
    let mut pass = g.compute("p", PassRole::LightAssignment, &cull);
    pass.read("lights", &buffer);
    names_all(&message(g), &["pass p", "\"lights\"", "found a read", "expected a write"]);
}

#[test]
fn an_unknown_written_slot() {
    let mut g = Graph::new();
    let buffer = g.buffer("b", BufferRole::Lights, 4);
    let cull = shader("cull", Stage::Compute, &[]);
    let mut pass = g.compute("p", PassRole::LightAssignment, &cull);
    let _ = pass.write("list", buffer);
    names_all(&message(g), &["pass p", "\"list\"", "expected one of: nothing"]);
}

#[test]
fn an_unknown_constant_and_wrong_push_bytes() {
    let mut g = Graph::new();
    let cull = with_constant(shader("cull", Stage::Compute, &[]), "TILE");
    g.compute("p", PassRole::LightAssignment, &cull).constant("TILES", 16u32).dispatch([1; 3]);
    names_all(&message(g), &["pass p", "\"TILES\"", "TILE"]);

    let mut g = Graph::new();
    let cull = with_push(shader("cull", Stage::Compute, &[]), 16);
    g.compute("p", PassRole::LightAssignment, &cull).push(&[0u32; 2]).dispatch([1; 3]);
    names_all(&message(g), &["pass p", "found 8 bytes", "expected 16"]);
}

/// 65,535 workgroups are what most devices take along an axis; one more is told before a driver sees it.
#[test]
fn a_dispatch_that_is_too_large() {
    let cull = shader("cull", Stage::Compute, &[Slot("list", BindingKind::StorageBuffer, "w")]);
    for (groups, fits) in [([65_535, 1, 1], true), ([65_536, 1, 1], false), ([1, 65_536, 1], false)] {
        let mut g = Graph::new();
        let list = g.buffer("list", BufferRole::Lights, 4);
        let mut pass = g.compute("p", PassRole::LightAssignment, &cull);
        let list = pass.write("list", list);
        pass.dispatch(groups);
        pass.finish();
        g.keep(&list);
        let told = message(g);
        match fits {
            true => assert_eq!(told, "no error"),
            false => names_all(&told, &["pass p", "65536", "65535"]),
        }
    }
}

#[test]
fn a_wrong_stage() {
    let mut g = Graph::new();
    let cull = shader("cull", Stage::Fragment, &[]);
    g.compute("p", PassRole::LightAssignment, &cull).dispatch([1; 3]);
    names_all(&message(g), &["pass p", "cull", "Fragment", "Compute"]);
}

/// A raster pass `p` with one colour and a draw, which does not plan.
fn draw_message(state: RasterState) -> String {
    let mut g = Graph::new();
    let image = g.image("a", BufferRole::Targets, ImageInfo::new(COLOR, 4, 4));
    let mut pass = g.raster("p", PassRole::Shading);
    let _ = pass.color(image, Load::DontCare);
    pass.draw(Draw::new(state, DrawCall::vertices(3)));
    message(g)
}

#[test]
fn stages_between_vertices_and_fragments_that_do_not_fit() {
    let vertex = shader("v", Stage::Vertex, &[]);
    let control = shader("control", Stage::TessControl, &[]);
    let evaluation = shader("evaluation", Stage::TessEvaluation, &[]);
    let state = RasterState::new(&vertex, None);

    let swapped = state.clone().tessellation(&evaluation, &control);
    names_all(&draw_message(swapped), &["pass p", "evaluation", "TessEvaluation", "TessControl"]);
    let twice = state.clone().tessellation(&control, &control);
    names_all(&draw_message(twice), &["pass p", "control", "TessControl", "TessEvaluation"]);
    let strip = state.clone().tessellation(&control, &evaluation);
    let strip = strip.topology(vk::PrimitiveTopology::TRIANGLE_STRIP);
    names_all(&draw_message(strip), &["pass p", "topology", "TRIANGLE_STRIP", "TRIANGLE_LIST"]);
    names_all(&draw_message(state.clone().geometry(&vertex)), &["pass p", "v", "Vertex", "Geometry"]);

    // Slots and constants of these stages are checked as those of the others are.
    let reads = shader("reads", Stage::Geometry, &[Slot("list", BindingKind::StorageBuffer, "r")]);
    names_all(&draw_message(state.clone().geometry(&reads)), &["pass p", "reads", "\"list\""]);
    let control = with_constant(control, "PX");
    let unknown = state.tessellation(&control, &evaluation).constant("PY", 1u32);
    names_all(&draw_message(unknown), &["pass p", "\"PY\"", "PX"]);
}

#[test]
fn a_read_before_any_write() {
    let mut g = Graph::new();
    let buffer = g.buffer("list", BufferRole::Lights, 4);
    let cull = shader("cull", Stage::Compute, &[Slot("list", BindingKind::StorageBuffer, "r")]);
    g.compute("p", PassRole::LightAssignment, &cull).read("list", &buffer);
    names_all(&message(g), &["pass p", "\"list\"", "before any pass has written it"]);

    let mut g = Graph::new();
    let image = g.image("hdr", BufferRole::Targets, ImageInfo::new(COLOR, 4, 4));
    let _ = g.raster("p", PassRole::Shading).color(image, Load::Keep);
    names_all(&message(g), &["pass p", "\"hdr\""]);
}

#[test]
fn feedback() {
    let mut g = Graph::new();
    let image = g.image("hdr", BufferRole::Targets, ImageInfo::new(COLOR, 4, 4));
    let image = g.clear_image("clear", PassRole::Upkeep, image, [0.0; 4]);
    let vertex = shader("v", Stage::Vertex, &[]);
    let fragment =
        with_outputs(shader("f", Stage::Fragment, &[Slot("map", BindingKind::SampledImage, "r")]), 1);
    let mut pass = g.raster("p", PassRole::Shading);
    pass.read("map", &image);
    let _ = pass.color(image, Load::Keep);
    pass.draw(Draw::new(RasterState::new(&vertex, Some(&fragment)), DrawCall::vertices(3)));
    names_all(&message(g), &["pass p", "\"hdr\"", "colour attachment", "input of shaders"]);
}

#[test]
fn attachments_that_do_not_fit() {
    let vertex = shader("v", Stage::Vertex, &[]);
    let state = RasterState::new(&vertex, None).depth(DepthTest::NEAREST);

    let mut g = Graph::new();
    let image = g.image("a", BufferRole::Targets, ImageInfo::new(COLOR, 4, 4));
    let mut pass = g.raster("p", PassRole::Shading);
    let _ = pass.color(image, Load::DontCare);
    pass.draw(Draw::new(state.clone(), DrawCall::vertices(3)));
    names_all(&message(g), &["pass p", "writes depth", "depth attachment"]);

    let mut g = Graph::new();
    let (a, b) = (
        g.image("a", BufferRole::Targets, ImageInfo::new(COLOR, 4, 4)),
        g.image("b", BufferRole::Targets, ImageInfo::new(COLOR, 5, 4)),
    );
    let mut pass = g.raster("p", PassRole::Shading);
    let _ = (pass.color(a, Load::DontCare), pass.color(b, Load::DontCare));
    names_all(&message(g), &["pass p", "5x4", "4x4"]);

    let mut g = Graph::new();
    g.raster("p", PassRole::Shading).draw(Draw::new(RasterState::new(&vertex, None), DrawCall::vertices(3)));
    names_all(&message(g), &["pass p", "at least one attachment"]);

    let mut g = Graph::new();
    let image = g.image("a", BufferRole::Targets, ImageInfo::new(COLOR, 4, 4));
    let fragment = with_outputs(shader("f", Stage::Fragment, &[]), 2);
    let mut pass = g.raster("p", PassRole::Shading);
    let _ = pass.color(image, Load::DontCare);
    pass.draw(Draw::new(RasterState::new(&vertex, Some(&fragment)), DrawCall::vertices(3)));
    names_all(&message(g), &["pass p", "location 1", "below 1"]);
}

#[test]
fn bad_resources_and_ranges() {
    let mut g = Graph::new();
    let _ = g.image("empty", BufferRole::Targets, ImageInfo::new(COLOR, 0, 4));
    names_all(&message(g), &["\"empty\"", "0x4", "1x1"]);

    let mut g = Graph::new();
    let _ = (g.buffer("twin", BufferRole::Lights, 4), g.buffer("twin", BufferRole::Lights, 4));
    names_all(&message(g), &["\"twin\"", "declared twice"]);

    let mut g = Graph::new();
    let image = g.image("a", BufferRole::Targets, ImageInfo::new(COLOR, 4, 4).mips(2));
    let _ = g.clear_image_range("p", PassRole::Upkeep, image, Subresource::mip(2), [0.0; 4]);
    names_all(&message(g), &["pass p", "mips 2+1", "2 mips"]);
}

#[test]
fn a_range_that_the_shader_cannot_see() {
    let store = shader("store", Stage::Compute, &[Slot("to", BindingKind::StorageImage, "w")]);
    for (info, parts) in [
        (ImageInfo::new(COLOR, 4, 4).mips(3), ["pass p", "in slot to", "3 mip levels", "1 level"]),
        (ImageInfo::new(COLOR, 4, 4).layers(2), ["pass p", "in slot to", "2 layers", "1 layer"]),
    ] {
        let mut g = Graph::new();
        let image = g.image("many", BufferRole::Targets, info);
        let _ = g.compute("p", PassRole::LightAssignment, &store).write("to", image);
        names_all(&message(g), &parts);
    }
}

#[test]
fn a_handle_of_another_graph() {
    let mut other = Graph::new();
    let foreign = other.buffer("b", BufferRole::Lights, 4);
    let mut g = Graph::new();
    let _ = g.clear_buffer("p", PassRole::Upkeep, foreign, 0);
    assert!(matches!(g.plan(&FakeDevice), Err(GraphError::ForeignHandle { .. })));
}
