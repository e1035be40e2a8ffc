//! A furnished room that a distant lamp lights through the window.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec3};

use super::materials::{BLUE, CLAY, OCHRE, TEAL, WHITE, WOOD};
use super::mesh::Mesh;
use super::room::room_with_walls;
use super::shapes::{block, cuboid, grid, lathe, rectangle, torus};
use super::{Part, part};

/// The window is in the left wall, in the plane x = -WIDTH_M / 2.
const WIDTH_M: f64 = 4.0;
const HEIGHT_M: f64 = 2.5;
const DEPTH_M: f64 = 4.0;
const WINDOW_Y_M: [f64; 2] = [0.9, 2.1];
const WINDOW_Z_M: [f64; 2] = [-1.0, 0.4];

pub fn parts() -> Vec<Part> {
    let mut parts = room_with_walls([WIDTH_M, HEIGHT_M, DEPTH_M], WHITE, OCHRE);
    parts[1].mesh = wall_with_window();
    // The wall behind the camera closes the room.
    let front = DVec3::new(WIDTH_M / 2.0, 0.0, DEPTH_M / 2.0);
    parts[0].mesh.append(rectangle(
        front,
        DVec3::NEG_X * WIDTH_M,
        DVec3::Y * HEIGHT_M,
    ));
    parts.extend([
        part(WOOD, bars()),
        part(WOOD, table().moved(0.3, 0.0, -0.5)),
        part(
            WOOD,
            Mesh::joined([
                stool().moved(-0.55, 0.0, -0.1),
                stool().moved(0.9, 0.0, 0.15),
            ]),
        ),
        part(CLAY, bowl().moved(0.45, 0.76, -0.45)),
        part(TEAL, vase().moved(-0.05, 0.76, -0.7)),
        part(BLUE, sofa().moved(0.2, 0.0, -1.5)),
    ]);
    parts
}

/// Four rectangles around the opening.
fn wall_with_window() -> Mesh {
    let x_m = -WIDTH_M / 2.0;
    let [below_m, above_m] = WINDOW_Y_M;
    let [back_m, front_m] = WINDOW_Z_M;
    let piece = |y_m: [f64; 2], z_m: [f64; 2]| {
        let corner_m = DVec3::new(x_m, y_m[0], z_m[1]);
        rectangle(
            corner_m,
            DVec3::Z * (z_m[0] - z_m[1]),
            DVec3::Y * (y_m[1] - y_m[0]),
        )
    };
    let half_m = DEPTH_M / 2.0;
    Mesh::joined([
        piece([0.0, below_m], [-half_m, half_m]),
        piece([above_m, HEIGHT_M], [-half_m, half_m]),
        piece(WINDOW_Y_M, [-half_m, back_m]),
        piece(WINDOW_Y_M, [front_m, half_m]),
    ])
}

/// Frame and glazing bars of the window.
fn bars() -> Mesh {
    let bar = |y_m: [f64; 2], z_m: [f64; 2]| {
        let x_m = -WIDTH_M / 2.0;
        cuboid(
            DVec3::new(x_m - 0.05, y_m[0], z_m[0]),
            DVec3::new(x_m + 0.03, y_m[1], z_m[1]),
        )
    };
    let [below_m, above_m] = WINDOW_Y_M;
    let [back_m, front_m] = WINDOW_Z_M;
    let around = |middle_m: f64| [middle_m - 0.02, middle_m + 0.02];
    let mut bars = Mesh::joined([bar(around(0.5 * (below_m + above_m)), WINDOW_Z_M)]);
    for index in 0..=4 {
        let share = f64::from(index) / 4.0;
        bars.append(bar(WINDOW_Y_M, around(back_m + share * (front_m - back_m))));
    }
    bars.append(bar(around(below_m), WINDOW_Z_M));
    bars.append(bar(around(above_m), WINDOW_Z_M));
    bars
}

/// A turned leg with rings and bulges, thinner towards the floor.
fn leg(height_m: f64) -> Mesh {
    let profile: Vec<[f64; 2]> = (0..=48)
        .map(|step| {
            let share = f64::from(step) / 48.0;
            let radius_m = 0.018 + 0.012 * share + 0.008 * (TAU * 5.0 * share).sin();
            [radius_m, share * height_m]
        })
        .collect();
    lathe(&profile, 24)
}

fn table() -> Mesh {
    let mut table = block(1.3, 0.04, 0.8).moved(0.0, 0.72, 0.0);
    for [x_m, z_m] in [[-0.58, -0.33], [0.58, -0.33], [-0.58, 0.33], [0.58, 0.33]] {
        table.append(leg(0.72).moved(x_m, 0.0, z_m));
    }
    table
}

fn stool() -> Mesh {
    let seat = [
        [0.0, 0.42],
        [0.17, 0.42],
        [0.19, 0.44],
        [0.17, 0.46],
        [0.0, 0.45],
    ];
    let mut stool = lathe(&seat, 48);
    for index in 0..3 {
        let around = DAffine3::from_rotation_y(TAU * f64::from(index) / 3.0);
        stool.append(leg(0.42).moved(0.13, 0.0, 0.0).transformed(around));
    }
    stool
}

/// An open, thin, smooth shape.
fn bowl() -> Mesh {
    let profile: Vec<[f64; 2]> = (0..=20)
        .map(|step| {
            let angle = TAU / 4.0 * f64::from(step) / 20.0;
            [0.17 * angle.sin(), 0.11 * (1.0 - angle.cos()) + 0.002]
        })
        .collect();
    lathe(&profile, 64).smooth()
}

fn vase() -> Mesh {
    let profile: Vec<[f64; 2]> = (0..=40)
        .map(|step| {
            let share = f64::from(step) / 40.0;
            let radius_m = 0.055 + 0.03 * (TAU * (0.8 * share + 0.02)).sin();
            [radius_m, 0.32 * share]
        })
        .collect();
    let rim = torus(0.036, 0.006, [64, 12]).moved(0.0, 0.32, 0.0);
    Mesh::joined([lathe(&profile, 64).smooth(), rim])
}

/// Cushions on a base, along the back wall.
fn sofa() -> Mesh {
    let cushion = |size_m: [f64; 3], at_m: [f64; 3]| {
        let place = DAffine3::from_scale(DVec3::from_array(size_m) / 2.0);
        pillow().transformed(place).moved(at_m[0], at_m[1], at_m[2])
    };
    let mut sofa = Mesh::joined([
        cushion([0.2, 0.6, 0.8], [-0.95, 0.35, 0.0]),
        cushion([0.2, 0.6, 0.8], [0.95, 0.35, 0.0]),
        cushion([1.8, 0.25, 0.8], [0.0, 0.18, 0.0]),
    ]);
    for x_m in [-0.57, 0.0, 0.57] {
        sofa.append(cushion([0.56, 0.2, 0.7], [x_m, 0.38, 0.05]));
        sofa.append(cushion([0.56, 0.5, 0.2], [x_m, 0.65, -0.28]));
    }
    sofa
}

/// A superellipsoid with half axes of 1: between a ball and a box.
fn pillow() -> Mesh {
    const EXPONENT: f64 = 0.35;
    let power = |value: f64| value.signum() * value.abs().powf(EXPONENT);
    let shape = grid([48, 24], [true, false], |column, row| {
        let around = -TAU * (column as f64 + 0.5) / 48.0;
        let up = TAU / 2.0 * (row as f64 / 24.0 - 0.5);
        let is_pole = row == 0 || row == 24;
        let radius = if is_pole { 0.0 } else { power(up.cos()) };
        DVec3::new(
            radius * power(around.cos()),
            power(up.sin()),
            radius * power(around.sin()),
        )
    });
    shape.smooth()
}
