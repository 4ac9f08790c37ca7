//! Renders a scene with one technique into a PNG: `cargo run --release --example render_image -- SCENE TECHNIQUE FILE`.

use afterlight_image::{Rgba8Image, write_png};
use afterlight_renderer::Renderer;
use afterlight_techniques::{Params, Settings, find, graph::gpu, scene};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let source = args.next().unwrap_or_else(|| "builtin:colonnade".into());
    let technique = args.next().unwrap_or_else(|| "visibility".into());
    let file = args.next().unwrap_or_else(|| "image.png".into());

    let device = gpu::Device::open(&gpu::DeviceOptions::default())?;
    let scene = scene::load_source(&source, &scene::LoadOptions::default())?;
    let mut settings = Settings::for_scene(&scene, 640, 360);
    settings.lights = scene::lights::seeded_lights(&scene.bounds_ws(), 100, 1);

    let renderer = Renderer::new(&device, &scene, &settings)?;
    let technique = find(&technique).ok_or("no such technique")?;
    let mut frame = renderer.prepare(technique, &Params::default())?;
    for pass in frame.run()?.passes {
        println!("{:>24} {:8.3} ms", pass.name, pass.time_ns.unwrap_or(0.0) / 1e6);
    }
    let image = Rgba8Image { width: 640, height: 360, pixels: frame.final_rgba8()? };
    write_png(file.as_ref(), &image)?;
    Ok(())
}
