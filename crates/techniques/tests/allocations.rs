//! A frame in flight allocates nothing: neither memory of the host nor of the device, once its path was flown before.
#![allow(unsafe_code)] // the allocator that counts

mod common;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    backtrace::Backtrace,
    cell::{Cell, RefCell},
    sync::{
        Arc,
        atomic::{AtomicI64, Ordering},
    },
};

use afterlight_renderer::{Done, Flight, FlightOptions, FrameContext, Renderer, ScenePose};
use afterlight_techniques::{
    Params, Settings, TechniqueError, find, registry,
    scene::{Camera, Light},
};
use common::Stage;
use glam::{Affine3A, Quat, Vec3};

const SIZE: (u32, u32) = (48, 32);
const SCENE: &str = "builtin:spheres?rows=2&columns=3&segments=16";
const LIGHTS: u32 = 20;
/// Frames of the path, and those of them in which allocations count.
const FRAMES: u64 = 60;
const COUNTED: std::ops::Range<u64> = 10..FRAMES;

/// Bytes that all threads hold.
static LIVE_BYTES: AtomicI64 = AtomicI64::new(0);

fn live(bytes: usize, sign: i64) {
    LIVE_BYTES.fetch_add(sign * bytes as i64, Ordering::Relaxed);
}

thread_local! {
    static IS_COUNTING: Cell<bool> = const { Cell::new(false) };
    static COUNT: Cell<u64> = const { Cell::new(0) };
    /// Where the first was made.
    static FIRST: RefCell<Option<Backtrace>> = const { RefCell::new(None) };
}

/// The system's allocator, which counts what a thread asks of it while that thread counts.
struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn count() {
    if IS_COUNTING.replace(false) {
        COUNT.set(COUNT.get() + 1);
        FIRST.with_borrow_mut(|first| {
            first.get_or_insert_with(Backtrace::force_capture);
        });
        IS_COUNTING.set(true);
    }
}

// SAFETY: every call is passed on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        live(layout.size(), 1);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        live(layout.size(), 1);
        // SAFETY: the caller keeps the contract of `alloc_zeroed`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count();
        live(new_size, 1);
        live(layout.size(), -1);
        // SAFETY: the caller keeps the contract of `realloc`.
        unsafe { System.realloc(memory, layout, new_size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        live(layout.size(), -1);
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// Allocations of this thread in `work`, and where the first was made.
fn allocations(work: impl FnOnce()) -> (u64, String) {
    COUNT.set(0);
    IS_COUNTING.set(true);
    work();
    IS_COUNTING.set(false);
    let first = FIRST.take().filter(|_| std::env::var_os("AFTERLIGHT_BACKTRACE").is_some());
    (COUNT.get(), first.map_or_else(String::new, |first| ours(&first.to_string())))
}

/// The project's own lines of a backtrace.
fn ours(backtrace: &str) -> String {
    let lines: Vec<&str> = backtrace.lines().filter(|line| line.contains("crates/")).map(str::trim).collect();
    lines.join("\n  ")
}

/// A camera that moves and turns a little in each frame.
fn camera(stage: &Stage, frame: u64) -> Camera {
    let first = stage.scene.cameras.first().expect("a camera");
    let (eye, forward) = (first.eye_ws(), -Vec3::from(first.world_from_view.matrix3.z_axis));
    let t = (frame as f32 / FRAMES as f32 * std::f32::consts::TAU).sin();
    let eye = eye + 0.5 * t * forward;
    Camera::look_at("moves", eye, eye + Quat::from_rotation_y(0.3 * t) * forward, 1.0, 0.1)
}

/// Instances that rise and lights that sway.
fn pose(stage: &Stage, lights: &[Light], frame: u64) -> Arc<ScenePose> {
    let t = (frame as f32 / FRAMES as f32 * std::f32::consts::TAU).sin();
    let rise = Affine3A::from_translation(0.1 * t * Vec3::Y);
    let lights = lights.iter().map(|light| Light { position_ws: light.position_ws + 0.2 * t, ..*light });
    Arc::new(ScenePose {
        world_from_objects: stage.scene.instances.iter().map(|one| rise * one.world_from_object).collect(),
        lights: Some(lights.collect()),
        shapes: None,
    })
}

/// Flies the path once, and returns what the frames that count have allocated in all, with the first place.
fn fly(flight: &mut Flight, contexts: &[FrameContext]) -> (u64, String) {
    let mut worst_ns = 0.0f64;
    let mut done = |frame: &Done<'_>| -> Result<(), TechniqueError> {
        assert!(!frame.fell_short);
        worst_ns = worst_ns.max(frame.times.frame_ns.unwrap_or(0.0));
        Ok(())
    };
    let (before, counted) = contexts.split_at(COUNTED.start as usize);
    let mut send = |contexts: &[FrameContext]| {
        for context in contexts {
            flight.frame(context.clone(), &mut done).unwrap_or_else(|e| panic!("{e}"));
        }
    };
    send(before);
    let allocated = allocations(|| send(counted));
    flight.land(&mut done).unwrap_or_else(|e| panic!("{e}"));
    flight.wait_for_plan().unwrap_or_else(|e| panic!("{e}"));
    allocated
}

/// Techniques that allocate, and how often in a frame of this path at most: they record their commands anew for each view, or (`dais-list`)
/// cull draws for bands of the image.
const ALLOCATE: [(&str, u64); 3] = [("hybrid", 560), ("forward-multipass", 120), ("dais-list", 20)];

fn check(moves: bool) {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, SCENE);
    let settings: Settings = stage.from(camera(&stage, 0), SIZE, LIGHTS);
    let contexts: Vec<FrameContext> = (0..FRAMES)
        .map(|index| FrameContext {
            index,
            time_s: 0.05 * index as f64,
            cut: false,
            camera: camera(&stage, index),
            pose: moves.then(|| pose(&stage, &settings.lights, index)),
        })
        .collect();
    let mut off = Vec::new();
    for technique in registry() {
        let id = technique.info().id;
        let samples = if technique.info().samples.contains(&1) { 1 } else { 4 };
        let settings = Settings { samples, ..settings.clone() };
        let renderer = Renderer::with_scene(&stage.device, stage.uploaded.clone(), &settings);
        let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let options = FlightOptions { scene_moves: moves, ..FlightOptions::default() };
        let flight = renderer.fly(*technique, &Params::default(), &settings.camera, options);
        let mut flight = flight.unwrap_or_else(|e| panic!("{id}: {e}"));
        fly(&mut flight, &contexts);
        let held = (gpu.held_bytes(), gpu.pipeline_count());
        let (allocated, first) = fly(&mut flight, &contexts);
        assert_eq!((gpu.held_bytes(), gpu.pipeline_count()), held, "{id}: memory of the device");
        let per_frame = allocated as f64 / (COUNTED.end - COUNTED.start) as f64;
        println!("{id}: {per_frame:.2} allocations a frame {first}");
        let most = ALLOCATE.iter().find(|(one, _)| *one == id).map_or(0.0, |(_, most)| *most as f64);
        if per_frame > most {
            off.push(format!("{id}: {per_frame:.2} a frame, the first at\n  {first}"));
        }
    }
    assert!(off.is_empty(), "{}", off.join("\n"));
}

#[test]
fn a_frame_of_a_camera_that_moves_allocates_nothing() {
    check(false);
}

#[test]
fn a_frame_of_a_scene_that_moves_allocates_nothing() {
    check(true);
}

/// Flights of other techniques, sizes and samples, each prepared while the one before flies: what they hold of the host and the device goes with
/// them. What stays is what every flight after the first of its kind finds: pools and caches.
#[test]
fn flights_leave_nothing_in_memory() {
    const ROUNDS: usize = 6;
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, SCENE);
    let renderer = Renderer::with_scene(
        &stage.device,
        stage.uploaded.clone(),
        &stage.from(camera(&stage, 0), SIZE, LIGHTS),
    );
    let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    let turns = [("visibility", 1, (48, 32)), ("gbuffer-list", 4, (33, 19)), ("clustered", 1, (64, 36))];
    let turns = turns.into_iter().chain([("forward", 4, (48, 32)), ("dais", 1, (33, 19))]);
    let mut held = Vec::new();
    let mut now: Option<Flight> = None;
    for _ in 0..ROUNDS {
        for (id, samples, size) in turns.clone() {
            let settings = Settings { samples, ..stage.from(camera(&stage, 0), size, LIGHTS) };
            let technique = find(id).expect("known");
            let ahead = renderer.fly_ahead(technique, &Params::default(), settings, FlightOptions::default());
            let ahead = ahead.unwrap_or_else(|e| panic!("{id}: {e}"));
            let mut done = |_: &Done<'_>| Ok(());
            if let Some(flight) = &mut now {
                for index in 0..4 {
                    let context = FrameContext {
                        index,
                        time_s: 0.0,
                        cut: false,
                        camera: camera(&stage, index),
                        pose: None,
                    };
                    flight.frame(context, &mut done).unwrap_or_else(|e| panic!("{e}"));
                }
            }
            // Dropped with frames on their way.
            now = Some(ahead.take().unwrap_or_else(|e| panic!("{id}: {e}")));
        }
        now = None;
        held.push((LIVE_BYTES.load(Ordering::Relaxed), gpu.held_bytes(), gpu.held_objects()));
    }
    println!("bytes of the host, bytes and objects of the device: {held:?}");
    let (first, last) = (held[2], held[ROUNDS - 1]);
    assert_eq!((last.1, last.2), (first.1, first.2), "{held:?}");
    // Threads come and go, and lists of who waits for what keep their memory.
    assert!(last.0 - first.0 < 4 << 10, "{held:?}");
}
