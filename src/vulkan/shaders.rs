//! The compiled shader modules, and the structs that they share with the host. `build.rs` reflects both.

use std::ffi::CStr;

use ash::vk::DescriptorType;
use bytemuck::{Pod, Zeroable};

use super::specialise::{Specialised, specialise};
use crate::{Error, Result};

/// A compiled module.
#[derive(Debug)]
pub(crate) struct Module {
    /// Pass and words: `gather_tile_lambert_matte`.
    pub name: &'static str,
    pub pass: &'static str,
    /// The words of its permutation for which it is compiled.
    words: &'static [&'static str],
    /// Words that are decided when a pipeline is made: specialisation constants, whose ids are the indices.
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

impl Module {
    /// The module of a pass with the words of its permutation; empty words are ignored.
    pub fn find(pass: &str, words: &[&str]) -> Result<&'static Module> {
        let of_pass = |module: &&Module| module.pass == pass && module.has(words);
        MODULES
            .iter()
            .find(of_pass)
            .ok_or_else(|| Error::internal(format!("there is no shader module {pass} {words:?}")))
    }

    /// Whether the module is compiled for these words, or has switches for them.
    fn has(&self, words: &[&str]) -> bool {
        let given = || words.iter().filter(|word| !word.is_empty());
        self.words.iter().all(|word| words.contains(word))
            && given().all(|word| self.words.contains(word) || self.switches.contains(word))
    }

    /// Name of a kernel: the module and the switches that are on.
    pub fn kernel_name(&self, words: &[&str]) -> String {
        let on = self.switches.iter().filter(|switch| words.contains(switch));
        let mut name = String::from(self.name);
        for switch in on {
            name.push('_');
            name.push_str(switch);
        }
        name
    }

    /// The module with its switches decided by the words of a permutation.
    pub fn kernel(&'static self, words: &[&str]) -> Kernel {
        let switches = self.switches.iter();
        let is_on: Vec<bool> = switches.map(|switch| words.contains(switch)).collect();
        let Specialised { words, bindings } = specialise(&self.words(), &is_on);
        let is_left = |binding: &&Binding| bindings.contains(&binding.binding);
        Kernel {
            module: self,
            words,
            bindings: self.bindings.iter().filter(is_left).copied().collect(),
        }
    }

    /// A u32 constant of the shader's source.
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
    let is_among = |module: &&Module| passes.contains(&module.pass);
    let images = |module: &Module| {
        let kinds = module.bindings.iter().map(|binding| binding.kind);
        kinds
            .filter(|kind| *kind == DescriptorType::STORAGE_IMAGE)
            .count() as u64
    };
    let kernels = MODULES.iter().filter(is_among);
    kernels.map(images).max().unwrap_or_default()
}

include!(concat!(env!("CAMLUX_SPIRV"), "/shaders.rs"));

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
    use super::*;

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
        let have_five_buffers = [
            "rsm",
            "final_gather_draw",
            "final_gather_shade",
            "final_gather_sum",
        ];
        for module in MODULES {
            let count = |kind| module.bindings.iter().filter(|b| b.kind == kind).count();
            let most_images = match module.pass {
                "final_gather_shade" | "light_rays" => 7,
                "primary_rays" => 8,
                _ => 4,
            };
            let images = count(DescriptorType::STORAGE_IMAGE);
            assert!(images <= most_images, "{}: {images}", module.name);
            let has_five = have_five_buffers.contains(&module.pass);
            let most_buffers = if has_five { 5 } else { 4 };
            let buffers = count(DescriptorType::STORAGE_BUFFER);
            assert!(buffers <= most_buffers, "{}: {buffers}", module.name);
            assert!(module.immediate_bytes <= 128, "{}", module.name);
        }
    }

    #[test]
    fn fragment_stages_bind_what_the_vertex_stage_binds() {
        let vertex = Module::find("vertex", &[]).expect("it is compiled");
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
