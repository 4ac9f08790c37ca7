//! Reads from SPIR-V what a shader declares.
