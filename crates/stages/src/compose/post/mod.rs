//! The last stage where anti-aliasing is asked for: filters of the image that is shown, for any technique.
//!
//! [`Post::Fxaa`] and [`Post::Smaa`] see the image alone; [`Post::Sraa`] also rasterises the scene once more, without
//! shading it.

mod areas;

use afterlight_graph::{
    BufferRole, Graph, ImageHandle, Load, PassRole,
    gpu::{self, SamplerDesc, vk},
};

use crate::{compose::present, surfaces::geometry::SceneDraws};
use afterlight_frame::{Frame, Post, TechniqueError, views};

/// Layout in which uploads leave images.
const UPLOADED: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;

/// Declares the tone map and the filter after it; returns the final image, RGBA8, sRGB-encoded.
///
/// Filters decide by the image that is shown and mix radiance: what a pixel shows of an edge is a share of light.
///
/// # Errors
/// A shader that is not compiled in; a device without what the filter needs.
pub fn finish(
    device: &gpu::Device,
    graph: &mut Graph,
    frame: &Frame<'_>,
    hdr: &ImageHandle,
    post: Post,
) -> Result<ImageHandle, TechniqueError> {
    // A debug view is no picture: its colours are values.
    if post == Post::None || !frame.shows(views::FINAL) {
        return present::present(graph, frame, hdr);
    }
    let color = present::display(graph, frame, hdr, "post/color")?;
    let target =
        graph.image("final color", BufferRole::Targets, frame.image_info(vk::Format::R8G8B8A8_UNORM));
    graph.mark_output(&target);
    let shown = Shown { hdr, color: &color };
    match post {
        Post::None | Post::Fxaa => fxaa(graph, frame, &shown, target),
        Post::Smaa => smaa(device, graph, frame, &shown, target),
        Post::Sraa => sraa(device.features(), graph, frame, &shown, target),
    }
}

/// The frame before a filter.
struct Shown<'a> {
    /// Linear radiance.
    hdr: &'a ImageHandle,
    /// What is shown of it.
    color: &'a ImageHandle,
}

fn fxaa(
    graph: &mut Graph,
    frame: &Frame<'_>,
    shown: &Shown<'_>,
    target: ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let mut pass =
        frame.compute(graph, "post/fxaa", PassRole::Filter, &frame.shader("compose/post/fxaa.comp")?);
    pass.read_sampled("color", shown.color, SamplerDesc::LINEAR).read("hdr", shown.hdr);
    let target = pass.write("final_color", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(target)
}

fn smaa(
    device: &gpu::Device,
    graph: &mut Graph,
    frame: &Frame<'_>,
    shown: &Shown<'_>,
    target: ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let (area, search) = smaa_textures(device)?;
    let area = graph.import_image("post/smaa areas", BufferRole::Filters, &area, UPLOADED);
    let search = graph.import_image("post/smaa search", BufferRole::Filters, &search, UPLOADED);
    let edges = graph.image("post/smaa edges", BufferRole::Filters, frame.image_info(vk::Format::R8G8_UNORM));
    let weights =
        graph.image("post/smaa weights", BufferRole::Filters, frame.image_info(vk::Format::R8G8B8A8_UNORM));

    let mut pass = frame.compute(
        graph,
        "post/smaa-edges",
        PassRole::Filter,
        &frame.shader("compose/post/smaa_edges.comp")?,
    );
    pass.read("color", shown.color);
    let edges = pass.write("edges", edges);
    pass.dispatch(frame.groups(8));
    pass.finish();

    let mut pass = frame.compute(
        graph,
        "post/smaa-weights",
        PassRole::Filter,
        &frame.shader("compose/post/smaa_weights.comp")?,
    );
    pass.read_sampled("edges", &edges, SamplerDesc::LINEAR);
    pass.read_sampled("area", &area, SamplerDesc::LINEAR).read("search", &search);
    let weights = pass.write("weights", weights);
    pass.dispatch(frame.groups(8));
    pass.finish();

    let mut pass = frame.compute(
        graph,
        "post/smaa-blend",
        PassRole::Filter,
        &frame.shader("compose/post/smaa_blend.comp")?,
    );
    pass.read("color", shown.color).read("hdr", shown.hdr).read("weights", &weights);
    let target = pass.write("final_color", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(target)
}

/// Makes and uploads the textures of areas and of searches.
fn smaa_textures(device: &gpu::Device) -> Result<(gpu::Image, gpu::Image), TechniqueError> {
    let mut uploader = device.uploader()?;
    let mut upload = |name, format, width: usize, height: usize, texels: &[u8]| {
        let image = device.create_image(&gpu::ImageDesc {
            name,
            format,
            width: width as u32,
            height: height as u32,
            layers: 1,
            mips: 1,
            samples: 1,
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
        })?;
        uploader.image(&image, 0, 0, texels)?;
        Ok::<_, TechniqueError>(image)
    };
    let area = upload(
        "smaa areas",
        vk::Format::R8G8_UNORM,
        areas::AREA_WIDTH,
        areas::AREA_HEIGHT,
        &areas::area_texture(),
    )?;
    let search = upload(
        "smaa search",
        vk::Format::R8_UINT,
        areas::SEARCH_WIDTH,
        areas::SEARCH_HEIGHT,
        &areas::search_texture(),
    )?;
    uploader.finish()?;
    Ok((area, search))
}

fn sraa(
    features: &gpu::Features,
    graph: &mut Graph,
    frame: &Frame<'_>,
    shown: &Shown<'_>,
    target: ImageHandle,
) -> Result<ImageHandle, TechniqueError> {
    let samples = sraa_samples(|samples| features.supports_samples(samples, false))?;
    let (sample_surfaces, sample_depths) = surfaces(graph, frame, "visibility", samples)?;
    let (center_surfaces, center_depths) = surfaces(graph, frame, "centers", 1)?;

    let mut pass =
        frame.compute(graph, "post/sraa", PassRole::Filter, &frame.shader("compose/post/sraa.comp")?);
    pass.constant("SAMPLES", samples).constant("WIDE_MATERIALS", wide_materials(frame));
    pass.read("color", shown.color).read("hdr", shown.hdr);
    pass.read("sample_surfaces", &sample_surfaces).read("sample_depths", &sample_depths);
    pass.read("center_surfaces", &center_surfaces).read("center_depths", &center_depths);
    let target = pass.write("final_color", target);
    pass.dispatch(frame.groups(8));
    pass.finish();
    Ok(target)
}

/// Samples a pixel of SRAA's visibility: four, or what else the device has.
fn sraa_samples(supported: impl Fn(u32) -> bool) -> Result<u32, TechniqueError> {
    [4, 8, 2].into_iter().find(|samples| supported(*samples)).ok_or(TechniqueError::Unavailable {
        technique: "post sraa",
        missing: "images of more than one sample a pixel (found 1, expected 2, 4 or 8)".to_owned(),
    })
}

/// Materials that SRAA tells apart by eight bits.
const NARROW_MATERIALS: u32 = 256;

/// 1 where the scene has more materials than eight bits tell apart.
fn wide_materials(frame: &Frame<'_>) -> u32 {
    u32::from(frame.scene.material_count > NARROW_MATERIALS)
}

/// Rasterises planes and materials of the visible surfaces, and their depths: the pass `post/sraa-…`.
fn surfaces(
    graph: &mut Graph,
    frame: &Frame<'_>,
    what: &str,
    samples: u32,
) -> Result<(ImageHandle, ImageHandle), TechniqueError> {
    let image = |graph: &mut Graph, name: &str, format| {
        graph.image(
            &format!("post/sraa {what} {name}"),
            BufferRole::Filters,
            frame.image_info(format).samples(samples),
        )
    };
    let format = match wide_materials(frame) {
        0 => vk::Format::R8G8B8A8_UNORM,
        _ => vk::Format::R16G16B16A16_UNORM,
    };
    let planes = image(graph, "surfaces", format);
    let depths = image(graph, "depths", vk::Format::D32_SFLOAT);
    let mut surfaces = SceneDraws::shaded(frame, "compose/post/sraa.frag", "compose/post/sraa.frag#mask")?;
    surfaces.constants.push(("WIDE_MATERIALS".to_owned(), wide_materials(frame)));
    let mut pass = graph.raster(&format!("post/sraa-{what}"), PassRole::Filter);
    frame.bind_scene(&mut pass);
    // Depth 0 tells what holds nothing: the planes need no clear.
    let planes = pass.color(planes, Load::DontCare);
    let depths = pass.depth(depths, Load::Clear(0.0));
    surfaces.draw(frame, &mut pass);
    pass.finish();
    Ok((planes, depths))
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_frame::PostEffect;

    #[test]
    fn sraa_takes_the_samples_there_are() {
        assert_eq!(sraa_samples(|_| true).expect("has all"), 4);
        assert_eq!(sraa_samples(|samples| samples != 4).expect("has 8"), 8);
        let error = sraa_samples(|_| false).expect_err("has none").to_string();
        assert!(error.starts_with("post sraa: the device lacks") && error.contains("found 1"), "{error}");
    }

    #[test]
    fn names_are_those_of_records() {
        let names: Vec<&str> = Post::ALL.iter().map(|post| post.name()).collect();
        assert_eq!(names, ["none", "fxaa", "smaa", "sraa"]);
        assert_eq!(PostEffect::default().filter, Post::None);
    }
}
