//! The manual is true: links lead somewhere, commands exist, and the blocks that are marked for it run.

mod commands;
mod links;
mod pages;
mod prose;
mod run;
