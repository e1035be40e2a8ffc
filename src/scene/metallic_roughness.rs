//! Surfaces of microfacets, as in glTF 2.0.

use super::{
    Limits,
    parameters::{check_limits, parameters},
    validate::Part,
};
use crate::Result;

const SHARE: Limits = Limits::between(0.0, 1.0, "give a share from 0 to 1");

parameters! {
    /// A metallic-roughness surface, as in glTF 2.0: a Lambert base under microfacets (GGX). Metal reflects its base colour in the lobe and
    /// nothing else.
    pub struct MetallicRoughness {
        /// How rough the surface is, to the eye. α of the facets is its square.
        roughness: f64 = 1.0, Limits::between(SMOOTHEST, 1.0, "give a roughness from 0.03 to 1: a smoother surface is a mirror, which is not modelled"); needs "roughness = 0.4";
        /// Share of the surface that is metal.
        metallic: f64 = 0.0, SHARE;
        /// Index of refraction where the surface is no metal. It reflects ((n−1)/(n+1))² straight on.
        ior: f64 = 1.5, Limits::between(1.0, 10.0, "give an index of refraction from 1 to 10, such as 1.5");
        /// Factor of what the surface reflects straight on where it is no metal.
        specular: f64 = 1.0, SHARE;
    }
}

/// The smallest roughness. A smoother lobe is narrower than f32 directions can express.
pub(crate) const SMOOTHEST: f64 = 0.03;

impl MetallicRoughness {
    /// F_0 where the surface is no metal.
    pub fn dielectric_reflectance(&self) -> f64 {
        self.specular * ((self.ior - 1.0) / (self.ior + 1.0)).powi(2)
    }

    pub(super) fn validate(&self, part: &Part) -> Result<()> {
        check_limits(part, self)
    }
}
