//! A technique that keeps something for the next frame, in flights: what each frame finds, and what it is told of that.

mod common;

use std::path::Path;

use afterlight_frame::{BEFORE_HISTORY, BEFORE_VIEW};
use afterlight_renderer::{Done, Event, FlightOptions, FrameContext, Renderer, Shortfall};
use afterlight_techniques::{
    Frame, Info, Params, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    find,
    graph::{BufferRole, Graph, ImageHandle, ImageInfo, PassRole, gpu::vk},
    scene::Camera,
    shader::Shader,
};
use common::{Stage, compiled};
use glam::Vec3;

const SIZE: (u32, u32) = (97, 55);
const ALL: u32 = BEFORE_VIEW | BEFORE_HISTORY;

/// A technique whose lists may run short, beside which a pass remembers; the view `seen` shows what it found.
struct Remembers(&'static dyn Technique);

static INFO: Info = Info { id: "remembers", views: &["seen"], ..Info::USUAL };

impl Technique for Remembers {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        self.0.shaders()
    }

    fn params(&self) -> Params {
        self.0.params()
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        self.0.predict(workload, params)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let _radiance = self.0.record(graph, frame)?;
        let left = graph.history_image(
            "test/left",
            BufferRole::Counters,
            ImageInfo::new(vk::Format::R32_UINT, 1, 1),
        );
        let info = frame.image_info(vk::Format::R16G16B16A16_SFLOAT);
        let hdr = graph.image("test/seen", BufferRole::Targets, info);
        let shader = frame.shader("test/remember.comp")?;
        let mut pass = frame.compute(graph, "test/remember", PassRole::Upkeep, &shader);
        pass.read("left_before", &left.before);
        let _left = pass.write("left_now", left.now);
        let hdr = pass.write("hdr", hdr);
        pass.dispatch(frame.groups(8));
        pass.finish();
        Ok(hdr)
    }
}

/// What a frame saw.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    /// What the frame before left: its number and one.
    left: u32,
    before: u32,
    index: u32,
    time_s: f32,
}

impl Seen {
    fn of(rgba8: &[u8]) -> Self {
        let bit = |row: usize, column: usize| u32::from(rgba8[4 * (row * SIZE.0 as usize + column)] > 127);
        let word = |row: usize| (0..32).fold(0, |word, column| word | bit(row, column) << column);
        Self { left: word(0), before: word(1), index: word(2), time_s: f32::from_bits(word(3)) }
    }
}

/// Flies with frames of these views and cuts; what each saw, and what happened in it.
fn flown(
    stage: &Stage,
    settings: &Settings,
    (in_flight, inner): (u32, &str),
    frames: &[(&Camera, bool)],
) -> Vec<(Seen, Vec<Event>)> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let shader = compiled("test/remember.comp", &tests.join("remember.comp.glsl"), &[], &[]);
    let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), settings);
    let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    renderer.add_shaders([shader]);
    let technique: &'static Remembers = Box::leak(Box::new(Remembers(find(inner).expect("known"))));
    let shortfall = Shortfall::DrawAgain;
    let options = FlightOptions { in_flight, shortfall, pictures: true, ..FlightOptions::default() };
    let mut flight = renderer
        .fly(technique, &Params::default(), frames[0].0, options)
        .unwrap_or_else(|e| panic!("{inner}: {e}"));
    let mut seen = Vec::new();
    let mut done = |frame: &Done<'_>| -> Result<(), TechniqueError> {
        seen.push((Seen::of(frame.rgba8.expect("asked for")), frame.events.to_vec()));
        Ok(())
    };
    for (index, (camera, cut)) in (0..).zip(frames) {
        let context = FrameContext {
            index,
            time_s: 0.25 * index as f64,
            cut: *cut,
            camera: (*camera).clone(),
            pose: None,
        };
        flight.frame(context, &mut done).unwrap_or_else(|e| panic!("{inner}: {e}"));
    }
    flight.land(&mut done).unwrap_or_else(|e| panic!("{inner}: {e}"));
    seen
}

/// A stage, settings, and two views: one that shows nothing, one in which lists need much.
fn stage(gpu: &afterlight_techniques::graph::gpu::Device) -> (Stage, Settings, Camera, Camera) {
    let stage = Stage::new(gpu, "builtin:colonnade?triangles=20000");
    let bounds = stage.scene.bounds_ws();
    let away = bounds.max + bounds.size();
    let nothing = Camera::look_at("away", away, away + Vec3::ONE, 1.0, 0.1);
    let near = stage.scene.cameras.first().expect("a camera").clone();
    let mut settings = stage.from(nothing.clone(), SIZE, 20);
    settings.view = "seen".to_owned();
    (stage, settings, nothing, near)
}

#[test]
fn frames_find_what_the_one_before_left() {
    let gpu = afterlight_testkit::gpu();
    let (stage, settings, _, near) = stage(&gpu);
    let frames = [false, false, false, true, false].map(|cut| (&near, cut));
    let expected = [(0, 0), (1, ALL), (2, ALL), (3, 0), (4, ALL)];
    // The second records its commands again for each frame.
    for inner in ["forward", "hybrid"] {
        let seen = flown(&stage, &settings, (3, inner), &frames);
        for (k, ((seen, _), (left, before))) in (0..).zip(seen.iter().zip(expected)) {
            let expected = Seen { left, before, index: k, time_s: 0.25 * k as f32 };
            assert_eq!(*seen, expected, "{inner}, frame {k}");
        }
    }
}

/// A frame that is drawn again, by a plan whose lists have room, finds what it found at first.
#[test]
fn a_frame_that_is_drawn_again_keeps_history() {
    let gpu = afterlight_testkit::gpu();
    let (stage, settings, nothing, near) = stage(&gpu);
    let frames = [&nothing, &nothing, &near, &near, &near].map(|camera| (camera, false));
    let seen = flown(&stage, &settings, (1, "light-list"), &frames);
    assert!(seen[2].1.contains(&Event::DrawnAgain), "{seen:?}");
    for (k, (found, _)) in (0..).zip(&seen) {
        let before = if k == 0 { 0 } else { ALL };
        assert_eq!(*found, Seen { left: k, before, index: k, time_s: 0.25 * k as f32 }, "frame {k}");
    }
    // With others on their way behind it, what it left may be overwritten: it is told so, and finds the view before all the same.
    let frames: Vec<_> = (0..10).map(|k| (if k < 2 { &nothing } else { &near }, false)).collect();
    let seen = flown(&stage, &settings, (3, "light-list"), &frames);
    assert!(seen[2].1.contains(&Event::DrawnAgain), "{seen:?}");
    for (k, (found, _)) in (0..).zip(&seen).skip(1) {
        assert_eq!((found.before & BEFORE_VIEW, found.index), (BEFORE_VIEW, k), "frame {k}");
        if found.before & BEFORE_HISTORY != 0 {
            assert_eq!(found.left, k, "frame {k} is told that it finds what the one before left");
        }
    }
    assert_eq!(seen[9].0.before, ALL, "history begins anew");
}

/// A technique that plans each view anew keeps what it remembers, and no more memory with each plan.
#[test]
fn history_outlives_plans_of_views() {
    let gpu = afterlight_testkit::gpu();
    let (stage, settings, ..) = stage(&gpu);
    let bounds = stage.scene.bounds_ws();
    let mut far = stage.scene.cameras.first().expect("a camera").clone();
    // Far enough away that the eye is moved towards the scene.
    far.projection = afterlight_techniques::scene::Projection::Orthographic {
        half_height_m: 5.0,
        near_m: 0.1,
        far_m: 1e5,
    };
    far.world_from_view.translation = (bounds.center() + 1e4 * Vec3::Z).into();
    far.world_from_view.matrix3 = glam::Mat3A::IDENTITY;
    let frames = [(&far, false); 4];
    let seen = flown(&stage, &settings, (3, "gbuffer-list"), &frames);
    assert!(seen[1].1.contains(&Event::Planned), "{seen:?}");
    for (k, (found, _)) in (1..).zip(&seen[1..]) {
        assert_eq!((found.left, found.before), (k, ALL), "frame {k}");
    }
    let held_bytes = gpu.held_bytes();
    let seen = flown(&stage, &settings, (3, "gbuffer-list"), &[(&far, false); 12]);
    assert_eq!(seen[11].0.left, 11);
    assert_eq!(gpu.held_bytes(), held_bytes, "after three times as many plans");
}
