//! Tests of bugs that have been fixed.

#[path = "../common/mod.rs"]
mod common;

mod finite;
mod shared_shadow_map;
