//! Structs that every technique's shaders share.
