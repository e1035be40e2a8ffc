//! A room full of small objects, some of them glossy.

use std::f64::consts::TAU;

use fastrand::Rng;
use glam::{DAffine3, DQuat, DVec3};

use super::materials::{BLUE, OCHRE, POLISH, SATIN, TERRACOTTA, VARNISH, WHITE, WOOD};
use super::mesh::Mesh;
use super::room::open_room;
use super::shapes::{block, lathe, sphere, torus};
use super::{Part, part};

const ROOM_M: [f64; 3] = [3.0, 2.2, 2.4];
const SHELF_DEPTH_M: f64 = 0.4;

pub fn parts() -> Vec<Part> {
    let mut random = Rng::with_seed(4);
    let things = [WHITE, OCHRE, BLUE, TERRACOTTA, SATIN, VARNISH, POLISH];
    let mut parts = open_room(ROOM_M);
    parts.extend(things.map(|material| part(material, Mesh::default())));
    let first = parts.len() - things.len();
    for place_m in places_m(&mut random) {
        let index = first + random.usize(..things.len());
        let turn = DQuat::from_rotation_y(TAU * random.f64());
        let place = DAffine3::from_rotation_translation(turn, place_m);
        let thing = thing(&mut random).transformed(place);
        // One mesh cannot hold flat and smooth triangles.
        if thing.normals.is_empty() {
            parts.push(part(parts[index].material, thing));
        } else {
            parts[index].mesh.append(thing);
        }
    }
    parts.push(part(WOOD, shelves()));
    parts
}

/// Positions of the objects: near the points of a lattice, on the floor and on the shelves.
fn places_m(random: &mut Rng) -> Vec<DVec3> {
    const APART_M: f64 = 0.3;
    let mut jitter_m = || 0.05 * (2.0 * random.f64() - 1.0);
    let mut places_m = Vec::new();
    for column in 0..9 {
        let x_m = (f64::from(column) - 4.0) * APART_M;
        for row in 0..5 {
            let z_m = -0.55 + f64::from(row) * APART_M;
            places_m.push(DVec3::new(x_m + jitter_m(), 0.0, z_m + jitter_m()));
        }
        for height_m in SHELF_HEIGHTS_M {
            let z_m = 0.5 * (SHELF_DEPTH_M - ROOM_M[2]);
            places_m.push(DVec3::new(x_m + jitter_m(), height_m, z_m));
        }
    }
    places_m
}

const SHELF_HEIGHTS_M: [f64; 3] = [0.5, 0.95, 1.4];

fn shelves() -> Mesh {
    const THICKNESS_M: f64 = 0.03;
    let z_m = 0.5 * (SHELF_DEPTH_M - ROOM_M[2]) + 0.001;
    let boards = SHELF_HEIGHTS_M.map(|height_m| {
        block(ROOM_M[0] - 0.1, THICKNESS_M, SHELF_DEPTH_M).moved(0.0, height_m - THICKNESS_M, z_m)
    });
    let sides = [-1.38, 0.0, 1.38].map(|x_m| {
        block(THICKNESS_M, SHELF_HEIGHTS_M[2], SHELF_DEPTH_M - 0.02).moved(x_m, 0.0, z_m)
    });
    Mesh::joined(boards.into_iter().chain(sides))
}

/// An object at most 24 cm wide that stands on y = 0.
fn thing(random: &mut Rng) -> Mesh {
    let size_m = 0.07 + 0.05 * random.f64();
    match random.u32(..5) {
        0 => {
            let ball = sphere(3).transformed(DAffine3::from_scale(DVec3::splat(size_m)));
            ball.moved(0.0, size_m, 0.0)
        }
        1 => torus(0.7 * size_m, 0.3 * size_m, [36, 18]).moved(0.0, 0.3 * size_m, 0.0),
        // A ring that stands upright.
        2 => torus(0.75 * size_m, 0.2 * size_m, [44, 14])
            .transformed(DAffine3::from_rotation_x(TAU / 4.0))
            .moved(0.0, 0.95 * size_m, 0.0),
        3 => block(1.4 * size_m, (1.0 + 1.5 * random.f64()) * size_m, size_m),
        _ => vase(size_m),
    }
}

fn vase(size_m: f64) -> Mesh {
    let profile: Vec<[f64; 2]> = (0..=24)
        .map(|step| {
            let share = f64::from(step) / 24.0;
            let radius = 0.5 + 0.3 * (TAU * (0.9 * share + 0.05)).sin();
            [radius * size_m, 2.2 * share * size_m]
        })
        .collect();
    lathe(&profile, 40).smooth()
}
