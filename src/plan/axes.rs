//! What the plan chooses on the axes of `shaders/permutations.txt`.

use super::{GatherKernel, Plan};
use crate::{
    scene::VplSum,
    vulkan::shaders::{Brdf, Distribution, Frequencies, Receiver, Sum, Surface},
};

impl Plan {
    pub(crate) fn brdf(&self) -> Brdf {
        match (self.is_specular, self.has_microfacets) {
            (_, true) => Brdf::SpecularMicrofacet,
            (true, false) => Brdf::Specular,
            (false, false) => Brdf::Lambert,
        }
    }

    /// The name of the BRDF for readers.
    pub(super) fn brdf_name(&self) -> &'static str {
        match self.brdf() {
            Brdf::Lambert => "Lambert",
            Brdf::Specular => "Phong",
            Brdf::SpecularMicrofacet => "microfacets",
        }
    }

    /// Receivers all of which have a lobe, or none of which has.
    pub(crate) fn receiver(&self, is_glossy: bool) -> Receiver {
        match (self.brdf(), is_glossy) {
            (Brdf::SpecularMicrofacet, true) => Receiver::SpecularMicrofacetGlossy,
            (Brdf::SpecularMicrofacet, false) => Receiver::SpecularMicrofacetMatte,
            (_, true) => Receiver::SpecularGlossy,
            (Brdf::Specular, false) => Receiver::SpecularMatte,
            (Brdf::Lambert, false) => Receiver::LambertMatte,
        }
    }

    /// Surfaces that rays hit, each of which may be any of the scene.
    pub(crate) fn surface(&self) -> Surface {
        surface_axis(self.is_smooth, self.is_textured, self.shows_detail())
    }

    /// Whether the bounce has phasors.
    pub(crate) fn has_phasors(&self) -> bool {
        self.bounced_tof().is_some()
    }

    /// Phasors that a sum over VPLs adds up.
    pub(crate) fn frequencies(&self) -> Option<Frequencies> {
        self.bounced_tof().map(|tof| match tof.frequency_count {
            1 => Frequencies::PhasorsOne,
            _ => Frequencies::PhasorsFour,
        })
    }
}

/// One kind of surface.
pub(crate) fn surface_axis(is_smooth: bool, is_textured: bool, is_detailed: bool) -> Surface {
    match (is_detailed, is_smooth, is_textured) {
        (true, ..) => Surface::Detailed,
        (_, false, false) => Surface::Flat,
        (_, false, true) => Surface::FlatTextured,
        (_, true, false) => Surface::Smooth,
        (_, true, true) => Surface::SmoothTextured,
    }
}

impl From<VplSum> for Sum {
    fn from(sum: VplSum) -> Self {
        match sum {
            VplSum::RsmAverage => Sum::Average,
            VplSum::InstantRadiosity => Sum::Radiosity,
        }
    }
}

impl From<GatherKernel> for Distribution {
    fn from(kernel: GatherKernel) -> Self {
        match kernel {
            GatherKernel::Broadcast8 => Distribution::Broadcast8,
            GatherKernel::Broadcast4 => Distribution::Broadcast4,
            GatherKernel::Tile => Distribution::Tile,
        }
    }
}
