//! What threads of a frame share without a device's help, in every order of their steps: the memoization cache, lists of a pixel,
//! claims, marks.

#[path = "../common/mod.rs"]
mod common;

mod cache;
mod explorer;
mod lists;
