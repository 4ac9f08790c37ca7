//! Limits of a frame that no other test holds, each at its edge: `docs/limits.md` lists them.

mod common;

use afterlight_renderer::Renderer;
use afterlight_techniques::{Params, TechniqueError, find, params_of, set_param};
use common::{Stage, covered, image_of};

#[test]
fn an_image_is_as_wide_and_high_as_the_device_takes() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:edge");
    let most = gpu.features().max_image_dimension_2d;
    for size_px in [(most, 1), (1, most)] {
        // An edge that is 64 times as wide as high at most: long images show black as well.
        let image = image_of(&mut stage.prepare(find("tiled").unwrap(), &stage.settings(size_px, 0)));
        assert!(covered(&image) > 0.0, "{size_px:?}: nothing");
    }
    for size_px in [(most + 1, 1), (1, most + 1), (0, 1)] {
        match Renderer::with_scene(&gpu, stage.uploaded.clone(), &stage.settings(size_px, 0)) {
            Err(TechniqueError::TooLarge { limit, .. }) => assert_eq!(limit, u64::from(most)),
            Err(error) => panic!("{size_px:?}: {error}"),
            Ok(_) => panic!("{size_px:?} is no size"),
        }
    }
}

/// Ranges of parameters that shaders have room for.
#[test]
fn parameters_end_where_shaders_have_no_room() {
    for (id, key, last, next) in [
        ("clustered", "slices", "256", "257"),
        ("clustered", "cluster-px", "256", "257"),
        ("clustered", "cluster-px", "8", "7"),
        ("light-list", "light-nodes", "1073741824", "1073741825"),
    ] {
        let technique = find(id).unwrap();
        let mut params: Params = params_of(technique);
        set_param(technique, &mut params, key, last).unwrap_or_else(|e| panic!("{e}"));
        let error = set_param(technique, &mut params, key, next).expect_err("out of range").to_string();
        assert!(error.contains(key) && error.contains(next), "{error}");
    }
}

/// A keys' buffer of the compute rasteriser that one binding cannot reach is refused with its bytes.
#[test]
fn what_one_binding_cannot_reach_is_refused_with_its_bytes() {
    let gpu = afterlight_testkit::gpu();
    let stage = Stage::new(&gpu, "builtin:edge");
    let range = gpu.features().max_storage_buffer_range;
    // A square of eight bytes a pixel, one row more than a binding reaches.
    let width_px = 8192.min(gpu.features().max_image_dimension_2d);
    let height_px = range / 8 / u64::from(width_px) + 1;
    if height_px > u64::from(gpu.features().max_image_dimension_2d) {
        let found = format!("a binding of {range} bytes holds every image");
        return afterlight_testkit::skip(afterlight_testkit::Need::ReachableLimit, &found);
    }
    let settings = stage.settings((width_px, height_px as u32), 0);
    let technique = find("visibility").unwrap();
    let mut params = params_of(technique);
    set_param(technique, &mut params, "visibility", "compute").unwrap_or_else(|e| panic!("{e}"));
    match stage.try_prepare(technique, &settings, &params) {
        Err(error @ TechniqueError::TooLarge { .. }) => {
            let bytes = 8 * u64::from(width_px) * height_px;
            assert!(error.to_string().contains(&format!("found {bytes}")), "{error}");
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("{width_px} by {height_px} pixels of 8 bytes in {range} bytes"),
    }
}
