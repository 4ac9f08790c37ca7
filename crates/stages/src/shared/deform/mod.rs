//! The stage that writes the vertices of skinned and morphed meshes in the pose of each frame, before anything reads them.

use afterlight_frame::{
    ChangesWith, SceneGpu, TechniqueError, ViewInputs, check_range, find_shader, in_rows, put,
    scene::deformed::{DeformedGpu, PosedShapes},
};
use afterlight_graph::{
    BufferHandle, BufferRole, Graph, PassRole,
    gpu::{self, vk},
};
use afterlight_shader::Shader;

/// What the pass is declared from: the frame's buffers are not there yet, since it makes two of them.
pub struct Given<'a> {
    /// The device that the frame will run on.
    pub device: &'a gpu::Device,
    /// What is written anew for each pose.
    pub inputs: &'a ViewInputs,
    /// The scene.
    pub scene: &'a SceneGpu,
    /// Compiled shaders.
    pub shaders: &'a [&'a [Shader]],
}

/// Declares the pass `shared/deform` where the scene has skins or morph targets, and gives the positions and attributes of its vertices as they
/// are after it. It writes them in their place, in every frame that is run: frames of one scene run one after another.
///
/// # Errors
/// Shapes that one binding does not reach: [`TechniqueError::TooLarge`]. A shader that is not compiled in, the device.
pub fn record(
    graph: &mut Graph,
    given: &Given<'_>,
    positions: BufferHandle,
    attributes: BufferHandle,
) -> Result<(BufferHandle, BufferHandle), TechniqueError> {
    let Some(deformed) = &given.scene.deformed else { return Ok((positions, attributes)) };
    let (joints, weights) = pose_inputs(graph, given, deformed)?;
    let scene = |graph: &mut Graph, name, buffer| graph.import_buffer(name, BufferRole::Scene, buffer);
    let read = [
        ("DeformGroups", scene(graph, "scene deform groups", &deformed.groups)),
        ("Deformations", scene(graph, "scene deformations", &deformed.deformations)),
        ("Shapes", scene(graph, "scene shapes", &deformed.shapes)),
        ("Influences", scene(graph, "scene influences", &deformed.influences)),
        ("Targets", scene(graph, "scene morph targets", &deformed.targets)),
        ("Differences", scene(graph, "scene differences", &deformed.differences)),
        ("Joints", joints),
        ("Weights", weights),
    ];
    // Numbers of vertices and differences are of 32 bits: what one binding reaches is less.
    for (slot, buffer) in &read {
        check_range("shared/deform", slot, buffer.bytes(), given.device.features().max_storage_buffer_range)?;
    }
    let shader = find_shader(given.shaders, "shared/deform/deform.comp")?;
    let mut pass = graph.compute("shared/deform", PassRole::Shared, &shader);
    pass.push(&[deformed.group_count]);
    for (slot, buffer) in &read {
        pass.read(slot, buffer);
    }
    // Vertices of other meshes stay.
    let positions = pass.write("Positions", positions);
    let attributes = pass.write("Attributes", attributes);
    pass.dispatch(in_rows(deformed.group_count, given.device.features().max_workgroup_count[0]));
    pass.finish();
    Ok((positions, attributes))
}

/// Joints and weights of the pose.
fn pose_inputs(
    graph: &mut Graph,
    given: &Given<'_>,
    deformed: &DeformedGpu,
) -> Result<(BufferHandle, BufferHandle), TechniqueError> {
    let mut input = |name: &str, bytes: u64, fill: fn(&PosedShapes, &mut [u8])| {
        let how = (bytes.max(4), vk::BufferUsageFlags::STORAGE_BUFFER, ChangesWith::Pose);
        given.inputs.declare(given.device, graph, (name, BufferRole::Scene), how, move |view, bytes| {
            fill(&view.placed.shapes, bytes);
        })
    };
    let joints = input("joint matrices", 48 * u64::from(deformed.joint_count), |shapes, bytes| {
        put(bytes, 0, &shapes.joints);
    })?;
    let weights = input("morph weights", 4 * u64::from(deformed.weight_count), |shapes, bytes| {
        put(bytes, 0, &shapes.weights);
    })?;
    Ok((joints, weights))
}
