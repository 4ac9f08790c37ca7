//! What a technique is given to record a frame.

use afterlight_graph::{
    BufferHandle, BufferRole, Graph, ImageHandle, ImageInfo, PassRole,
    gpu::{self, vk},
};
use afterlight_shader::Shader;

use crate::{
    Board, Params, Slots, TechniqueError, ViewInputs,
    capacity::Capacities,
    scene::{BUCKETS, SceneGpu, lights::SceneLights},
    set_constants, views,
};

/// A frame to be recorded: the scene on the device, its buffers imported into the graph, sizes and parameters.
pub struct Frame<'a> {
    /// Image width, pixels.
    pub width_px: u32,
    /// Image height, pixels.
    pub height_px: u32,
    /// Visibility samples a pixel.
    pub samples: u32,
    /// Parameters, all of [`crate::params_of`] the technique.
    pub params: &'a Params,
    /// The scene.
    pub scene: &'a SceneGpu,
    /// The lights.
    pub lights: &'a SceneLights,
    /// What to show: [`crate::views::FINAL`] or one of the technique's views.
    pub view: &'a str,
    /// Length on screen of the edges that surfaces are tessellated to, pixels; `None` is no tessellation.
    pub tessellate_px: Option<f32>,
    /// How far displacement moves a tessellated surface along each axis at most, m.
    pub displacement_m: f32,
    /// World to clip. Who uses it while recording says so ([`Frame::holds_for_this_view`]).
    pub clip_from_world: glam::Mat4,
    /// How much less view distances are in this frame than from the camera, m: the eye of an orthographic camera that is far from the
    /// scene is moved towards it ([`CameraView::fitted`](crate::CameraView::fitted)).
    pub eye_moved_m: f32,
    /// Radiance of pixels without a surface.
    pub background_radiance: [f32; 3],
    /// Buffers of the scene and the frame as the graph knows them.
    pub buffers: SceneBuffers,
    /// Compiled shaders by which [`Self::shader`] finds names; of equal names the first counts.
    pub shaders: &'a [&'a [Shader]],
    /// The device that the frame will run on.
    pub device: &'a gpu::Device,
    /// Capacities that earlier frames of the same view asked for.
    pub capacities: &'a Capacities,
    /// What is written anew for each view.
    pub inputs: &'a ViewInputs,
    /// Whether the frame will be run from other views too: what some view needs is recorded, be it empty in this one.
    pub moves: bool,
    /// Whether surfaces and lights may move then: what depends on where they are is an input or a script.
    pub scene_moves: bool,
    /// What the parts of the frame hand on.
    pub board: Board,
}

/// Buffers of the scene and the frame as the graph knows them.
pub struct SceneBuffers {
    /// `FrameBlock`: constants of the view.
    pub frame: BufferHandle,
    /// A `DrawData` a draw, as a stream of instances.
    pub draws: BufferHandle,
    /// The same, four texels a draw.
    pub draw_data: ImageHandle,
    /// A `DrawBounds` a draw, two texels.
    pub draw_bounds: ImageHandle,
    /// Materials, eight texels each.
    pub materials: ImageHandle,
    /// Rows of texture transforms.
    pub uv_transforms: BufferHandle,
    /// Lights, four texels each.
    pub lights: ImageHandle,
    /// Spheres around what lights reach, a texel each.
    pub light_spheres: ImageHandle,
    /// Positions of vertices, object space.
    pub positions: BufferHandle,
    /// Other attributes of vertices.
    pub attributes: BufferHandle,
    /// Indices of triangles.
    pub indices: BufferHandle,
    /// Indirect commands of the draws in view, a range a bucket.
    pub commands: BufferHandle,
    /// Number of commands of each bucket.
    pub command_counts: BufferHandle,
    /// Vertices of the icosphere that light volumes are drawn by.
    pub volume: BufferHandle,
    /// Its indices.
    pub volume_indices: BufferHandle,
}

/// Indirect commands of draws, a range a bucket.
pub struct DrawCommands {
    /// The commands.
    pub commands: BufferHandle,
    /// Number of commands of each bucket.
    pub counts: BufferHandle,
    /// First command of each bucket, and the end.
    pub first: [u32; BUCKETS + 1],
}

impl Frame<'_> {
    /// A shader of the program by name, `folder/file.stage#tag`.
    ///
    /// # Errors
    /// [`TechniqueError::UnknownShader`].
    pub fn shader(&self, name: &str) -> Result<Shader, TechniqueError> {
        find_shader(self.shaders, name)
    }

    /// Describes an image as large as the frame, one sample.
    pub fn image_info(&self, format: vk::Format) -> ImageInfo {
        ImageInfo::new(format, self.width_px, self.height_px)
    }

    /// Describes an image as large as the frame, the frame's samples a pixel.
    pub fn multisampled_info(&self, format: vk::Format) -> ImageInfo {
        self.image_info(format).samples(self.samples)
    }

    /// Whether a debug view is to be shown.
    pub fn shows(&self, view: &str) -> bool {
        self.view == view
    }

    /// Brings a small table that a technique made on the CPU into the graph, as a storage buffer that indirect calls
    /// may read too.
    ///
    /// # Errors
    /// The device.
    pub fn table(
        &self,
        graph: &mut Graph,
        name: &str,
        role: BufferRole,
        words: &[u32],
    ) -> Result<BufferHandle, TechniqueError> {
        let words = if words.is_empty() { &[0] } else { words };
        let buffer = self.device.create_buffer(&gpu::BufferDesc {
            name,
            bytes: size_of_val(words) as u64,
            usage: vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::INDIRECT_BUFFER,
            memory: gpu::MemoryKind::Upload,
        })?;
        buffer.write(0, bytemuck::cast_slice(words))?;
        Ok(graph.import_buffer(name, role, &buffer))
    }

    /// The device's format for depth with stencil. Depth is a float, however many bytes that takes: 24 fixed bits of reversed
    /// depth are 0.6 m apart at 1 km from a near plane of 0.1 m. Where the device has nothing else, warnings say so
    /// ([`coarse_depth_warning`](crate::camera_view::coarse_depth_warning)).
    pub fn depth_stencil_format(&self) -> vk::Format {
        self.device.depth_stencil_format()
    }

    /// Checks that one binding holds a buffer.
    ///
    /// # Errors
    /// [`TechniqueError::TooLarge`], which names `what`, the bytes and the device's limit.
    pub fn check_binding(&self, technique: &str, what: &str, bytes: u64) -> Result<(), TechniqueError> {
        check_range(technique, what, bytes, self.features().max_storage_buffer_range)
    }

    /// Whether the device is a CPU.
    pub fn is_cpu(&self) -> bool {
        self.device.info().kind == "cpu"
    }

    /// What the device can do.
    pub fn features(&self) -> &gpu::Features {
        self.device.features()
    }

    /// Binds what every pass over the scene may read, by the names of `include/*.glsl`: frame constants, draws, materials,
    /// lights, what indirect light is gathered from, the shadow map, vertices, textures. Slots that no shader of the pass has stay unused.
    pub fn bind_scene(&self, pass: &mut impl Slots) {
        let b = &self.buffers;
        pass.read_buffer("FrameBlock", &b.frame);
        pass.read_image("draw_data", &b.draw_data);
        pass.read_image("material_data", &b.materials);
        pass.read_buffer("UvTransforms", &b.uv_transforms);
        pass.read_image("light_data", &b.lights);
        pass.read_image("light_spheres", &b.light_spheres);
        pass.read_buffer("Positions", &b.positions);
        pass.read_buffer("Attributes", &b.attributes);
        pass.read_buffer("Indices", &b.indices);
        for input in self.board.inputs() {
            input.bind(self, pass);
        }
        pass.textures(&self.scene.texture_set);
    }

    /// The scene's specialization constants that the shaders have.
    pub fn constants(&self, shaders: &[&Shader]) -> Vec<(String, u32)> {
        self.scene
            .constants
            .iter()
            .copied()
            .chain([
                ("ONLY_POINT_LIGHTS", u32::from(self.lights.only_points)),
                ("LIGHT_PAIRS", views::light_pairs_constant(self.view)),
            ])
            .chain(self.board.inputs().iter().flat_map(|input| input.constants()))
            .filter(|(name, _)| shaders.iter().any(|s| s.reflection.spec_constant(name).is_some()))
            .map(|(name, bits)| (name.to_owned(), bits))
            .collect()
    }

    /// Declares a compute pass over the scene: buffers, textures and constants bound.
    pub fn compute<'g>(
        &self,
        graph: &'g mut Graph,
        name: &str,
        role: PassRole,
        shader: &Shader,
    ) -> afterlight_graph::ComputePass<'g> {
        let mut pass = graph.compute(name, role, shader);
        self.bind_scene(&mut pass);
        set_constants(&mut pass, self.constants(&[shader]));
        pass
    }

    /// Radiance of pixels without a surface as a clear value.
    pub fn background(&self) -> [f32; 4] {
        let [r, g, b] = self.background_radiance;
        [r, g, b, 1.0]
    }

    /// Groups for `count` pieces of work, in as few rows as the device's limit on groups along an axis allows. A group's piece is
    /// `gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x`; the last row may have a few groups too many.
    pub fn groups_in_rows(&self, count: u32) -> [u32; 3] {
        in_rows(count, self.features().max_workgroup_count[0])
    }

    /// Groups of `size`×`size` threads that cover the image.
    pub fn groups(&self, size: u32) -> [u32; 3] {
        [self.width_px.div_ceil(size), self.height_px.div_ceil(size), 1]
    }
}

/// A shader by name among lists of them; of equal names the first counts.
///
/// # Errors
/// [`TechniqueError::UnknownShader`].
pub fn find_shader(shaders: &[&[Shader]], name: &str) -> Result<Shader, TechniqueError> {
    let mut all = shaders.iter().copied().flatten();
    all.find(|shader| shader.name == *name)
        .cloned()
        .ok_or_else(|| TechniqueError::UnknownShader { name: name.to_owned() })
}

/// Checks that one binding of a device that reaches `limit` bytes holds a buffer.
///
/// # Errors
/// [`TechniqueError::TooLarge`], which names `what`, the bytes and the limit.
pub fn check_range(technique: &str, what: &str, bytes: u64, limit: u64) -> Result<(), TechniqueError> {
    if bytes > limit {
        let what = format!("{technique}: bytes of {what}");
        return Err(TechniqueError::TooLarge { what, found: bytes, limit });
    }
    Ok(())
}

/// `count` groups in rows of one length of at most `most` groups.
pub fn in_rows(count: u32, most: u32) -> [u32; 3] {
    let rows = count.div_ceil(most).max(1);
    [count.div_ceil(rows), rows, 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_binding_holds_as_many_bytes_as_the_device_reaches() {
        let limit = 1 << 27;
        assert!(check_range("t", "a list", limit, limit).is_ok());
        let error = check_range("t", "a list", limit + 1, limit).expect_err("one byte more").to_string();
        assert_eq!(error, "t: bytes of a list: found 134217729, expected at most 134217728");
    }

    #[test]
    fn rows_hold_every_group_and_are_no_longer_than_the_limit() {
        const MOST: u32 = 65_535;
        assert_eq!(in_rows(0, MOST), [0, 1, 1]);
        assert_eq!(in_rows(1, MOST), [1, 1, 1]);
        assert_eq!(in_rows(MOST, MOST), [MOST, 1, 1], "what fits is one row");
        assert_eq!(in_rows(MOST + 1, MOST), [32_768, 2, 1]);
        for count in [MOST + 1, 2 * MOST, 2 * MOST + 1, 16 << 20, u32::MAX] {
            let [across, rows, _] = in_rows(count, MOST);
            let groups = u64::from(across) * u64::from(rows);
            assert!(across <= MOST && groups >= u64::from(count), "{count}: {across} by {rows}");
            assert!(groups - u64::from(count) < u64::from(rows), "{count}: {across} by {rows} is too many");
        }
    }
}
