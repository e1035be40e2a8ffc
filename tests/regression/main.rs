//! What was wrong once.

#[path = "../common/mod.rs"]
mod common;

mod finite;
mod shared_shadow_map;
