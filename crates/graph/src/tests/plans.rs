//! Plans: what is dropped, where barriers stand, what shares memory; random frames against the brute-force checker.

use afterlight_gpu::vk;
use afterlight_shader::{BindingKind, Stage};
use proptest::prelude::*;

use super::checker::Checker;
use super::{FAKE_ALLOCATION_BYTES, FakeDevice, Slot, shader, with_outputs};
use crate::{
    BufferHandle, BufferRole, DepthTest, Draw, DrawCall, Graph, ImageHandle, ImageInfo, Load, PassRole,
    PassWork, Plan, RasterState, Subresource,
};

const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;

fn fill(g: &mut Graph, name: &str, buffer: BufferHandle) -> BufferHandle {
    let shader = shader(name, Stage::Compute, &[Slot("out", BindingKind::StorageBuffer, "w")]);
    let mut pass = g.compute(name, PassRole::LightAssignment, &shader);
    let buffer = pass.write("out", buffer);
    pass.dispatch([1; 3]);
    buffer
}

fn map(g: &mut Graph, name: &str, from: &BufferHandle, to: BufferHandle) -> BufferHandle {
    let slots = [Slot("from", BindingKind::StorageBuffer, "r"), Slot("to", BindingKind::StorageBuffer, "w")];
    let shader = shader(name, Stage::Compute, &slots);
    let mut pass = g.compute(name, PassRole::LightAssignment, &shader);
    pass.read("from", from);
    let to = pass.write("to", to);
    pass.dispatch([1; 3]);
    to
}

/// A chain of `count` buffers, each made from the one before; the last or all kept.
fn chain(count: usize, keep_all: bool) -> Plan {
    let mut g = Graph::new();
    let first = g.buffer("b0", BufferRole::Lights, 1000);
    let mut last = fill(&mut g, "p0", first);
    for index in 1..count {
        if keep_all {
            g.keep(&last);
        }
        let next = g.buffer(&format!("b{index}"), BufferRole::Lights, 1000);
        last = map(&mut g, &format!("p{index}"), &last, next);
    }
    g.keep(&last);
    g.plan(&FakeDevice).expect("a valid frame")
}

#[test]
fn a_chain_shares_two_places() {
    let plan = chain(6, false);
    assert_eq!(plan.passes.len(), 6);
    assert_eq!(plan.peak_bytes(), 2 * 1024, "neighbours live together, others do not");
    assert_eq!(plan.technique_bytes(), 6 * 1024);
    Checker::run(&plan).expect("a sound plan");
}

/// Buffers of `bytes` each, all of which live to the end.
fn kept_buffers(bytes: &[u64]) -> Plan {
    let mut g = Graph::new();
    for (index, bytes) in bytes.iter().enumerate() {
        let buffer = g.buffer(&format!("b{index}"), BufferRole::Lights, *bytes);
        let buffer = fill(&mut g, &format!("p{index}"), buffer);
        g.keep(&buffer);
    }
    g.plan(&FakeDevice).expect("a valid frame")
}

/// Heaps are allocations: none is larger than the device allows, and what fits one heap stays in one.
#[test]
fn heaps_are_no_larger_than_an_allocation() {
    let most = FAKE_ALLOCATION_BYTES;
    let heaps = |bytes: &[u64]| -> Vec<u64> {
        let plan = kept_buffers(bytes);
        Checker::run(&plan).expect("a sound plan");
        plan.heaps.iter().map(|heap| heap.bytes).collect()
    };
    assert_eq!(heaps(&[most / 2, most / 2]), [most], "what fits is one allocation");
    assert_eq!(heaps(&[most / 2, most / 2, 256]), [most, 256], "one byte more is another");
    assert_eq!(heaps(&[most, most, 256]), [most, most, 256]);
    assert_eq!(heaps(&[most - 256, 512, 256]), [most, 512], "a small one takes what a large one left");
    assert_eq!(heaps(&[most + 256, 256]), [most + 256, 256], "no heap holds it: the device names it");
}

/// Resources that live at different times still share memory where heaps are split.
#[test]
fn split_heaps_are_shared_over_time() {
    let mut g = Graph::new();
    let bytes = FAKE_ALLOCATION_BYTES / 2 + 256;
    let first = g.buffer("b0", BufferRole::Lights, bytes);
    let mut last = fill(&mut g, "p0", first);
    for index in 1..6 {
        let next = g.buffer(&format!("b{index}"), BufferRole::Lights, bytes);
        last = map(&mut g, &format!("p{index}"), &last, next);
    }
    g.keep(&last);
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    let heaps: Vec<u64> = plan.heaps.iter().map(|heap| heap.bytes).collect();
    assert_eq!(heaps, [bytes, bytes], "two live at once");
    Checker::run(&plan).expect("a sound plan");
}

/// What a pass reads is told apart from what it overwrites, and an attachment that is cleared is not read.
#[test]
fn traffic_is_told_by_pass() {
    let plan = chain(2, false);
    let told = |index: usize| {
        let traffic = plan.traffic(&plan.passes[index]);
        traffic.into_iter().map(|t| (t.name, t.bytes, t.read, t.written)).collect::<Vec<_>>()
    };
    assert_eq!(told(0), [("b0", 1024, false, true)]);
    assert_eq!(told(1), [("b0", 1024, true, false), ("b1", 1024, false, true)]);

    for (load, reads) in [(Load::Clear([0.0; 4]), false), (Load::Keep, true)] {
        let mut g = Graph::new();
        let image = g.image("hdr", BufferRole::Targets, ImageInfo::new(COLOR, 64, 64));
        let image = g.clear_image("clear", PassRole::Upkeep, image, [0.0; 4]);
        let mut pass = g.raster("raster", PassRole::Shading);
        let image = pass.color(image, load);
        pass.finish();
        g.keep(&image);
        let plan = g.plan(&FakeDevice).expect("a valid frame");
        let last = plan.passes.last().expect("a pass");
        assert_eq!(plan.traffic(last).first().map(|t| (t.read, t.written)), Some((reads, true)), "{load:?}");
    }
}

#[test]
fn passes_without_use_are_dropped() {
    let mut g = Graph::new();
    let (a, b, c) = (
        g.buffer("a", BufferRole::Lights, 16),
        g.buffer("b", BufferRole::Lights, 16),
        g.buffer("c", BufferRole::Lights, 16),
    );
    let a = fill(&mut g, "used", a);
    let b = map(&mut g, "unused", &a, b);
    let _ = map(&mut g, "unused too", &b, c);
    g.keep(&a);
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    assert_eq!(plan.dropped, ["unused", "unused too"]);
    assert_eq!(plan.passes.len(), 1);
    assert_eq!(plan.peak_bytes(), 256);
}

#[test]
fn an_overwritten_version_is_dropped() {
    let mut g = Graph::new();
    let image = g.image("hdr", BufferRole::Targets, ImageInfo::new(COLOR, 64, 64));
    let image = g.clear_image("first", PassRole::Upkeep, image, [0.0; 4]);
    let image = g.clear_image("second", PassRole::Upkeep, image, [1.0; 4]);
    g.keep(&image);
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    assert_eq!(plan.dropped, ["first"]);
}

#[test]
fn readers_share_one_barrier() {
    let mut g = Graph::new();
    let a = g.buffer("a", BufferRole::Lights, 16);
    let a = fill(&mut g, "write", a);
    for index in 0..3 {
        let out = g.buffer(&format!("out{index}"), BufferRole::Lights, 16);
        let out = map(&mut g, &format!("read{index}"), &a, out);
        g.keep(&out);
    }
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    let counts: Vec<usize> = plan.passes.iter().map(|pass| pass.barriers.len()).collect();
    assert_eq!(counts, [0, 1, 0, 0]);
}

#[test]
fn mip_levels_are_tracked_apart() {
    let mut g = Graph::new();
    let image =
        g.image("pyramid", BufferRole::Targets, ImageInfo::new(vk::Format::R32_SFLOAT, 64, 64).mips(3));
    let mut image = g.clear_image_range("top", PassRole::Upkeep, image, Subresource::mip(0), [0.5; 4]);
    let slots = [Slot("from", BindingKind::SampledImage, "r"), Slot("to", BindingKind::StorageImage, "w")];
    let down = shader("down", Stage::Compute, &slots);
    for mip in 1..3 {
        let mut pass = g.compute(&format!("down{mip}"), PassRole::LightAssignment, &down);
        pass.read_range("from", &image, Subresource::mip(mip - 1));
        image = pass.write_range("to", image, Subresource::mip(mip));
        pass.dispatch([1; 3]);
    }
    g.keep(&image);
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    assert_eq!(plan.passes.len(), 3);
    Checker::run(&plan).expect("a sound plan");
}

#[test]
fn depth_is_sampled_while_the_stencil_is_written() {
    let mut g = Graph::new();
    let info = ImageInfo::new(DEPTH, 32, 32);
    let (depth, color) = (
        g.image("depth", BufferRole::Depth, info),
        g.image("color", BufferRole::Targets, ImageInfo::new(COLOR, 32, 32)),
    );
    let mut pass = g.raster("prepass", PassRole::DepthPrepass);
    let depth = pass.depth(depth, Load::Clear(0.0));
    pass.stencil_clear(0);
    let vertex = shader("v", Stage::Vertex, &[]);
    pass.draw(Draw::new(RasterState::new(&vertex, None).depth(DepthTest::NEAREST), DrawCall::vertices(3)));
    let fragment = with_outputs(
        shader("f", Stage::Fragment, &[Slot("depth", BindingKind::CombinedImageSampler, "r")]),
        1,
    );
    let mut pass = g.raster("light", PassRole::Shading);
    pass.read("depth", &depth);
    let color = pass.color(color, Load::Clear([0.0; 4]));
    let depth = pass.stencil(depth, Load::Keep);
    pass.draw(Draw::new(RasterState::new(&vertex, Some(&fragment)), DrawCall::vertices(3)));
    g.keep(&color);
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    let layout =
        plan.passes[1].accesses.iter().find(|access| access.resource == depth.id()).expect("used").layout;
    assert_eq!(layout, vk::ImageLayout::DEPTH_READ_ONLY_STENCIL_ATTACHMENT_OPTIMAL);
    Checker::run(&plan).expect("a sound plan");
}

#[test]
fn imported_images_return_to_their_layout() {
    let mut g = Graph::new();
    let info = ImageInfo::new(COLOR, 8, 8);
    let image =
        g.import_fake("outside", BufferRole::Targets, info, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
    let image = g.clear_image("clear", PassRole::Upkeep, image, [0.0; 4]);
    assert_eq!(image.info(), info);
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    assert_eq!(plan.passes.len(), 1, "writing an imported image is a use");
    assert_eq!(plan.final_barriers.len(), 1);
    assert_eq!(plan.peak_bytes(), 0);
    Checker::run(&plan).expect("a sound plan");
}

#[test]
fn outputs_and_shared_work_are_no_technique_bytes() {
    let mut g = Graph::new();
    let (a, b, c) = (
        g.buffer("shared/shadow", BufferRole::Shared, 100),
        g.buffer("list", BufferRole::Lights, 100),
        g.buffer("out", BufferRole::Lights, 100),
    );
    let a = fill(&mut g, "shared/map", a);
    let b = map(&mut g, "make", &a, b);
    let c = map(&mut g, "use", &b, c);
    g.mark_output(&c);
    g.keep(&c);
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    assert_eq!(plan.technique_bytes(), 256);
}

/// Names say nothing: `shared/…` without the role of shared work is a technique's own.
#[test]
fn roles_travel_from_declaration_to_plan() {
    let mut g = Graph::new();
    let list = g.buffer("shared/list", BufferRole::Lights, 100);
    let list = g.clear_buffer("shared/clear", PassRole::LightAssignment, list, 0);
    let copy = g.buffer("copy", BufferRole::SurfaceListNodes, 100);
    let copy = g.copy_buffer("copied", PassRole::Geometry, &list, copy);
    let target = g.image("target", BufferRole::Shared, ImageInfo::new(COLOR, 4, 4));
    let target = g.clear_image("map", PassRole::Shared, target, [0.0; 4]);
    let slots = [Slot("from", BindingKind::StorageBuffer, "r"), Slot("to", BindingKind::StorageImage, "w")];
    let mut pass = g.compute("shade", PassRole::Shading, &shader("shade", Stage::Compute, &slots));
    pass.read("from", &copy);
    let target = pass.write("to", target);
    pass.dispatch([1; 3]);
    pass.finish();
    let mut pass = g.raster("draw", PassRole::Transparency);
    let target = pass.color(target, Load::Keep);
    pass.finish();
    g.keep(&target);
    let plan = g.plan(&FakeDevice).expect("a valid frame");

    let passes: Vec<_> = plan.passes.iter().map(|pass| (pass.role, pass.work)).collect();
    assert_eq!(
        passes,
        [
            (PassRole::LightAssignment, PassWork::Clear),
            (PassRole::Geometry, PassWork::Copy),
            (PassRole::Shared, PassWork::Clear),
            (PassRole::Shading, PassWork::Compute),
            (PassRole::Transparency, PassWork::Raster),
        ]
    );
    let resources: Vec<_> = plan.resources.iter().map(|one| (one.role, one.shared())).collect();
    assert_eq!(
        resources,
        [(BufferRole::Lights, false), (BufferRole::SurfaceListNodes, false), (BufferRole::Shared, true)]
    );
    let traffic: Vec<_> =
        plan.traffic(&plan.passes[3]).iter().map(|one| (one.role, one.read, one.written)).collect();
    assert_eq!(traffic, [(BufferRole::SurfaceListNodes, true, false), (BufferRole::Shared, false, true)]);
    assert_eq!(plan.technique_bytes(), 512);
}

/// The checker must see what it is there to see.
#[test]
fn mutants_are_caught() {
    let sound = chain(5, true);
    for pass in 0..sound.passes.len() {
        for barrier in 0..sound.passes[pass].barriers.len() {
            let mut mutant = sound.clone();
            mutant.passes[pass].barriers.remove(barrier);
            assert!(Checker::run(&mutant).is_err(), "barrier {barrier} before pass {pass} dropped");
            let mut mutant = sound.clone();
            mutant.passes[pass].barriers[barrier].dst_stages = vk::PipelineStageFlags2::VERTEX_SHADER;
            assert!(Checker::run(&mutant).is_err(), "barrier {barrier} before pass {pass} for another stage");
        }
    }
    let sound = chain(5, false);
    for pass in 1..sound.passes.len() {
        let mut mutant = sound.clone();
        mutant.passes[pass].barriers.clear();
        assert!(Checker::run(&mutant).is_err(), "all barriers before pass {pass} dropped");
    }
    let mut mutant = sound.clone();
    let place = mutant.resources[0].placement;
    mutant.resources[1].placement = place;
    let before = Checker::run(&sound).expect("a sound plan");
    assert_ne!(Checker::run(&mutant).ok(), Some(before), "two resources alive at once in one place");
}

/// What a random pass does, as numbers that [`random_graph`] reads as it can.
pub type Step = (u8, Vec<u8>);

/// A random frame under declaration.
pub struct Frame {
    pub graph: Graph,
    images: Vec<(Option<ImageHandle>, bool)>,
    buffers: Vec<(Option<BufferHandle>, bool)>,
}

const SLOT_NAMES: [&str; 8] = ["s0", "s1", "s2", "s3", "s4", "s5", "s6", "s7"];

/// A compute pass over distinct resources: each pick is read if it holds something and the pick says so, else written.
fn random_compute(frame: &mut Frame, name: &str, picks: &[u8]) {
    let count = frame.images.len() + frame.buffers.len();
    let mut seen = Vec::new();
    let mut plan = Vec::new();
    for pick in picks {
        let target = *pick as usize % count;
        if seen.contains(&target) || plan.len() == SLOT_NAMES.len() {
            continue;
        }
        seen.push(target);
        let is_image = target < frame.images.len();
        let holds =
            if is_image { frame.images[target].1 } else { frame.buffers[target - frame.images.len()].1 };
        // The last image has a depth format, which shaders only read.
        let read_only = target + 1 == frame.images.len();
        if read_only && !holds {
            continue;
        }
        let read = holds && (read_only || pick & 64 != 0);
        let kind = match (is_image, read, pick & 128 != 0) {
            (false, ..) => BindingKind::StorageBuffer,
            (true, true, false) => BindingKind::SampledImage,
            (true, true, true) if !read_only => BindingKind::StorageImage,
            (true, true, true) => BindingKind::SampledImage,
            (true, false, _) => BindingKind::StorageImage,
        };
        let mode = match (read, pick & 32 != 0 && holds) {
            (true, _) => "ra",
            (false, true) => "rwa",
            (false, false) => "wa",
        };
        let range = match kind {
            // One level, of all layers or of one; the whole of what was not yet written where there is but one level.
            BindingKind::StorageImage if target == 2 && pick & 16 != 0 => {
                Subresource::mip_layer(u32::from(pick % 3), u32::from(pick % 2))
            }
            BindingKind::StorageImage if target == 2 => Subresource::mip(u32::from(pick % 3)),
            _ => Subresource::ALL,
        };
        plan.push((target, read, kind, mode, range));
    }
    let slots: Vec<Slot> =
        plan.iter().zip(SLOT_NAMES).map(|((_, _, kind, mode, _), slot)| Slot(slot, *kind, mode)).collect();
    let shader = shader(name, Stage::Compute, &slots);
    let mut pass = frame.graph.compute(name, PassRole::LightAssignment, &shader);
    for ((target, read, _, _, range), slot) in plan.iter().zip(SLOT_NAMES) {
        if *target < frame.images.len() {
            let (handle, holds) = &mut frame.images[*target];
            let image = handle.take().expect("handles come back");
            *handle = Some(if *read {
                pass.read_range(slot, &image, *range);
                image
            } else {
                // The image of many levels is whole only after a clear.
                *holds |= *target != 2;
                pass.write_range(slot, image, *range)
            });
        } else {
            let (handle, holds) = &mut frame.buffers[*target - frame.images.len()];
            let buffer = handle.take().expect("handles come back");
            *handle = Some(if *read {
                pass.read(slot, &buffer);
                buffer
            } else {
                *holds = true;
                pass.write(slot, buffer)
            });
        }
    }
    pass.dispatch([1; 3]);
}

fn random_raster(frame: &mut Frame, name: &str, picks: &[u8]) {
    let depth_index = frame.images.len() - 1;
    let mut pass = frame.graph.raster(name, PassRole::Shading);
    let mut colors = 0;
    // Images 0 and 1 have one level and the depth image's extent.
    for (index, pick) in picks.iter().take(2).enumerate() {
        if pick & 1 == 0 && index > 0 {
            continue;
        }
        let (handle, holds) = &mut frame.images[index];
        let load = match pick & 6 {
            0 if *holds => Load::Keep,
            2 => Load::DontCare,
            _ => Load::Clear([0.0; 4]),
        };
        *handle = Some(pass.color(handle.take().expect("handles come back"), load));
        *holds = true;
        colors += 1;
    }
    let pick = picks.get(2).copied().unwrap_or(0);
    let (handle, holds) = &mut frame.images[depth_index];
    let depth = handle.take().expect("handles come back");
    let mut test = DepthTest::OFF;
    *handle = Some(match pick % 4 {
        0 => depth,
        1 if *holds => {
            pass.depth_read_only(&depth);
            depth
        }
        2 if *holds => pass.stencil(depth, Load::Clear(0)),
        _ => {
            let load = if *holds && pick & 16 != 0 { Load::Keep } else { Load::Clear(0.0) };
            *holds = true;
            test = DepthTest::NEAREST;
            pass.depth(depth, load)
        }
    });
    let vertex = shader("v", Stage::Vertex, &[]);
    let fragment = with_outputs(shader("f", Stage::Fragment, &[]), colors);
    pass.draw(Draw::new(RasterState::new(&vertex, Some(&fragment)).depth(test), DrawCall::vertices(3)));
}

fn random_transfer(frame: &mut Frame, name: &str, picks: &[u8]) {
    let pick = picks.first().copied().unwrap_or(0);
    let graph = &mut frame.graph;
    if pick & 1 == 0 {
        let index = (pick >> 1) as usize % (frame.images.len() - 1);
        let (handle, holds) = &mut frame.images[index];
        let image = handle.take().expect("handles come back");
        let whole = pick & 64 != 0 || !*holds;
        let range = if whole { Subresource::ALL } else { Subresource::mip(image.info().mips - 1) };
        *handle = Some(graph.clear_image_range(name, PassRole::Upkeep, image, range, [0.0; 4]));
        *holds = true;
    } else {
        let (dst, src) =
            ((pick >> 1) as usize % frame.buffers.len(), (pick >> 4) as usize % frame.buffers.len());
        let to = frame.buffers[dst].0.take().expect("handles come back");
        let copies = src != dst && frame.buffers[src].1;
        frame.buffers[dst].0 = Some(match &frame.buffers[src].0 {
            Some(from) if copies => graph.copy_buffer(name, PassRole::Upkeep, from, to),
            _ => graph.clear_buffer(name, PassRole::Upkeep, to, 0),
        });
        frame.buffers[dst].1 = true;
    }
}

fn random_graph(steps: &[Step], kept: u16, keep_all: bool) -> Graph {
    random_frame_in(Graph::new(), steps, kept, keep_all).graph
}

/// Adds random passes to a graph.
pub fn random_frame_in(mut graph: Graph, steps: &[Step], kept: u16, keep_all: bool) -> Frame {
    let infos = [
        ImageInfo::new(COLOR, 32, 32),
        ImageInfo::new(COLOR, 32, 32),
        ImageInfo::new(COLOR, 64, 16).mips(3).layers(2),
        ImageInfo::new(COLOR, 128, 64),
        ImageInfo::new(DEPTH, 32, 32),
    ];
    let images = infos
        .iter()
        .enumerate()
        .map(|(index, info)| {
            let name = format!("image{index}");
            match index {
                3 => (
                    Some(graph.import_fake(&name, BufferRole::Targets, *info, vk::ImageLayout::GENERAL)),
                    true,
                ),
                _ => (Some(graph.image(&name, BufferRole::Targets, *info)), false),
            }
        })
        .collect();
    let buffers = (0..5)
        .map(|index| {
            (Some(graph.buffer(&format!("buffer{index}"), BufferRole::Lights, 300 * (index + 1))), false)
        })
        .collect();
    let mut frame = Frame { graph, images, buffers };
    for (index, (kind, picks)) in steps.iter().enumerate() {
        let name = format!("pass{index}");
        match kind % 4 {
            0 | 1 => random_compute(&mut frame, &name, picks),
            2 => random_raster(&mut frame, &name, picks),
            _ => random_transfer(&mut frame, &name, picks),
        }
    }
    for (index, (handle, holds)) in frame.images.iter().enumerate() {
        if let (Some(handle), true, true) = (handle, *holds, keep_all || kept & (1 << index) != 0) {
            frame.graph.keep(handle);
        }
    }
    for (index, (handle, holds)) in frame.buffers.iter().enumerate() {
        if let (Some(handle), true, true) = (handle, *holds, keep_all || kept & (1 << (8 + index)) != 0) {
            frame.graph.keep(handle);
        }
    }
    frame
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any frame: no hazard is left open, layouts are right, and what is kept is what it is with everything kept.
    #[test]
    fn random_frames_are_sound(
        steps in prop::collection::vec((any::<u8>(), prop::collection::vec(any::<u8>(), 1..6)), 1..14),
        kept in any::<u16>(),
    ) {
        let plan = random_graph(&steps, kept, false).plan(&FakeDevice).expect("a valid frame");
        let all = random_graph(&steps, kept, true).plan(&FakeDevice).expect("a valid frame");
        let results = Checker::run(&plan).map_err(TestCaseError::fail)?;
        let expected = Checker::run(&all).map_err(TestCaseError::fail)?;
        for (key, value) in &results {
            prop_assert_eq!(Some(value), expected.get(key), "{:?} differs from a frame without aliasing", key);
        }
        prop_assert!(plan.peak_bytes() <= all.peak_bytes());
    }

    /// A barrier dropped from a random frame is noticed: those that show a write to a reader or change a layout are all needed.
    #[test]
    fn dropped_barriers_are_noticed(
        steps in prop::collection::vec((any::<u8>(), prop::collection::vec(any::<u8>(), 1..6)), 2..10),
        pick in any::<prop::sample::Index>(),
    ) {
        let plan = random_graph(&steps, u16::MAX, true).plan(&FakeDevice).expect("a valid frame");
        let sites: Vec<(usize, usize)> = plan
            .passes
            .iter()
            .enumerate()
            .flat_map(|(pass, planned)| (0..planned.barriers.len()).map(move |barrier| (pass, barrier)))
            // A barrier that only orders may be covered by another one's stages.
            .filter(|(pass, barrier)| {
                let barrier = plan.passes[*pass].barriers[*barrier];
                let first_of_import = barrier.src_stages == vk::PipelineStageFlags2::ALL_COMMANDS;
                let reads_only = !barrier.dst_access.intersects(
                    vk::AccessFlags2::SHADER_STORAGE_WRITE
                        | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE
                        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE
                        | vk::AccessFlags2::TRANSFER_WRITE,
                );
                let shows_a_write = !barrier.src_access.is_empty() && reads_only && !first_of_import;
                shows_a_write || barrier.old_layout != barrier.new_layout
            })
            .collect();
        prop_assume!(!sites.is_empty());
        let (pass, barrier) = sites[pick.index(sites.len())];
        let mut mutant = plan.clone();
        mutant.passes[pass].barriers.remove(barrier);
        prop_assert!(Checker::run(&mutant).is_err(), "pass {} without its barrier {}", pass, barrier);
    }
}
