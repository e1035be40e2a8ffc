//! Files damaged at random, and files made to hurt. A program of its own: its allocator counts what the whole process takes.

#[path = "../common/mod.rs"]
mod common;

mod damaged;
mod hostile;
mod judge;
mod mutate;
mod scene_text;
