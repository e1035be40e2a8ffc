//! Files that are made from others and checked in are what they would be if they were made now.

mod header;
mod layouts;
mod spirv;
