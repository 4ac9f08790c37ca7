//! The board of a frame: what one part leaves for the parts after it, found by its type.
//!
//! A technique that has drawn the depth of the frame's opaque surfaces puts it up as [`OpaqueDepth`]; the pass for surfaces with alpha
//! blending takes it from there, or draws its own where nobody has left one. Shadows and indirect light put themselves up as
//! [`SceneInput`]s, so that every pass over the scene binds what they made, and no pass has to know them.

use std::{
    any::{Any, TypeId},
    cell::RefCell,
    collections::HashMap,
    rc::Rc,
};

use afterlight_graph::ImageHandle;

use crate::{Frame, Slots};

/// Depth of the frame's opaque surfaces, reversed: of the same draws by the same vertex path, with or without stencil. It may be of another
/// size or another number of samples than the frame: whoever takes it checks.
pub struct OpaqueDepth(pub ImageHandle);

/// The triangle that shows at every sample, `draw << 10 | triangle`, as the technique stores it.
pub struct TriangleIds(pub ImageHandle);

/// Octahedral shading normals in world space, of the nearest surface of every pixel.
pub struct SurfaceNormals(pub ImageHandle);

/// How far the surface at the centre of each pixel has moved on screen since the frame before, pixels, RG16F: x to the right, y down. The place
/// where it was is the pixel's centre minus that. Zero where no surface is, and where the frame before is of no use.
pub struct Velocity(pub ImageHandle);

/// Says that every surface of this frame visits every light, whatever structures there may be: set by the reference, whose image must not
/// depend on them.
pub struct VisitsAllLights;

/// Something that shaders of every pass over the scene read: a shadow map, a reflective shadow map.
pub trait SceneInput {
    /// Binds what its GLSL header declares. A slot that no shader of the pass has stays unused.
    fn bind(&self, frame: &Frame<'_>, pass: &mut dyn Slots);

    /// Specialization constants of its GLSL header, by name; a shader that lacks one is not given it.
    fn constants(&self) -> Vec<(&'static str, u32)>;
}

/// What the parts of a frame hand on.
#[derive(Default)]
pub struct Board {
    items: RefCell<HashMap<TypeId, Box<dyn Any>>>,
    inputs: RefCell<Vec<Rc<dyn SceneInput>>>,
}

impl Board {
    /// Puts an item up; one of the same type that was there before is replaced.
    pub fn put<T: 'static>(&self, item: T) {
        self.items.borrow_mut().insert(TypeId::of::<T>(), Box::new(item));
    }

    /// Takes an item off the board.
    pub fn take<T: 'static>(&self) -> Option<T> {
        let item = self.items.borrow_mut().remove(&TypeId::of::<T>())?;
        item.downcast().ok().map(|item| *item)
    }

    /// Whether there is an item of a type.
    pub fn has<T: 'static>(&self) -> bool {
        self.items.borrow().contains_key(&TypeId::of::<T>())
    }

    /// Gives every later pass over the scene something more to read.
    pub fn add_input(&self, input: impl SceneInput + 'static) {
        self.inputs.borrow_mut().push(Rc::new(input));
    }

    /// What passes over the scene read besides the scene, in the order in which it was put up.
    pub fn inputs(&self) -> Vec<Rc<dyn SceneInput>> {
        self.inputs.borrow().clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_found_by_type_and_taken_once() {
        #[derive(Debug, PartialEq)]
        struct Normals(u32);
        let board = Board::default();
        assert_eq!(board.take::<Normals>(), None);
        board.put(Normals(1));
        board.put(Normals(2));
        board.put(3_u32);
        assert!(board.has::<Normals>());
        assert_eq!((board.take::<Normals>(), board.take::<Normals>()), (Some(Normals(2)), None));
        assert_eq!(board.take::<u32>(), Some(3));
    }
}
