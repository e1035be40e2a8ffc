//! Metallic-roughness materials, as modified Phong.

use super::Bands;

/// The parameters of a glTF surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MetallicRoughness {
    /// Linear, 0 to 1.
    pub base_color: Bands,
    /// 0 to 1.
    pub metallic: f64,
    /// 0 to 1.
    pub roughness: f64,
}

/// Reflectance of a dielectric at normal incidence, for an index of refraction of 1.5.
const DIELECTRIC: f64 = 0.04;
/// The smallest roughness. A smoother lobe is narrower than a pixel.
const SMOOTHEST: f64 = 0.03;

impl MetallicRoughness {
    /// k_d, k_s and the exponent of modified Phong. F is the reflectance at normal incidence and α = roughness². The lobe gets a share of
    /// F, and a width around the mirror direction; the rest of what a rough surface reflects is diffuse. The numbers are fitted to GGX
    /// metals under light from 0 to 90° off the view (`benches/peers/run --gltf-materials` measures the fit). There is no Fresnel term:
    /// towards grazing angles dielectrics reflect more than this.
    pub fn as_phong(&self) -> (Bands, Bands, f64) {
        let metallic = self.metallic.clamp(0.0, 1.0);
        let roughness = self.roughness.clamp(SMOOTHEST, 1.0);
        // (n·h)^m of microfacets. The angle to h is half the angle to the mirror direction.
        let exponent = (2.0 / roughness.powi(4) - 2.0) / 4.0;
        let diffuse = (0.14 + 0.36 * roughness.powi(2)).min(0.4);
        let lobe = 0.84 * (1.0 - roughness.powi(4)).powf(3.5);
        let straight_on = |base: f64| DIELECTRIC + metallic * (base - DIELECTRIC);
        let kd =
            |base: f64| base * (1.0 - metallic) * (1.0 - DIELECTRIC) + diffuse * straight_on(base);
        let ks = |base: f64| lobe * straight_on(base);
        (
            self.base_color.map(kd),
            self.base_color.map(ks),
            1.3 * exponent + 0.8,
        )
    }
}
