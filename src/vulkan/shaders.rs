//! The compiled shader modules, and the structs that they share with the host. `build.rs` reflects both.

use std::ffi::CStr;

use ash::vk::DescriptorType;
use bytemuck::{Pod, Zeroable};

use super::{
    keys::{Axis, axes, bindings, keys, modules, structs},
    specialise::{Specialised, specialise},
};
use crate::{Error, Result};

/// A compiled module.
#[derive(Debug)]
pub(crate) struct Module {
    /// Pass and flags: `gather_tile_lambert_matte`.
    pub name: &'static str,
    pub pass: &'static str,
    /// Flags that are decided when a pipeline is made: specialisation constants, whose ids are the indices.
    switches: &'static [&'static str],
    pub entry: &'static CStr,
    /// Zero except for compute modules.
    pub workgroup_size: [u32; 3],
    pub immediate_bytes: u32,
    pub bindings: &'static [Binding],
    /// The module's named u32 constants.
    constants: &'static [(&'static str, u32)],
    spirv: &'static [u8],
}

/// A module whose switches are decided.
pub(crate) struct Kernel {
    pub module: &'static Module,
    pub words: Vec<u32>,
    /// The resources that it needs.
    pub bindings: Vec<Binding>,
}

/// A resource that a module binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Binding {
    pub binding: u32,
    pub name: &'static str,
    pub kind: DescriptorType,
}

impl Key {
    /// The pass whose kernel it is.
    pub fn pass(self) -> &'static str {
        self.module().pass
    }

    /// The module with its switches decided.
    pub fn kernel(self) -> Kernel {
        let (module, chosen) = (self.module(), self.flags());
        let switches = module.switches.iter();
        let is_on: Vec<bool> = switches.map(|switch| chosen.contains(switch)).collect();
        let Specialised { words, bindings } = specialise(&module.words(), &is_on);
        let is_left = |binding: &&Binding| bindings.contains(&binding.binding);
        Kernel {
            module,
            words,
            bindings: module.bindings.iter().filter(is_left).copied().collect(),
        }
    }
}

impl Module {
    /// A constant of the shader's source. Those that are the same in all modules are in [`constants`].
    pub fn constant(&self, name: &str) -> Result<u32> {
        self.constants
            .iter()
            .find(|(label, _)| *label == name)
            .map(|(_, value)| *value)
            .ok_or_else(|| Error::internal(format!("{} has no constant {name}", self.name)))
    }

    fn words(&self) -> Vec<u32> {
        bytemuck::pod_collect_to_vec(self.spirv)
    }
}

/// Largest number of storage images of a kernel, among the kernels of some passes.
pub fn most_storage_images(passes: &[&str]) -> u64 {
    let is_among = |module: &&&Module| passes.contains(&module.pass);
    let images = |module: &&Module| {
        let kinds = module.bindings.iter().map(|binding| binding.kind);
        kinds
            .filter(|kind| *kind == DescriptorType::STORAGE_IMAGE)
            .count() as u64
    };
    let kernels = MODULES.iter().filter(is_among);
    kernels.map(images).max().unwrap_or_default()
}

include!(concat!(env!("CAMLUX_SPIRV"), "/keys.rs"));
include!(concat!(env!("CAMLUX_SPIRV"), "/layouts.rs"));
include!(concat!(env!("CAMLUX_SPIRV"), "/modules.rs"));

/// BLAKE3 in hexadecimal (64 digits) of the version and the compiled shaders. Engines with the same hash compute the same.
pub fn engine_hash() -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    for module in MODULES {
        hasher.update(module.name.as_bytes());
        hasher.update(&(module.spirv.len() as u64).to_le_bytes());
        hasher.update(module.spirv);
    }
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, fs, process::Command};

    use super::*;

    /// Deciding the switches of a module leaves a valid one, without switches, whose resources are those that are left.
    #[test]
    fn every_kernel_is_valid_vulkan_1_3() {
        let folder = tempfile::tempdir().expect("a folder");
        // Keys that differ in flags of no `#if` have the same kernel.
        let mut kernels = BTreeMap::new();
        for key in Key::all() {
            let kernel = key.kernel();
            assert!(kernel.bindings.len() <= kernel.module.bindings.len());
            kernels.insert(kernel.words, key);
        }
        assert!(kernels.len() > 2 * MODULES.len());
        for (words, key) in kernels {
            let path = folder.path().join("kernel.spv");
            let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
            fs::write(&path, bytes).expect("the folder is writable");
            let output = Command::new("spirv-val")
                .args(["--target-env", "vulkan1.3"])
                .arg(&path)
                .output()
                .expect("scripts/setup installs spirv-val");
            let says = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{key:?}: {says}");
        }
    }

    #[test]
    fn permutation_names_are_unique() {
        for (i, module) in MODULES.iter().enumerate() {
            assert!(
                MODULES[..i].iter().all(|other| other.name != module.name),
                "{} twice",
                module.name
            );
        }
    }

    /// Vulkan guarantees four storage images and four storage buffers. The kernels that shade what rays hit, and those that search for
    /// cut-outs, use more, which the plan checks: MoltenVK has eight images on some devices.
    #[test]
    fn a_kernel_takes_few_resources() {
        for module in MODULES {
            let count = |kind| module.bindings.iter().filter(|b| b.kind == kind).count();
            let most_images = match module.pass {
                "final_gather_extend" | "final_gather_shade" | "light_rays" | "light_paths" => 7,
                "primary_rays" => 8,
                _ => 4,
            };
            let images = count(DescriptorType::STORAGE_IMAGE);
            assert!(images <= most_images, "{}: {images}", module.name);
            let most_buffers = match module.pass {
                "final_gather_extend" | "final_gather_shade" => 6,
                "rsm" | "final_gather_draw" | "final_gather_sum" => 5,
                _ => 4,
            };
            let buffers = count(DescriptorType::STORAGE_BUFFER);
            assert!(buffers <= most_buffers, "{}: {buffers}", module.name);
            assert!(module.immediate_bytes <= 128, "{}", module.name);
        }
    }

    #[test]
    fn fragment_stages_bind_what_the_vertex_stage_binds() {
        let vertex = Key::Vertex {}.module();
        let fragments = || MODULES.iter().filter(|m| m.entry == c"fragment_main");
        assert!(fragments().count() > 0);
        for fragment in fragments() {
            for binding in vertex.bindings {
                let same = |other: &&Binding| other.binding == binding.binding;
                let other = fragment.bindings.iter().find(same);
                assert!(
                    other.is_none_or(|other| other == binding),
                    "{}: {other:?} is {binding:?} in the vertex stage",
                    fragment.name
                );
            }
        }
    }
}
