//! The ground truth that an image of the torture set is compared with.

use std::{ops::ControlFlow, path::Path};

use glam::DVec3;
use rayon::prelude::*;

use super::{Subject, openings::BehindOpenings};
use crate::{
    Error, Result, Scene,
    hard_cases::examiner::values,
    metrics::{Comparison, Pixels},
    output::{ExrOptions, Frame, Layer, OutputFile, write_exr},
    reference::{Goal, Reference},
};

/// The true indirect light, and its noise.
pub struct Truth {
    /// W/sr/m², three bands a pixel.
    indirect: Vec<f64>,
    /// Standard error of the sampled part; `None`: nothing was sampled.
    standard_error: Option<Vec<f32>>,
    /// Which pixels show a surface, and which of those are on an edge.
    valid: Vec<bool>,
    edges: Vec<bool>,
}

impl Truth {
    /// Computes light through openings by quadrature. Samples all other light by paths until the noise is below `standard_error`, relative
    /// to that light. Stores sampled images in the folder and reuses them. Edge pixels are those of a device that rounds corners to
    /// `sub_pixel_bits` bits.
    ///
    /// # Errors
    /// Errors of a file that cannot be written, or read.
    pub fn new(
        subject: &Subject,
        standard_error: f64,
        folder: Option<&Path>,
        sub_pixel_bits: u32,
    ) -> Result<Truth> {
        let Subject {
            scene, openings, ..
        } = subject;
        let (behind, inside) = match (&scene.lights[..], &openings[..]) {
            (lights, []) => (None, lights),
            ([lamp, inside @ ..], _) => (Some(lamp), inside),
            ([], _) => (None, &[][..]),
        };
        let frame = if inside.is_empty() {
            let reference = Reference::new(scene, 1)?;
            reference.with_sub_pixel_bits(sub_pixel_bits).frame()
        } else {
            let lit_inside = Scene {
                lights: inside.to_vec(),
                ..scene.clone()
            };
            let reference = sampled(&lit_inside, standard_error, folder)?;
            reference.with_sub_pixel_bits(sub_pixel_bits).frame()
        };
        let valid = frame.mask(Layer::InstanceId);
        let sampled = values(&frame, Layer::Indirect).iter();
        let mut indirect: Vec<f64> = sampled.map(|&value| value.into()).collect();
        if let Some(lamp) = behind.and_then(|light| light.lamp()) {
            let lamp = BehindOpenings {
                openings,
                lamp_m: lamp.position_m,
                power_w: lamp.power_w,
                kd: scene.materials[0].kd,
            };
            let [positions, normals] =
                [Layer::Position, Layer::Normal].map(|layer| values(&frame, layer));
            let places = positions
                .par_chunks_exact(3)
                .zip(normals.par_chunks_exact(3));
            let pixels = indirect.par_chunks_exact_mut(3).zip(places).zip(&valid);
            pixels.for_each(|((pixel, (position, normal)), &is_seen)| {
                if is_seen {
                    let [position, normal] = [position, normal]
                        .map(|xyz| DVec3::from([0, 1, 2].map(|axis| f64::from(xyz[axis]))));
                    let through = lamp.indirect(position, normal);
                    for (value, through) in pixel.iter_mut().zip(through) {
                        *value += through;
                    }
                }
            });
        }
        Ok(Truth {
            indirect,
            standard_error: frame.values(Layer::StandardError).map(<[f32]>::to_vec),
            valid,
            edges: frame.mask(Layer::Edge),
        })
    }

    /// Compares the indirect light of an image of the same camera.
    ///
    /// # Errors
    /// [`Error::Input`] for an image of another size.
    pub fn compare(&self, image: &Frame) -> Result<Comparison> {
        Comparison::new(&Pixels {
            image: values(image, Layer::Indirect),
            reference: &self.indirect,
            image_standard_error: None,
            reference_standard_error: self.standard_error.as_deref(),
            valid: &self.valid,
            edges: Some(&self.edges),
            channels: 3,
        })
    }
}

/// A reference with a noise below `standard_error`: loads it from the folder, or continues sampling there.
fn sampled(scene: &Scene, standard_error: f64, folder: Option<&Path>) -> Result<Reference> {
    let goal = Goal::StandardError(standard_error);
    // The hash that identifies the scene in a reference.
    let hash = Reference::new(scene, 1)?.frame().description.scene_hash;
    let file = folder.map(|folder| folder.join(format!("{}.exr", &hash[..16])));
    let go_on = &mut |_| ControlFlow::Continue(());
    let mut reference = match &file {
        Some(file) if file.exists() => Reference::resume(scene, file)?,
        _ => Reference::start(scene, goal, go_on)?,
    };
    if reference.meets(goal) && reference.rounds() > 0 {
        return Ok(reference);
    }
    while !reference.meets(goal) {
        reference.add_round(go_on)?;
    }
    if let (Some(folder), Some(file)) = (folder, file) {
        std::fs::create_dir_all(folder).map_err(|error| Error::Output {
            path: folder.into(),
            problem: format!("cannot create the folder: {error}"),
            hint: "name a folder that can be written".into(),
        })?;
        let frame = reference.frame();
        write_exr(OutputFile::create(file)?, &frame, &ExrOptions::default())?;
    }
    Ok(reference)
}
