//! A program with its own window, device and swapchain that draws its own triangle and Afterlight's view beside it.
//!
//! `embed [--frames N] [--technique ID] [--scene FILE] [--view NAME] [--resize-every-frame] [--save FILE.png]`
//!
//! A scene that has an animation plays, 30 frames a second of its time.

mod engine;

use std::{sync::Arc, time::Duration};

use afterlight_image::{Rgba8Image, write_png};
use afterlight_renderer::{Done, Embedded, FrameContext, Renderer, ScenePose};
use afterlight_techniques::{
    Params, Settings, find,
    graph::gpu::{Adopted, CallersCommands, Device, DeviceOptions, Target},
    scene::{self, Camera},
};
use ash::vk;
use engine::{CANVAS_FORMAT, Engine, Error, HALF, IN_FLIGHT, extensions};
use winit::{
    application::ApplicationHandler,
    dpi::PhysicalSize,
    event::WindowEvent,
    event_loop::{ActiveEventLoop, EventLoop},
    platform::pump_events::EventLoopExtPumpEvents,
    window::{Window, WindowId},
};

/// What the command line asks for.
struct Options {
    frames: u64,
    technique: String,
    scene: String,
    view: String,
    resize_every_frame: bool,
    save: Option<String>,
}

impl Options {
    fn parse() -> Result<Options, Error> {
        let mut options = Options {
            frames: u64::MAX,
            technique: "visibility".to_owned(),
            scene: "builtin:spheres".to_owned(),
            view: "final".to_owned(),
            resize_every_frame: false,
            save: None,
        };
        let mut args = std::env::args().skip(1);
        while let Some(arg) = args.next() {
            let mut value = || args.next().ok_or(format!("{arg} lacks its value"));
            match arg.as_str() {
                "--frames" => options.frames = value()?.parse()?,
                "--technique" => options.technique = value()?,
                "--scene" => options.scene = value()?,
                "--view" => options.view = value()?,
                "--save" => options.save = Some(value()?),
                "--resize-every-frame" => options.resize_every_frame = true,
                _ => {
                    return Err(format!(
                        "found {arg}, expected --frames, --technique, --scene, --view, --save or --resize-every-frame"
                    )
                    .into());
                }
            }
        }
        Ok(options)
    }
}

/// The window, and whether somebody closed it.
#[derive(Default)]
struct App {
    window: Option<Window>,
    error: Option<Error>,
    is_closed: bool,
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let size = PhysicalSize::new(2 * HALF[0], HALF[1]);
        match events.create_window(Window::default_attributes().with_title("embed").with_inner_size(size)) {
            Ok(window) => self.window = Some(window),
            Err(error) => self.error = Some(error.into()),
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        self.is_closed |= matches!(event, WindowEvent::CloseRequested);
    }
}

fn main() -> Result<(), Error> {
    let options = Options::parse()?;
    let mut events = EventLoop::new()?;
    let mut app = App::default();
    events.pump_app_events(Some(Duration::ZERO), &mut app);
    if let Some(error) = app.error.take() {
        return Err(error);
    }
    // Dropped in the opposite order: what Afterlight made goes before the device, the device before the window.
    let mut engine = Engine::new(app.window.as_ref().ok_or("no window")?)?;
    let device = adopt(&mut engine)?;
    let scene = scene::load_source(&options.scene, &scene::LoadOptions::default())?;
    let settings = Settings { view: options.view.clone(), ..Settings::for_scene(&scene, HALF[0], HALF[1]) };
    let renderer = Renderer::new(&device, &scene, &settings)?;
    let technique = find(&options.technique).ok_or(format!("no technique {}", options.technique))?;
    let mut view =
        renderer.embed(technique, &Params::default(), &settings.camera, !scene.animations.is_empty())?;

    let shown = Shown { scene: &scene, camera: &settings.camera };
    let drawn = draw(&options, &mut events, &mut app, &mut engine, &mut view, &shown);
    // Also after an error, since the view holds what the device may still use.
    // SAFETY: one thread alone uses the device.
    unsafe { engine.device.device_wait_idle() }?;
    view.done(u64::MAX, &mut |_: &Done<'_>| Ok(()))?;
    let shown = drawn?;
    println!("{shown} frames shown");
    if let Some(file) = &options.save {
        let pixels = engine.read_canvas()?;
        write_png(file.as_ref(), &Rgba8Image { width: 2 * HALF[0], height: HALF[1], pixels })?;
    }
    Ok(())
}

/// Lets Afterlight use the engine's device.
fn adopt(engine: &mut Engine) -> Result<Device, Error> {
    let extensions = extensions(&engine.needs);
    let adopted = Adopted {
        instance: engine.instance.clone(),
        has_debug_utils: false,
        physical: engine.physical,
        device: engine.device.clone(),
        queue_family: engine.needs.queue_family(),
        queue: engine.queue,
        extensions: &extensions,
        features: &engine.needs.features(),
    };
    // SAFETY: the device was opened with these extensions and features; it lives longer than all that `main` makes of it, and one thread
    // alone uses it.
    Ok(unsafe { Device::adopt(&adopted, &DeviceOptions::default()) }?)
}

/// What the frames show.
struct Shown<'a> {
    scene: &'a scene::Scene,
    camera: &'a Camera,
}

impl Shown<'_> {
    fn frame(&self, index: u64) -> FrameContext {
        let time_s = index as f64 / 30.0;
        let pose = (!self.scene.animations.is_empty())
            .then(|| Arc::new(ScenePose::of(self.scene, &self.scene.pose_at(time_s), false)));
        FrameContext { index, time_s, cut: false, camera: self.camera.clone(), pose }
    }
}

/// Draws frames until there are enough, and returns how many were shown.
fn draw(
    options: &Options,
    events: &mut EventLoop<()>,
    app: &mut App,
    engine: &mut Engine,
    view: &mut Embedded,
    of: &Shown<'_>,
) -> Result<u64, Error> {
    let mut shown = 0;
    for round in 0..options.frames {
        events.pump_app_events(Some(Duration::ZERO), app);
        if app.is_closed {
            break;
        }
        let window = app.window.as_ref().ok_or("no window")?;
        if options.resize_every_frame {
            let grown = 16 * (round % 20) as u32;
            let _ = window.request_inner_size(PhysicalSize::new(HALF[0] + grown, HALF[1] - grown / 2));
        }
        let Some((commands, image)) = engine.begin(window, shown)? else {
            // Minimised, or about to be made anew.
            std::thread::sleep(Duration::from_millis(5));
            continue;
        };
        if shown >= IN_FLIGHT {
            view.done(shown - IN_FLIGHT, &mut |_: &Done<'_>| Ok(()))?;
        }
        engine.draw_triangle(commands);
        let layouts = [vk::ImageLayout::GENERAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL];
        // SAFETY: the commands are recording and are submitted below, in their order; `done` is called once their fence has been waited for.
        // The canvas has room for the view on its right.
        let (commands_of_view, target) = unsafe {
            let target = Target::new(engine.canvas, CANVAS_FORMAT, [HALF[0], 0], layouts);
            (CallersCommands::new(commands), target)
        };
        view.frame(of.frame(shown), &commands_of_view, &target)?;
        engine.end(commands, image, shown)?;
        shown += 1;
    }
    Ok(shown)
}
