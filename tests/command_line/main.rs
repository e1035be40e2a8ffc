//! Tests of the program `camlux`.

#![cfg(feature = "cli")]

#[path = "../common/calibrations.rs"]
mod calibrations;
#[path = "../common/rows.rs"]
mod rows;

mod batch;
mod batch_resume;
mod compare;
mod compare_layers;
mod devices;
mod doctor;
mod exr_attributes;
mod flow;
mod interrupted;
mod jobs;
mod lens;
mod light_images;
mod motion;
mod pairs;
mod plain;
mod program;
mod reference;
mod render;
mod report;
mod rig;
mod time_of_flight;
mod trajectories;
mod usage;
