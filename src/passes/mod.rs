//! The passes of a frame: one file each, named like its shader and its timestamp. `frame` puts them in order.

use std::cell::RefCell;

use bytemuck::Pod;

use crate::{
    Error, LocalSpace, Plan, Result, Scene,
    scene::MAX_FREQUENCIES,
    vulkan::{Buffer, CommandPool, Device, Pipelines, Recorder, Resource, groups_in_rows},
};

use cost::{Cost, Work};
use trace::RayList;

pub(crate) mod area_light;
pub(crate) mod compact;
pub(crate) mod cost;
pub(crate) mod direct;
pub(crate) mod error_estimate;
pub(crate) mod final_gather;
pub(crate) mod gather;
pub(crate) mod gatherer;
pub(crate) mod gbuffer;
pub(crate) mod hits;
pub(crate) mod instances;
pub(crate) mod light;
pub(crate) mod light_rays;
pub(crate) mod materials;
pub(crate) mod modulation;
mod packets;
pub(crate) mod pixel_filter;
pub(crate) mod predict;
pub(crate) mod primary_rays;
pub(crate) mod random;
pub(crate) mod rays;
pub(crate) mod receivers;
pub(crate) mod refinement;
pub(crate) mod resolve;
pub(crate) mod rsm;
pub(crate) mod sample_counts;
pub(crate) mod scatter;
pub(crate) mod sensor;
pub(crate) mod shadow;
pub(crate) mod smooth;
pub(crate) mod stderr;
pub(crate) mod surface;
pub(crate) mod textures;
pub(crate) mod trace;
pub(crate) mod view;
pub(crate) mod vpl;
pub(crate) mod vpl_sampler;

/// What all passes of a frame share.
#[derive(Clone, Copy)]
pub(crate) struct Context<'c> {
    pub device: &'c Device,
    pub pipelines: &'c Pipelines,
    pub commands: &'c CommandPool,
    pub scene: &'c Scene,
    pub plan: &'c Plan,
    pub space: &'c LocalSpace,
    /// The images stay on the device, for a host that uses them there.
    pub stays_on_device: bool,
    /// Another seed gives other samples.
    pub seed: u32,
    /// Only with time of flight.
    pub modulation: Option<&'c Buffer>,
    pub cost: &'c RefCell<Cost>,
    /// The rays in memory; `None` if nothing casts rays.
    pub rays: &'c RefCell<Option<RayList>>,
    /// Passes that are recorded but not yet submitted.
    pub recorded: &'c RefCell<Option<Recorder>>,
}

impl Context<'_> {
    /// Records passes for the next submission. If the command buffer has as many passes as it can time, it is submitted first.
    pub fn record(&self, record: impl FnOnce(&mut Recorder) -> Result<()>) -> Result<()> {
        let is_full = |recorder: &Recorder| !recorder.has_room();
        if self.recorded.borrow().as_ref().is_some_and(is_full) {
            self.finish()?;
        }
        let mut recorded = self.recorded.borrow_mut();
        let recorder = match recorded.take() {
            Some(recorder) => recorder,
            None => self.commands.begin()?,
        };
        record(recorded.insert(recorder))
    }

    /// Records passes, submits them with what was recorded before, and waits. The host can then read what they wrote.
    pub fn submit(&self, record: impl FnOnce(&mut Recorder) -> Result<()>) -> Result<()> {
        self.record(record)?;
        self.finish()
    }

    /// Submits work with what was recorded before, waits, and measures the speed of the work's kernel.
    pub fn finish_work(&self, work: Work) -> Result<()> {
        let recorded = self.recorded.take();
        let recorder = recorded.ok_or_else(|| Error::internal("work was not recorded"))?;
        self.cost.borrow_mut().submit_work(recorder, work)
    }

    /// Submits what was recorded and waits.
    pub fn finish(&self) -> Result<()> {
        match self.recorded.take() {
            Some(recorder) => self.cost.borrow_mut().submit(recorder),
            None => Ok(()),
        }
    }

    /// Records a pass of one kernel, with one invocation per item, or per pixel of an image.
    pub fn dispatch<T: Pod>(
        &self,
        recorder: &mut Recorder,
        (pass, words): (&'static str, &[&str]),
        resources: &[(&str, Resource)],
        parameters: &T,
        [columns, rows]: [u32; 2],
    ) -> Result<()> {
        if rows > 1 {
            let kernel = (pass, words);
            return self.dispatch_image(recorder, kernel, resources, parameters, [columns, rows]);
        }
        let pipeline = self.pipelines.compute(pass, words)?;
        let [x, ..] = pipeline.module.workgroup_size;
        recorder.pass(pass, |recorder| {
            let groups = groups_in_rows(columns.div_ceil(x));
            recorder.dispatch(&pipeline, resources, parameters, groups)
        })
    }

    /// The same for an image of any size.
    pub fn dispatch_image<T: Pod>(
        &self,
        recorder: &mut Recorder,
        (pass, words): (&'static str, &[&str]),
        resources: &[(&str, Resource)],
        parameters: &T,
        [columns, rows]: [u32; 2],
    ) -> Result<()> {
        let pipeline = self.pipelines.compute(pass, words)?;
        let [x, y, _] = pipeline.module.workgroup_size;
        let groups = [columns.div_ceil(x), rows.div_ceil(y), 1];
        recorder.pass(pass, |recorder| {
            recorder.dispatch(&pipeline, resources, parameters, groups)
        })
    }

    /// Divides the rows of the image so that the pixels of each part have a ray in memory: the first row, and the one after the last.
    pub fn row_ranges(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let [width, height] = self.plan.resolution_px;
        let rows = (self.plan.rays_at_once / width).max(1);
        let starts = (0..height).step_by(rows as usize);
        starts.map(move |first| [first, height.min(first + rows)])
    }

    /// The modulation, for kernels with phasors.
    pub fn modulation(&self) -> Option<(&'static str, Resource<'_>)> {
        let buffer = self.modulation?;
        Some(("modulation", Resource::Buffer(buffer)))
    }

    /// The camera's position C, local.
    pub fn camera_position(&self) -> [f32; 3] {
        self.space.to_local(self.scene.camera.position_m)
    }

    /// The distance of C from the local origin, in turns of each time-of-flight frequency.
    pub fn camera_turns(&self) -> [f32; MAX_FREQUENCIES] {
        modulation::turns_to_origin(self.scene, self.space, self.scene.camera.position_m)
    }
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeSet, fs, path::PathBuf, process::Command};

    use crate::{
        GatherKernel,
        scene::VplSum,
        vulkan::shaders::{MODULES, Module},
    };

    /// Every combination of the words that the passes request from `Module::find`.
    fn requested() -> Vec<(&'static str, Vec<&'static str>)> {
        let brdfs = ["lambert", "phong"];
        let shadings = [
            ["flat", ""],
            ["flat", "textured"],
            ["smooth", ""],
            ["smooth", "textured"],
            ["detailed", ""],
        ];
        let mut requested = vec![
            ("vertex", vec![]),
            ("shadow", vec![]),
            ("compact", vec!["scan"]),
            ("stderr", vec![]),
            ("area_light", vec!["merge"]),
            ("area_light", vec!["add", ""]),
            ("area_light", vec!["add", "phasors"]),
            ("sensor", vec!["", ""]),
            ("sensor", vec!["indirect", ""]),
            ("sensor", vec!["", "aperture"]),
            ("sensor", vec!["indirect", "aperture"]),
            ("pixel_filter", vec!["depths"]),
            ("sensor", vec!["", "sampled"]),
            ("sensor", vec!["indirect", "sampled"]),
        ];
        for tracer in ["kernel", "query"] {
            for geometry in ["", "cutout", "instanced"] {
                let words = |find| ("trace", vec![find, tracer, geometry]);
                requested.extend(["any", "closest"].map(words));
            }
        }
        requested.push(("light_rays", vec!["emit"]));
        requested.extend(["", "lens"].map(|lens| ("primary_rays", vec!["emit", lens])));
        for (brdf, receiver) in [
            ("lambert", "matte"),
            ("phong", "matte"),
            ("phong", "glossy"),
        ] {
            requested.push(("final_gather_emit", vec![brdf, receiver]));
            for phasors in ["", "phasors"] {
                for pass in ["final_gather_draw", "final_gather_sum"] {
                    requested.push((pass, vec![brdf, receiver, phasors]));
                }
                for instanced in ["", "instanced"] {
                    let words = |[shading, texture]: [&'static str; 2]| {
                        let words = vec![brdf, receiver, shading, texture, phasors, instanced];
                        ("final_gather_shade", words)
                    };
                    requested.extend(shadings.map(words));
                }
            }
        }
        let kinds = ["point", "spot", "directional", "pattern", "projector"];
        requested.extend(kinds.map(|kind| ("direct_emit", vec![kind])));
        for brdf in brdfs {
            for pass in ["gbuffer", "rsm"] {
                let words =
                    |[shading, texture]: [&'static str; 2]| (pass, vec![brdf, shading, texture]);
                requested.extend(shadings.map(words));
                requested.push(words(["detailed", "cutout"]));
            }
            for [shading, texture] in shadings {
                for instanced in ["", "instanced"] {
                    let words = |first, other| vec!["shade", first, brdf, shading, texture, other];
                    let rays = |lens| ("primary_rays", words(lens, instanced));
                    requested.extend(["", "lens"].map(rays));
                    let rays = |phasors| {
                        let words = [words("", phasors), vec![instanced]].concat();
                        ("light_rays", words)
                    };
                    requested.extend(["", "phasors"].map(rays));
                }
            }
            for kind in kinds {
                for shadow in ["map", "rays"] {
                    requested.push(("direct", vec![kind, brdf, shadow]));
                    if kind != "directional" {
                        requested.push(("direct", vec![kind, brdf, "phasors", shadow]));
                    }
                }
            }
            requested.extend(["count", "write"].map(|kernel| ("receivers", vec![kernel, brdf])));
            requested.push(("vpl", vec!["count", brdf]));
            for phasors in ["", "phasors"] {
                requested.push(("pixel_filter", vec!["interpolate", brdf, phasors]));
                let words = |noise| ("pixel_filter", vec!["gathered", brdf, noise, phasors]);
                requested.extend(["exact", "noisy"].map(words));
                let words = |pass| (pass, vec![brdf, phasors]);
                requested.extend(["sample_counts", "smooth"].map(words));
                for pass in ["predict", "scatter", "resolve", "error_estimate"] {
                    let words = |noise| (pass, vec![brdf, noise, phasors]);
                    requested.extend(["exact", "noisy"].map(words));
                }
            }
            for estimator in VplSum::ALL.map(VplSum::word) {
                requested.push(("vpl", vec!["write", brdf, estimator]));
                for kernel in GatherKernel::ALL {
                    for vpl in ["matte", "glossy"] {
                        let words = vec![kernel.name(), estimator, brdf, vpl];
                        for frequencies in ["one", "four"] {
                            let phasors = [&words[..], &["phasors", frequencies]].concat();
                            requested.push(("gather", phasors));
                        }
                        requested.push(("gather", words));
                    }
                }
            }
        }
        requested
    }

    #[test]
    fn the_modules_are_those_that_the_passes_request() {
        let found: BTreeSet<&str> = requested()
            .into_iter()
            .map(|(pass, words)| {
                let module = Module::find(pass, &words).expect("the module is compiled");
                module.name
            })
            .collect();
        let compiled: BTreeSet<&str> = MODULES.iter().map(|module| module.name).collect();
        assert_eq!(compiled, found);
    }

    /// Deciding the switches of a module leaves a valid one, without switches, whose resources are those that are left.
    #[test]
    fn every_kernel_is_valid_vulkan_1_3() {
        let folder = tempfile::tempdir().expect("a folder");
        let requested = requested();
        let kernels = requested.iter().map(|(pass, words)| {
            let module = Module::find(pass, words).expect("the module is compiled");
            let kernel = module.kernel(words);
            assert!(kernel.bindings.len() <= module.bindings.len());
            let path = folder.path().join(module.kernel_name(words) + ".spv");
            let bytes: Vec<u8> = kernel.words.iter().flat_map(|w| w.to_le_bytes()).collect();
            fs::write(&path, bytes).expect("the folder is writable");
            path
        });
        let kernels: BTreeSet<PathBuf> = kernels.collect();
        assert!(kernels.len() > 3 * MODULES.len());
        for kernel in kernels {
            let output = Command::new("spirv-val")
                .args(["--target-env", "vulkan1.3"])
                .arg(&kernel)
                .output()
                .expect("scripts/setup installs spirv-val");
            let says = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{}: {says}", kernel.display());
        }
    }
}
