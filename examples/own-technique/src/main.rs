//! A technique from outside the workspace: its own shader over Afterlight's G-buffer stage, run beside the built-in ones.

use afterlight_image::{Rgba8Image, write_png};
use afterlight_renderer::Renderer;
use afterlight_techniques::stages::surfaces::gbuffer;
use afterlight_techniques::{
    Answers, AppendixA, Exactness, Frame, Info, Params, Settings, Technique, TechniqueError,
    cost::{Cost, Workload},
    graph::{
        Graph, ImageHandle, PassRole,
        gpu::{self, vk},
    },
    params::parameters,
    scene,
    shader::Shader,
    tiled::cost::tiled_deferred,
};

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

struct Toon;

parameters! {
    /// Parameters of `toon`.
    struct ToonParams {
        /// steps of brightness
        levels: u32 = 4, "levels", 1..=64;
    }
}

static INFO: Info = Info {
    id: "toon",
    title: "Light in steps",
    summary: "Tiled deferred shading whose radiance is rounded to a few levels.",
    sources: &[],
    answers: Answers { surface: "G-buffer", lights: "tiles", schedule: "compute", resolve: "one sample" },
    appendix_a: AppendixA {
        id: "TD",
        intersect: "exp",
        transparency: "n",
        hardware_msaa: "n",
        light_access: "rand",
        material_access: "seq",
        rates_decoupled: "n, n",
    },
    exactness: Exactness::Approximate { bound: "another image on purpose", min_psnr_db: 0.0 },
    needs: &[],
    samples: &[1],
    views: &[],
    tessellation: false,
    ..Info::USUAL
};

impl Technique for Toon {
    fn info(&self) -> &Info {
        &INFO
    }

    fn shaders(&self) -> &[Shader] {
        &SHADERS
    }

    fn params(&self) -> Params {
        Params::of(ToonParams::default())
    }

    fn predict(&self, workload: &Workload, _: &Params) -> Cost {
        tiled_deferred(workload)
    }

    /// Levels of a sum are no sum.
    fn counts_light_pairs(&self) -> bool {
        false
    }

    fn record(&self, graph: &mut Graph, frame: &Frame<'_>) -> Result<ImageHandle, TechniqueError> {
        let filled = gbuffer::fill(graph, frame, "toon", vk::Format::D32_SFLOAT)?;
        let mut pass =
            frame.compute(graph, "toon/shade", PassRole::Shading, &frame.shader("toon/toon.comp")?);
        gbuffer::bind(&mut pass, &filled);
        pass.constant("LEVELS", frame.params.typed::<ToonParams>().levels);
        let radiance = pass.write("hdr", filled.accumulation);
        pass.dispatch(frame.groups(16));
        pass.finish();
        Ok(radiance)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1).unwrap_or_else(|| "toon.png".into());
    let device = gpu::Device::open(&gpu::DeviceOptions::default())?;
    let scene = scene::load_source("builtin:colonnade?triangles=20000", &scene::LoadOptions::default())?;
    let mut settings = Settings::for_scene(&scene, 320, 180);
    settings.lights = scene::lights::seeded_lights(&scene.bounds_ws(), 100, 1);

    let mut renderer = Renderer::new(&device, &scene, &settings)?;
    renderer.add_shaders(SHADERS.iter().cloned());
    let params = Params::of(ToonParams { levels: 3 });
    let mut frame = renderer.prepare(&Toon, &params)?;
    let report = frame.run()?;
    write_png(file.as_ref(), &Rgba8Image { width: 320, height: 180, pixels: frame.final_rgba8()? })?;
    println!("{} passes, {file}", report.passes.len());
    Ok(())
}
