//! Resources whose version of the frame before is read: what lives, where barriers stand, what is refused.

use afterlight_gpu::vk;
use afterlight_shader::{BindingKind, Stage};
use proptest::prelude::*;

use super::checker::Checker;
use super::{FakeDevice, Slot, shader};
use crate::{
    BufferHandle, BufferRole, Graph, GraphError, Handle, ImageHandle, ImageInfo, PassRole, Plan, Subresource,
};

const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;

/// A pass that reads an image, sampled or as storage, and writes another one.
fn through(g: &mut Graph, name: &str, from: (&ImageHandle, BindingKind), to: ImageHandle) -> ImageHandle {
    let slots = [Slot("from", from.1, "r"), Slot("to", BindingKind::StorageImage, "w")];
    let mut pass = g.compute(name, PassRole::Shading, &shader(name, Stage::Compute, &slots));
    pass.read("from", from.0);
    let to = pass.write("to", to);
    pass.dispatch([1; 3]);
    to
}

fn through_buffers(g: &mut Graph, name: &str, from: &BufferHandle, to: BufferHandle) -> BufferHandle {
    let slots = [Slot("from", BindingKind::StorageBuffer, "r"), Slot("to", BindingKind::StorageBuffer, "w")];
    let mut pass = g.compute(name, PassRole::Shading, &shader(name, Stage::Compute, &slots));
    pass.read("from", from);
    let to = pass.write("to", to);
    pass.dispatch([1; 3]);
    to
}

/// A buffer that is made from that of the frame before, and told.
fn counting(g: &mut Graph) {
    let counts = g.history_buffer("count", BufferRole::Counters, 1000);
    let count = g.clear_buffer("clear count", PassRole::Upkeep, counts.now, 0);
    let count = through_buffers(g, "count", &counts.before, count);
    let told = g.buffer("told", BufferRole::Counters, 1000);
    let told = g.copy_buffer("tell", PassRole::Upkeep, &count, told);
    g.keep(&told);
}

/// An image that is made from that of the frame before, and shown; a buffer likewise.
fn accumulating() -> Plan {
    let mut g = Graph::new();
    let info = ImageInfo::new(COLOR, 32, 32);
    let sums = g.history_image("sum", BufferRole::Targets, info);
    let sum = through(&mut g, "add", (&sums.before, BindingKind::SampledImage), sums.now);
    let shown = g.image("shown", BufferRole::Targets, info);
    let shown = through(&mut g, "show", (&sum, BindingKind::StorageImage), shown);
    g.keep(&shown);
    counting(&mut g);
    g.plan(&FakeDevice).expect("a valid frame")
}

#[test]
fn frames_read_what_the_one_before_wrote() {
    let plan = accumulating();
    assert!(plan.has_history());
    let kept = |next: &[bool]| Checker::frames(&plan, next).expect("a sound plan");
    let (first, second, third) = (kept(&[]), kept(&[true]), kept(&[true, true]));
    for (key, value) in &first {
        assert_ne!(second[key], *value, "{key:?}: the second frame finds what the first wrote");
        assert_ne!(third[key], second[key], "{key:?}: the third frame finds what the second wrote");
    }
    assert_eq!(kept(&[true, false]), second, "a frame that is drawn again reads what it read");
    assert_eq!(kept(&[true, false, true]), third, "and the next one reads what it wrote");
}

/// Both versions live all the time, share memory with nothing, and their bytes are told.
#[test]
fn both_versions_live_for_the_whole_frame() {
    let plan = accumulating();
    let bytes = |name: &str| {
        let id = plan.resource(name).expect("declared");
        let resource = &plan.resources[id.0 as usize];
        assert_eq!(resource.lifetime, Some((0, usize::MAX)), "{name}");
        resource.need.bytes
    };
    let history = bytes("sum") + bytes("sum before") + bytes("count") + bytes("count before");
    assert_eq!(plan.history_bytes(), history);
    let all: u64 = plan.resources.iter().map(|resource| resource.need.bytes).sum();
    assert_eq!((plan.peak_bytes(), plan.technique_bytes()), (all, all), "nothing is shared here");
    let usage = |name: &str| plan.resources[plan.resource(name).expect("declared").0 as usize].image_usage;
    assert_eq!(usage("sum"), usage("sum before"), "the two take turns");
}

/// The plan with each of its barriers on resources with history changed.
fn mutants(plan: &Plan, change: fn(&mut Vec<crate::Barrier>, usize)) -> Vec<(String, Plan)> {
    let mut mutants = Vec::new();
    for (pass, planned) in plan.passes.iter().enumerate() {
        for (number, barrier) in planned.barriers.iter().enumerate() {
            let resource = barrier.resource.map(|id| &plan.resources[id.0 as usize]);
            if resource.is_some_and(|resource| resource.version.is_some()) {
                let mut mutant = plan.clone();
                change(&mut mutant.passes[pass].barriers, number);
                mutants.push((format!("before {}: {barrier:?}", planned.name), mutant));
            }
        }
    }
    mutants
}

/// Without each of the barriers on resources with history some frame would not be ordered after the one before.
#[test]
fn every_barrier_of_history_is_needed() {
    let caught = |plan: &Plan, change: fn(&mut Vec<crate::Barrier>, usize)| {
        let mutants = mutants(plan, change);
        for (what, mutant) in &mutants {
            assert!(Checker::run(mutant).is_err(), "{what}: not missed");
        }
        mutants.len()
    };
    let drop = |barriers: &mut Vec<crate::Barrier>, number: usize| {
        barriers.remove(number);
    };
    assert!(caught(&accumulating(), drop) >= 5, "barriers of an image and a buffer");
    // A frame of buffers alone has no barriers at its end, which would order everything.
    let mut g = Graph::new();
    counting(&mut g);
    let counts = g.plan(&FakeDevice).expect("a valid frame");
    let later = |barriers: &mut Vec<crate::Barrier>, number: usize| {
        barriers[number].src_stages = vk::PipelineStageFlags2::VERTEX_SHADER;
    };
    assert!(caught(&counts, later) >= 3, "barriers of a buffer");
    let mut mutant = accumulating();
    assert!(!mutant.final_barriers.is_empty(), "what was written is read in another layout");
    mutant.final_barriers.clear();
    assert!(Checker::run(&mutant).is_err(), "images are in no defined layout between frames");
}

/// A frame without history has none of it: the same passes, barriers and bytes.
#[test]
fn history_that_nobody_reads_is_not_made() {
    let mut g = Graph::new();
    let sums = g.history_image("sum", BufferRole::Targets, ImageInfo::new(COLOR, 32, 32));
    let _sum = g.clear_image("clear", PassRole::Upkeep, sums.now, [0.0; 4]);
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    assert_eq!((plan.dropped.len(), plan.peak_bytes(), plan.history_bytes()), (1, 0, 0));
    assert!(!plan.has_history());
}

/// Accumulation that shows in nothing is dropped, though each frame reads the one before.
#[test]
fn history_for_itself_alone_is_dropped() {
    let mut g = Graph::new();
    let sums = g.history_image("sum", BufferRole::Targets, ImageInfo::new(COLOR, 32, 32));
    let _sum = through(&mut g, "add", (&sums.before, BindingKind::SampledImage), sums.now);
    let plan = g.plan(&FakeDevice).expect("a valid frame");
    assert_eq!(plan.dropped, ["add"]);
}

#[test]
fn a_write_to_the_frame_before_is_an_error() {
    let mut g = Graph::new();
    let sums = g.history_image("sum", BufferRole::Targets, ImageInfo::new(COLOR, 32, 32));
    let before = g.clear_image("clear", PassRole::Upkeep, sums.before, [0.0; 4]);
    g.keep(&before);
    let error = g.plan(&FakeDevice).err().expect("refused");
    assert!(matches!(&error, GraphError::WritesBefore { pass, .. } if pass == "clear"), "{error}");
}

/// Levels are told apart: that one is written does not make another one's history.
#[test]
fn what_is_never_written_cannot_be_read_a_frame_later() {
    let info = ImageInfo::new(COLOR, 32, 32).mips(2);
    let frame = |read: u32| {
        let mut g = Graph::new();
        let sums = g.history_image("sum", BufferRole::Targets, info);
        let shown = g.image("shown", BufferRole::Targets, ImageInfo::new(COLOR, 32, 32));
        let slots =
            [Slot("from", BindingKind::SampledImage, "r"), Slot("to", BindingKind::StorageImage, "w")];
        let mut pass = g.compute("show", PassRole::Shading, &shader("show", Stage::Compute, &slots));
        pass.read_range("from", &sums.before, Subresource::mip(read));
        let shown = pass.write("to", shown);
        pass.dispatch([1; 3]);
        pass.finish();
        let _sum = g.clear_image_range("clear", PassRole::Upkeep, sums.now, Subresource::mip(0), [0.0; 4]);
        g.keep(&shown);
        g.plan(&FakeDevice)
    };
    let plan = frame(0).expect("level 0 is written");
    Checker::run(&plan).expect("a sound plan");
    let error = frame(1).err().expect("level 1 is not");
    assert!(matches!(&error, GraphError::NeverWritten { pass, .. } if pass == "show"), "{error}");
}

/// Reads of the frame before and writes for the next one among random passes.
fn with_history(steps: &[super::plans::Step], picks: [u8; 3], keep_all: bool) -> Plan {
    let mut g = Graph::new();
    let info = ImageInfo::new(COLOR, 32, 32).layers(2);
    let images = g.history_image("remembered image", BufferRole::Targets, info);
    let buffers = g.history_buffer("remembered buffer", BufferRole::Counters, 700);
    let kind = if picks[0] & 1 == 0 { BindingKind::SampledImage } else { BindingKind::StorageImage };
    let slots = [
        Slot("image", kind, "ra"),
        Slot("buffer", BindingKind::StorageBuffer, "r"),
        Slot("to", BindingKind::StorageBuffer, "w"),
    ];
    let reader = |g: &mut Graph, name: &str| {
        let to = g.buffer(&format!("{name} result"), BufferRole::Counters, 500);
        let mut pass = g.compute(name, PassRole::Shading, &shader(name, Stage::Compute, &slots));
        pass.read("image", &images.before).read("buffer", &buffers.before);
        let to = pass.write("to", to);
        pass.dispatch([1; 3]);
        pass.finish();
        g.keep(&to);
    };
    if picks[0] & 2 != 0 {
        reader(&mut g, "early");
    }
    let mut frame = super::plans::random_frame_in(g, steps, u16::from(picks[1]) << 4, keep_all);
    let g = &mut frame.graph;
    let image = g.clear_image("fill image", PassRole::Upkeep, images.now, [0.0; 4]);
    let buffer = g.clear_buffer("fill buffer", PassRole::Upkeep, buffers.now, 0);
    if picks[0] & 4 != 0 {
        let shown = g.image("shown", BufferRole::Targets, info);
        let shown = g.copy_image("copy", PassRole::Upkeep, &image, shown);
        g.keep(&shown);
    }
    reader(g, "late");
    if picks[0] & 8 != 0 {
        keep(g, &image);
        keep(g, &buffer);
    }
    frame.graph.plan(&FakeDevice).expect("a valid frame")
}

fn keep(g: &mut Graph, handle: &impl Handle) {
    g.keep(handle);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any frames one after another, one of them drawn again: as [`super::plans`] has it of a frame alone.
    #[test]
    fn random_frames_with_history_are_sound(
        steps in prop::collection::vec((any::<u8>(), prop::collection::vec(any::<u8>(), 1..6)), 1..8),
        picks in any::<[u8; 3]>(),
    ) {
        let (plan, all) = (with_history(&steps, picks, false), with_history(&steps, picks, true));
        let results = Checker::run(&plan).map_err(TestCaseError::fail)?;
        let expected = Checker::run(&all).map_err(TestCaseError::fail)?;
        for (key, value) in &results {
            prop_assert_eq!(Some(value), expected.get(key), "{:?} differs from a frame without aliasing", key);
        }
    }
}
