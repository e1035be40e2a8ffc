//! The materials of the meshes. No surface reflects more than 0.8 of the light in any band.

/// Modified Phong; matt without `ks`.
#[derive(Clone, Copy, PartialEq)]
pub struct Material {
    pub name: &'static str,
    pub kd: [f64; 3],
    pub ks: f64,
    pub shininess: f64,
}

const fn matt(name: &'static str, kd: [f64; 3]) -> Material {
    glossy(name, kd, 0.0, 1.0)
}

const fn glossy(name: &'static str, kd: [f64; 3], ks: f64, shininess: f64) -> Material {
    Material {
        name,
        kd,
        ks,
        shininess,
    }
}

pub const WHITE: Material = matt("white", [0.73, 0.72, 0.70]);
pub const GREY: Material = matt("grey", [0.45, 0.45, 0.45]);
pub const TERRACOTTA: Material = matt("terracotta", [0.62, 0.25, 0.14]);
pub const TEAL: Material = matt("teal", [0.10, 0.42, 0.42]);
pub const OCHRE: Material = matt("ochre", [0.70, 0.52, 0.28]);
pub const BLUE: Material = matt("blue", [0.20, 0.30, 0.60]);
pub const FUR: Material = matt("fur", [0.66, 0.50, 0.36]);
pub const WOOD: Material = matt("wood", [0.50, 0.33, 0.20]);
pub const STONE: Material = matt("stone", [0.60, 0.57, 0.52]);
pub const CLAY: Material = matt("clay", [0.68, 0.60, 0.52]);
pub const SOIL: Material = matt("soil", [0.28, 0.20, 0.13]);
pub const GRASS: Material = matt("grass", [0.20, 0.45, 0.10]);
pub const DRY_GRASS: Material = matt("dry_grass", [0.50, 0.48, 0.18]);
pub const ROCK: Material = matt("rock", [0.55, 0.47, 0.40]);
pub const STEEL: Material = matt("steel", [0.50, 0.51, 0.53]);
pub const BRASS: Material = matt("brass", [0.62, 0.48, 0.20]);

pub const SATIN: Material = glossy("satin", [0.50, 0.50, 0.50], 0.25, 20.0);
pub const VARNISH: Material = glossy("varnish", [0.50, 0.12, 0.08], 0.30, 60.0);
pub const POLISH: Material = glossy("polish", [0.15, 0.35, 0.20], 0.45, 150.0);
pub const BRONZE: Material = glossy("bronze", [0.30, 0.20, 0.10], 0.45, 35.0);
