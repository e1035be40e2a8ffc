//! Tests of the program `camlux`.

#![cfg(feature = "cli")]

#[path = "../common/calibrations.rs"]
mod calibrations;

mod batch;
mod batch_resume;
mod compare;
mod doctor;
mod exr_attributes;
mod jobs;
mod lens;
mod motion;
mod pairs;
mod plain;
mod reference;
mod render;
mod report;
mod time_of_flight;
mod usage;
