//! Where surfaces and lights of a scene are at one time: what a program moves.

use afterlight_scene::{Aabb, InstanceHandle, Light, LightHandle, Pose, Scene, ShapePose};
use glam::Affine3A;

/// Where surfaces and lights of a scene are at one time.
#[derive(Clone, Debug)]
pub struct ScenePose {
    /// World from object of each instance of the scene.
    pub world_from_objects: Vec<Affine3A>,
    /// The lights, as many and of the same kinds as the renderer's; `None` is those.
    pub lights: Option<Vec<Light>>,
    /// Shapes of skinned and morphed meshes; `None` is those that were uploaded.
    pub shapes: Option<PosedBounds>,
}

/// Shapes of skinned and morphed meshes at one time.
#[derive(Clone, Debug)]
pub struct PosedBounds {
    /// Joints and weights, as many as the scene has.
    pub pose: ShapePose,
    /// A box of each deformed instance ([`Scene::deformed_bounds_os`]).
    pub bounds_os: Vec<(u32, Aabb)>,
}

impl ScenePose {
    /// A pose of the scene as it was loaded; its lights where `lights_move`.
    pub fn of(scene: &Scene, pose: &Pose, lights_move: bool) -> Self {
        let shapes = (!scene.deformations.is_empty()).then(|| {
            let pose =
                ShapePose { object_from_bind: pose.object_from_bind.clone(), weights: pose.weights.clone() };
            PosedBounds { bounds_os: scene.deformed_bounds_os(&pose), pose }
        });
        Self {
            world_from_objects: pose.world_from_object.clone(),
            lights: lights_move.then(|| pose.lights.clone()),
            shapes,
        }
    }

    /// A scene as it was made or loaded, to be changed by handles.
    pub fn at_rest(scene: &Scene) -> Self {
        let world_from_objects = scene.instances.iter().map(|instance| instance.world_from_object).collect();
        Self { world_from_objects, lights: Some(scene.lights.clone()), shapes: None }
    }

    /// World from object of an instance; `None` where the scene has no such instance.
    pub fn instance(&mut self, instance: InstanceHandle) -> Option<&mut Affine3A> {
        self.world_from_objects.get_mut(instance.index())
    }

    /// A light, whose kind must stay; `None` where the pose has no such light.
    pub fn light(&mut self, light: LightHandle) -> Option<&mut Light> {
        self.lights.as_mut()?.get_mut(light.index())
    }
}
