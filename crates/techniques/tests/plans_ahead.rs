//! Plans that are made on another thread while frames go on. The thread waits at a gate that a test opens, so that what happens before,
//! during and after a plan does not depend on how fast anything is.

mod common;

use std::{
    sync::{
        Condvar, Mutex,
        atomic::{AtomicU32, Ordering},
    },
    time::Duration,
};

use afterlight_image::Rgba8Image;
use afterlight_renderer::{Ahead, Done, Event, Flight, FlightOptions, FrameContext, Renderer, Shortfall};
use afterlight_techniques::{
    Frame, Info, Params, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    find,
    graph::{Graph, ImageHandle},
    scene::Camera,
    shader::Shader,
};
use common::{Stage, image_of, params, psnr};
use glam::{Quat, Vec3};

const SIZE: (u32, u32) = (97, 55);
const SCENE: &str = "builtin:colonnade?triangles=20000&texture=64";
const LIGHTS: u32 = 20;
/// Techniques that visit lights in no defined order agree with themselves to this, dB.
const UNORDERED_DB: f64 = 100.0;
/// Who waits so long for a gate was kept waiting for good.
const PATIENCE: Duration = Duration::from_secs(60);

/// Holds up threads that plan until it is opened.
#[derive(Default)]
struct Gate {
    is_closed: Mutex<bool>,
    opened: Condvar,
    /// Plans that went through on another thread.
    passed: AtomicU32,
    /// Plans that gave up waiting: somebody who should have opened the gate waited for them.
    given_up: AtomicU32,
}

impl Gate {
    fn set(&self, is_closed: bool) {
        *self.is_closed.lock().expect("no panic") = is_closed;
        self.opened.notify_all();
    }

    fn pass(&self) {
        let is_closed = self.is_closed.lock().expect("no panic");
        let waited = self.opened.wait_timeout_while(is_closed, PATIENCE, |is_closed| *is_closed);
        self.passed.fetch_add(1, Ordering::SeqCst);
        if waited.expect("no panic").1.timed_out() {
            self.given_up.fetch_add(1, Ordering::SeqCst);
        }
    }
}

/// A technique whose plans on other threads than a test's wait at a gate.
struct Gated {
    inner: &'static dyn Technique,
    gate: Gate,
}

impl Gated {
    fn new(id: &str) -> &'static Gated {
        let inner = find(id).unwrap_or_else(|| panic!("{id}: unknown"));
        Box::leak(Box::new(Gated { inner, gate: Gate::default() }))
    }
}

impl Technique for Gated {
    fn info(&self) -> &Info {
        self.inner.info()
    }

    fn shaders(&self) -> &[Shader] {
        self.inner.shaders()
    }

    fn params(&self) -> Params {
        self.inner.params()
    }

    fn predict(&self, workload: &Workload, params: &Params) -> Cost {
        self.inner.predict(workload, params)
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        // A test's own thread plans at once.
        if std::thread::current().name() == Some("afterlight plan") {
            self.gate.pass();
        }
        self.inner.record(graph, frame)
    }
}

fn open() -> (afterlight_testkit::GpuTest, Stage) {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, SCENE);
    (gpu, stage)
}

/// What was handed on.
#[derive(Default)]
struct Seen {
    pictures: Vec<Rgba8Image>,
    events: Vec<Vec<Event>>,
    fell_short: Vec<bool>,
}

impl Seen {
    fn see(&mut self, frame: &Done<'_>, size: (u32, u32)) {
        assert_eq!(frame.index, self.pictures.len() as u64, "frames come in their order");
        let pixels = frame.rgba8.expect("asked for").to_vec();
        self.pictures.push(Rgba8Image { width: size.0, height: size.1, pixels });
        self.events.push(frame.events.to_vec());
        self.fell_short.push(frame.fell_short);
    }

    /// Frames with an event.
    fn with(&self, event: &Event) -> Vec<usize> {
        let has = |(i, events): (usize, &Vec<Event>)| events.contains(event).then_some(i);
        self.events.iter().enumerate().filter_map(has).collect()
    }
}

/// A flight with what it has shown.
struct Flown {
    flight: Flight,
    seen: Seen,
    sent: Vec<Camera>,
}

impl Flown {
    fn new(flight: Flight) -> Self {
        Self { flight, seen: Seen::default(), sent: Vec::new() }
    }

    fn frame(&mut self, camera: &Camera) {
        let context = FrameContext {
            index: self.sent.len() as u64,
            time_s: 0.0,
            cut: false,
            camera: camera.clone(),
            pose: None,
        };
        self.sent.push(camera.clone());
        let seen = &mut self.seen;
        let mut done = |frame: &Done<'_>| {
            seen.see(frame, SIZE);
            Ok(())
        };
        self.flight.frame(context, &mut done).unwrap_or_else(|e| panic!("{e}"));
    }

    fn land(&mut self) {
        let seen = &mut self.seen;
        let mut done = |frame: &Done<'_>| {
            seen.see(frame, SIZE);
            Ok(())
        };
        self.flight.land(&mut done).unwrap_or_else(|e| panic!("{e}"));
    }

    fn poll(&mut self) {
        let seen = &mut self.seen;
        let mut done = |frame: &Done<'_>| {
            seen.see(frame, SIZE);
            Ok(())
        };
        self.flight.poll(&mut done).unwrap_or_else(|e| panic!("{e}"));
    }

    /// Frames that did not fall short and are not the picture of their view, with dB.
    fn unlike(
        &self,
        stage: &Stage,
        technique: &dyn Technique,
        params: &Params,
        samples: u32,
    ) -> Vec<(usize, f64)> {
        let mut known: Vec<(Camera, Rgba8Image)> = Vec::new();
        let mut unlike = Vec::new();
        for (i, camera) in self.sent.iter().enumerate().take(self.seen.pictures.len()) {
            if self.seen.fell_short[i] {
                continue;
            }
            if !known.iter().any(|(one, _)| one == camera) {
                let settings = Settings { samples, ..stage.from(camera.clone(), SIZE, LIGHTS) };
                let alone = image_of(&mut stage.prepare_with(technique, &settings, params));
                known.push((camera.clone(), alone));
            }
            let alone = known.iter().find(|(one, _)| one == camera).map(|(_, alone)| alone);
            let db = alone.map_or(0.0, |alone| psnr(&self.seen.pictures[i], alone));
            if db < UNORDERED_DB {
                unlike.push((i, db));
            }
        }
        unlike
    }
}

fn renderer(stage: &Stage, camera: &Camera, samples: u32) -> Renderer {
    let settings = Settings { samples, ..stage.from(camera.clone(), SIZE, LIGHTS) };
    Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings).unwrap_or_else(|e| panic!("{e}"))
}

fn options() -> FlightOptions {
    FlightOptions { pictures: true, ..FlightOptions::default() }
}

/// The scene's first camera.
fn near(stage: &Stage) -> Camera {
    stage.scene.cameras.first().expect("a camera").clone()
}

/// A view of nothing: lists need nothing.
fn nothing(stage: &Stage) -> Camera {
    let bounds = stage.scene.bounds_ws();
    let away = bounds.max + bounds.size();
    Camera::look_at("away", away, away + Vec3::ONE, 1.0, 0.1)
}

/// The scene's first camera, turned by an angle about the vertical.
fn turned(stage: &Stage, angle_rad: f32) -> Camera {
    let near = near(stage);
    let (eye, forward) = (near.eye_ws(), -Vec3::from(near.world_from_view.matrix3.z_axis));
    Camera::look_at("turned", eye, eye + Quat::from_rotation_y(angle_rad) * forward, 1.0, 0.1)
}

/// A view of the whole scene from ever nearer.
fn approaching(stage: &Stage, step: u32) -> Camera {
    let bounds = stage.scene.bounds_ws();
    let distance_m = 4.0 * 0.985f32.powi(step as i32) * bounds.size().max_element();
    let eye = bounds.center() + distance_m * Vec3::new(0.3, 0.5, 0.8);
    Camera::look_at("approaching", eye, bounds.center(), 1.0, 0.1)
}

/// Techniques whose lists grow, with parameters and samples.
fn growing() -> [(&'static Gated, Params, u32); 4] {
    let of = |id: &str, sets: &[(&str, &str)], samples| {
        let gated = Gated::new(id);
        (gated, params(gated, sets), samples)
    };
    [
        of("gbuffer-list", &[], 4),
        of("dais", &[("fill", "cache")], 4),
        of("clustered", &[], 1),
        of("light-list", &[], 1),
    ]
}

/// A view whose frame fell short: while its plan is made, further frames are sent and nobody waits but for as many as may be on their way;
/// then frames are handed on in order, each the picture of its view.
#[test]
fn a_frame_that_fell_short_is_drawn_again_with_the_plan_of_another_thread() {
    let (_gpu, stage) = open();
    let nothing = nothing(&stage);
    for (technique, params, samples) in growing() {
        let id = technique.info().id;
        let renderer = renderer(&stage, &nothing, samples);
        let flight =
            renderer.fly(technique, &params, &nothing, options()).unwrap_or_else(|e| panic!("{id}: {e}"));
        let mut flown = Flown::new(flight);
        technique.gate.set(true);
        flown.frame(&nothing);
        flown.frame(&near(&stage));
        while !flown.flight.is_planning() && flown.seen.pictures.len() < 2 {
            flown.poll();
        }
        // Two more may be on their way.
        flown.frame(&turned(&stage, 0.4));
        flown.frame(&turned(&stage, 0.8));
        flown.poll();
        assert_eq!(flown.seen.pictures.len(), 1, "{id}: the frame that fell short waits for its plan");
        assert_eq!(technique.gate.passed.load(Ordering::SeqCst), 0, "{id}: nobody has waited for the plan");
        technique.gate.set(false);
        flown.frame(&turned(&stage, 0.0));
        flown.frame(&near(&stage));
        flown.land();
        assert_eq!(
            technique.gate.given_up.load(Ordering::SeqCst),
            0,
            "{id}: a frame waited at a closed gate"
        );
        let unlike = flown.unlike(&stage, technique, &params, samples);
        assert!(unlike.is_empty(), "{id}: frames and dB {unlike:?}");
        assert!(!flown.seen.fell_short.contains(&true), "{id}: {:?}", flown.seen.fell_short);
        let events = &flown.seen.events;
        assert!(events[0].is_empty(), "{id}: {events:?}");
        let order = |event: &Event| events[1].iter().position(|one| one == event);
        let [begun, taken, again] =
            [Event::PlanBegun, Event::PlanTaken, Event::DrawnAgain].map(|one| order(&one));
        assert!(begun.is_some() && begun < taken && taken < again, "{id}: {events:?}");
    }
}

/// A list that is nearly full: its frames go on, whole, for as long as the larger plan takes, and then with that plan.
#[test]
fn frames_go_on_while_a_list_that_is_nearly_full_gets_room() {
    let (_gpu, stage) = open();
    for (technique, params, samples) in growing() {
        let id = technique.info().id;
        let first = approaching(&stage, 0);
        let renderer = renderer(&stage, &first, samples);
        let flight =
            renderer.fly(technique, &params, &first, options()).unwrap_or_else(|e| panic!("{id}: {e}"));
        let mut flown = Flown::new(flight);
        // Until a frame says that a list is nearly full, and none fell short.
        let mut scarce = None;
        for step in 0..200 {
            let camera = approaching(&stage, step);
            technique.gate.set(true);
            flown.frame(&camera);
            // Waits for the device; a frame that fell short would wait for its plan as well, and give up at the gate.
            while flown.seen.pictures.len() < flown.sent.len() && !flown.flight.is_planning() {
                flown.poll();
            }
            let last = flown.seen.events.last().expect("a frame");
            if flown.seen.pictures.len() == flown.sent.len() && last.contains(&Event::PlanBegun) {
                scarce = Some((step, camera));
                break;
            }
            technique.gate.set(false);
            flown.land();
            flown.flight.wait_for_plan().unwrap_or_else(|e| panic!("{id}: {e}"));
        }
        println!("{id}: nearly full at step {:?}", scarce.as_ref().map(|(step, _)| *step));
        let Some((_, camera)) = scarce else {
            panic!("{id}: no list was nearly full before it fell short");
        };
        let begun = flown.sent.len() - 1;
        for _ in 0..12 {
            flown.frame(&camera);
        }
        flown.land();
        assert!(flown.flight.is_planning(), "{id}: the gate is closed");
        let new = flown.seen.events[begun + 1..].concat();
        assert!(!new.contains(&Event::PlanTaken) && !new.contains(&Event::DrawnAgain), "{id}: {new:?}");
        technique.gate.set(false);
        flown.flight.wait_for_plan().unwrap_or_else(|e| panic!("{id}: {e}"));
        let taken = flown.sent.len();
        for _ in 0..4 {
            flown.frame(&camera);
        }
        flown.land();
        assert_eq!(flown.seen.with(&Event::PlanTaken).last(), Some(&taken), "{id}");
        assert!(flown.seen.events[taken + 1..].concat().is_empty(), "{id}: {:?}", flown.seen.events);
        assert_eq!(
            technique.gate.given_up.load(Ordering::SeqCst),
            0,
            "{id}: a frame waited at a closed gate"
        );
        let unlike = flown.unlike(&stage, technique, &params, samples);
        assert!(unlike.is_empty(), "{id}: frames and dB {unlike:?}");
    }
}

/// Frames that need yet more while a plan is made: the plan is overtaken, and another one follows without a frame that asks for it.
#[test]
fn a_plan_that_is_overtaken_is_followed_by_another() {
    let (_gpu, stage) = open();
    let (nothing, near) = (nothing(&stage), near(&stage));
    let far = approaching(&stage, 50);
    // What its only list needs shows whatever room it has.
    let technique = Gated::new("dais");
    let params = params(technique, &[("fill", "cache"), ("lights", "all")]);
    let renderer = renderer(&stage, &nothing, 4);
    let tell = FlightOptions { shortfall: Shortfall::Tell, ..options() };
    let flight = renderer.fly(technique, &params, &nothing, tell).unwrap_or_else(|e| panic!("{e}"));
    let mut flown = Flown::new(flight);
    technique.gate.set(true);
    for camera in [&nothing, &far, &near, &near, &nothing] {
        flown.frame(camera);
        flown.land();
    }
    assert_eq!(flown.seen.fell_short, [false, true, true, true, false], "frames go on and tell");
    assert_eq!(flown.seen.with(&Event::PlanBegun), [1]);
    technique.gate.set(false);
    flown.flight.wait_for_plan().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(technique.gate.passed.load(Ordering::SeqCst), 2, "what the frame after it needed is more");
    flown.frame(&near);
    flown.land();
    assert_eq!(flown.seen.fell_short.last(), Some(&false));
    assert_eq!(flown.seen.with(&Event::PlanTaken), [5]);
    let unlike = flown.unlike(&stage, technique, &params, 4);
    assert!(unlike.is_empty(), "frames and dB {unlike:?}");
}

/// Another technique with another size and more samples is prepared while frames go on, and is what it is when it was prepared at once.
#[test]
fn a_flight_is_prepared_while_another_one_goes_on() {
    const OTHER_SIZE: (u32, u32) = (64, 36);
    let (gpu, stage) = open();
    let near = near(&stage);
    let renderer = renderer(&stage, &near, 1);
    let first = find("visibility").expect("known");
    let flight = renderer.fly(first, &Params::default(), &near, options()).unwrap_or_else(|e| panic!("{e}"));
    let mut flown = Flown::new(flight);
    let technique = Gated::new("dais");
    let settings = Settings { samples: 4, ..stage.from(near.clone(), OTHER_SIZE, LIGHTS) };
    let ahead = |gate: bool| -> Ahead<Flight> {
        technique.gate.set(gate);
        let ahead = renderer.fly_ahead(technique, &Params::default(), settings.clone(), options());
        ahead.unwrap_or_else(|e| panic!("{e}"))
    };
    flown.frame(&near);
    flown.land();
    let held_bytes = gpu.held_bytes();
    let other = ahead(true);
    for _ in 0..12 {
        flown.frame(&near);
    }
    flown.land();
    assert!(!other.is_ready(), "the gate is closed");
    technique.gate.set(false);
    let mut other = other.take().unwrap_or_else(|e| panic!("{e}"));
    let mut pictures = Vec::new();
    let context = FrameContext { index: 0, time_s: 0.0, cut: false, camera: near.clone(), pose: None };
    let mut done = |frame: &Done<'_>| {
        let pixels = frame.rgba8.expect("asked for").to_vec();
        pictures.push(Rgba8Image { width: OTHER_SIZE.0, height: OTHER_SIZE.1, pixels });
        Ok(())
    };
    other.frame(context, &mut done).and_then(|()| other.land(&mut done)).unwrap_or_else(|e| panic!("{e}"));
    let alone = image_of(&mut stage.prepare(technique, &settings));
    assert!(psnr(&pictures[0], &alone) >= UNORDERED_DB);
    let unlike = flown.unlike(&stage, first, &Params::default(), 1);
    assert!(unlike.is_empty(), "frames and dB {unlike:?}");
    assert_eq!(technique.gate.given_up.load(Ordering::SeqCst), 0);
    drop(other);
    // Dropped while it is being prepared: nothing of it is left afterwards.
    drop(ahead(false));
    drop(ahead(false));
    let after = gpu.held_bytes();
    drop(ahead(false));
    assert_eq!(gpu.held_bytes(), after, "{held_bytes} before the first");
    // What cannot be prepared is told when it is taken.
    let settings = Settings { samples: 3, ..settings.clone() };
    let refused = renderer.fly_ahead(technique, &Params::default(), settings, options());
    let refused = refused.unwrap_or_else(|e| panic!("{e}")).take();
    assert!(refused.err().expect("no three samples").to_string().contains("samples for dais"));
}
