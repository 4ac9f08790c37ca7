//! Packed indices of the four nearest lights: exact where no more meet, the nearest four elsewhere.

mod common;

use afterlight_image::Rgba8Image;
use afterlight_oracle::raster::{RayScene, pixel_ray};
use afterlight_techniques::{
    Exactness, Params, Settings, find, params_of,
    scene::{Light, LightKind},
    shader::Shader,
};
use common::{Stage, compiled_variant, image_of, params, psnr};
use glam::{DVec3, Vec3};

/// The techniques with the shader that visits the lights.
const TECHNIQUES: [(&str, &str); 2] = [
    ("light-indexed", "light_indexed/shade.comp"),
    ("light-indexed-forward", "light_indexed_forward/forward.frag"),
];
/// Least PSNR of what must be one image, dB.
const MIN_PSNR_DB: f64 = 50.0;
const SIZE: [u32; 2] = [160, 90];

fn rendered(stage: &Stage, id: &str, settings: &Settings, shader: Option<Shader>) -> Rgba8Image {
    let technique = find(id).expect("there");
    image_of(&mut stage.prepare_shaders(technique, settings, &Params::default(), shader))
}

/// A shader that visits the lights, with parts of `lights/indices/indices.glsl` replaced.
fn visits(shader: &str, replaced: &[(&str, &str)]) -> Shader {
    compiled_variant(shader, "lights/indices/indices.glsl", replaced)
}

/// Places that the pixels show.
fn surfaces(stage: &Stage, settings: &Settings) -> Vec<DVec3> {
    let rays = RayScene::new(&stage.scene);
    let [width, height] = SIZE;
    (0..width * height)
        .filter_map(|i| rays.first_hit(&pixel_ray(&settings.camera, [i % width, i / width], SIZE)))
        .map(|hit| rays.attributes(&hit).position_ws)
        .collect()
}

/// Lights with an end that reach each place; ranges are a little larger, so that rounding adds none.
fn reaching(places: &[DVec3], lights: &[Light]) -> Vec<u32> {
    let reaches = |light: &&Light, p: DVec3| {
        light.range_m.is_finite()
            && light.position_ws.as_dvec3().distance(p) <= f64::from(light.range_m) * 1.01
    };
    places.iter().map(|p| lights.iter().filter(|light| reaches(light, *p)).count() as u32).collect()
}

/// Of some lights those that leave every place with at most four, the earlier first.
fn at_most_four(places: &[DVec3], lights: &[Light]) -> Vec<Light> {
    let mut counts = vec![0; places.len()];
    let mut kept = Vec::new();
    for light in lights {
        let more: Vec<u32> =
            reaching(places, &[*light]).iter().zip(&counts).map(|(one, before)| one + before).collect();
        if more.iter().all(|count| *count <= 4) {
            (counts, _) = (more, kept.push(*light));
        }
    }
    kept
}

fn directional(settings: &Settings) -> Light {
    Light {
        kind: LightKind::Directional,
        direction_ws: Vec3::new(0.3, -0.8, -0.5).normalize(),
        intensity: Vec3::splat(0.3),
        range_m: f32::INFINITY,
        ..settings.lights[0]
    }
}

/// Where no more than four lights meet in a pixel nothing is lost, lights without an end beside them.
#[test]
fn exact_where_no_more_than_four_lights_meet() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    let mut settings = stage.settings((SIZE[0], SIZE[1]), 300);
    let places = surfaces(&stage, &settings);
    for light in &mut settings.lights {
        light.range_m *= 1.5;
    }
    settings.lights = at_most_four(&places, &settings.lights);
    let counts = reaching(&places, &settings.lights);
    let four = counts.iter().filter(|count| **count == 4).count();
    println!("{} lights, {four} of {} places with four", settings.lights.len(), places.len());
    assert!(four * 20 > places.len(), "{four} places have four lights: the test shows little");
    settings.lights.push(directional(&settings));
    let reference = stage.image(find("forward").unwrap(), &settings);
    for (id, shader) in TECHNIQUES {
        let image = rendered(&stage, id, &settings, None);
        let db = psnr(&reference, &image);
        println!("{id}: {db:.2} dB");
        assert!(db >= MIN_PSNR_DB, "{id}: {db:.2} dB to forward");
        if id == "light-indexed-forward" {
            let depth_prepass = stage.image(find("depth-prepass").unwrap(), &settings);
            assert_eq!(psnr(&depth_prepass, &image), f64::INFINITY, "{id}: not the pre-pass's image");
        }
        // Three of four; the fourth of four.
        for mutant in
            ["ascending(nearest_lights(ivec2(pixel)).xyzz)", "uvec4(nearest_lights(ivec2(pixel)).w)"]
        {
            let mutant = visits(shader, &[("ascending(nearest_lights(ivec2(pixel)))", mutant)]);
            let db = psnr(&reference, &rendered(&stage, id, &settings, Some(mutant)));
            assert!(db < 45.0, "{id}: a mutant within the bound: {db:.2} dB");
        }
    }
}

/// The nearest four of all lights that reach a place, found by a loop over all of them.
const NEAREST_OF_ALL: &str = "
uvec4 nearest_of_all(vec3 position_ws) {
    vec4 distances = vec4(1e30);
    uvec4 lights = uvec4(0u);
    for (uint i = frame.unbounded_light_count; i < frame.light_count; ++i) {
        vec3 center = light_texel(i, 0u).xyz;
        float range = light_texel(i, 2u).w;
        float own_distance = dot(frame.distance_from_world.xyz, center);
        uint own = i - frame.unbounded_light_count + 1u;
        if (dot(center - position_ws, center - position_ws) <= range * range) {
            for (int k = 0; k < 4; ++k) {
                if (own_distance < distances[k]) {
                    float farther = distances[k];
                    uint other = lights[k];
                    distances[k] = own_distance;
                    lights[k] = own;
                    own_distance = farther;
                    own = other;
                }
            }
        }
    }
    return lights;
}
vec3 indexed_radiance(";

/// What every pixel keeps is the four nearest, whatever drew over it: the image is that of a shader that looks for them itself.
#[test]
fn the_nearest_four_are_kept() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    for count in [60, 1000] {
        let mut settings = stage.settings((SIZE[0], SIZE[1]), count);
        // The eye inside of a volume.
        let eye = settings.camera.eye_ws();
        settings.lights.push(Light { position_ws: eye, range_m: 4.0, ..settings.lights[0] });
        settings.lights.push(directional(&settings));
        let counts = reaching(&surfaces(&stage, &settings), &settings.lights);
        let more = counts.iter().filter(|count| **count > 4).count();
        println!("{count} lights: {more} of {} places with more than four", counts.len());
        assert!(more * 2 > counts.len(), "{more} places have more than four lights");
        for (id, shader) in TECHNIQUES {
            let image = rendered(&stage, id, &settings, None);
            let twin = |order: &str| {
                let function = NEAREST_OF_ALL.replace("own_distance < distances", order);
                let replaced = [
                    ("vec3 indexed_radiance(", function.as_str()),
                    ("nearest_lights(ivec2(pixel))", "nearest_of_all(p.position_ws)"),
                ];
                psnr(&rendered(&stage, id, &settings, Some(visits(shader, &replaced))), &image)
            };
            let db = twin("own_distance < distances");
            println!("{count} lights: {id}: {db:.2} dB to the nearest four");
            assert!(db >= MIN_PSNR_DB, "{count} lights: {id}: {db:.2} dB to the nearest four");
            let farthest = twin("distances[k] == 1e30 || own_distance > distances");
            assert!(farthest < 40.0, "{id}: the farthest four do as well: {farthest:.2} dB");
        }
    }
}

/// Every width of an index that has room gives one image; one without room is refused.
#[test]
fn widths_of_an_index_agree_or_are_refused() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:intersect");
    for (id, _) in TECHNIQUES {
        let technique = find(id).unwrap();
        let with = |parts: &str, lights: u32| {
            let params = params(technique, &[("index-parts", parts)]);
            let prepared = stage.try_prepare(technique, &stage.settings((96, 54), lights), &params);
            prepared.map(|mut prepared| image_of(&mut prepared))
        };
        let image = with("auto", 80).expect("room");
        for parts in ["4", "8", "12"] {
            let other = with(parts, 80).expect("room");
            assert_eq!(image.pixels, other.pixels, "{id}: {parts} parts");
        }
        let error = with("4", 81).expect_err("no room for 81 lights").to_string();
        assert!(error.contains("found 81, expected at most 80"), "{error}");
        assert!(params_refused(technique), "{id}: a width that there is not");
    }
}

fn params_refused(technique: &dyn afterlight_techniques::Technique) -> bool {
    params_of(technique).set("index-parts", "5").is_err()
}

/// The bound that the techniques state: what is lost at 1, 100 and 10,000 lights of which about eight meet.
#[test]
fn what_is_lost_is_within_the_stated_bound() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:colonnade?triangles=30000");
    for count in [1, 100, 10_000] {
        let settings = stage.settings((96, 54), count);
        let reference = stage.image(find("forward").unwrap(), &settings);
        for (id, _) in TECHNIQUES {
            let technique = find(id).unwrap();
            let Exactness::Approximate { min_psnr_db, .. } = technique.info().exactness else {
                panic!("{id} states no bound")
            };
            let db = psnr(&reference, &stage.image(technique, &settings));
            println!("{count} lights: {id}: {db:.2} dB");
            assert!(db >= min_psnr_db, "{count} lights: {id}: {db:.2} dB to forward");
            assert!(count > 1 || db >= MIN_PSNR_DB, "one light: {id}: {db:.2} dB to forward");
        }
    }
}
