//! Work that a frame does once, whatever the technique: the view of a light, its shadows, the light that its surfaces reflect, the
//! choice of draws. And a sort, which any stage may use.

pub mod cull;
pub mod deform;
pub mod indirect;
pub mod light_view;
pub mod shadow;
pub mod sort;
