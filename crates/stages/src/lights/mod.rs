//! How surfaces find their lights.

pub mod bvh;
pub mod cells;
pub mod indices;
pub mod pixel_lists;
pub mod step;
pub mod volumes;
