//! The manual is correct: links resolve, commands exist, and the blocks that are marked to run succeed.

mod commands;
mod links;
mod pages;
mod prose;
mod run;
