//! Part of a gearbox at close range: two meshing gears with spokes between holes, chamfers and bolts, in front of a plate. Flat facets. All
//! lengths are millimetres; gears are parallel to the x-y plane and turn about z.

use std::f64::consts::TAU;

use glam::{DAffine3, DQuat, DVec2, DVec3};

use super::materials::{BRASS, GREY, STEEL};
use super::mesh::Mesh;
use super::shapes::{cuboid, lathe, loft};
use super::{Part, part};

/// Height of a tooth; the radius of the pitch circle is `MODULE_MM` · teeth / 2.
const TOOTH_MM: f64 = 4.5;
const MODULE_MM: f64 = 2.0;
const POINTS_PER_TOOTH: usize = 16;

struct Gear {
    teeth: usize,
    bore_mm: f64,
    hub_mm: f64,
    /// Inner radius of the rim, where the web ends.
    rim_mm: f64,
    hole_mm: f64,
    holes: usize,
}

const WHEEL: Gear = Gear {
    teeth: 36,
    bore_mm: 6.0,
    hub_mm: 13.0,
    rim_mm: 28.0,
    hole_mm: 5.0,
    holes: 6,
};

const PINION: Gear = Gear {
    teeth: 18,
    bore_mm: 3.0,
    hub_mm: 5.0,
    rim_mm: 12.5,
    hole_mm: 2.2,
    holes: 5,
};

pub fn parts() -> Vec<Part> {
    let apart_mm = WHEEL.pitch_radius_mm() + PINION.pitch_radius_mm() + 0.3;
    let direction = DVec2::from_angle(0.5);
    let [x_mm, y_mm] = (apart_mm * direction).to_array();
    // A tooth of the pinion meets a gap of the wheel.
    let turn = DQuat::from_rotation_z(0.5 + 0.5 * TAU / PINION.teeth as f64);
    let place = DAffine3::from_rotation_translation(turn, DVec3::new(x_mm, y_mm, 0.0));
    let pinion = PINION.mesh().transformed(place);

    let mut bolts = Mesh::default();
    for index in 0..3 {
        let at_mm = 9.8 * DVec2::from_angle(TAU * index as f64 / 3.0 + 0.3);
        bolts.append(bolt(3.2).moved(at_mm.x, at_mm.y, 8.0));
    }
    for [x_mm, y_mm] in [[-30.0, 32.0], [2.0, 44.0], [34.0, -34.0], [-38.0, -30.0]] {
        bolts.append(bolt(5.0).moved(x_mm, y_mm, -10.0));
    }
    vec![
        part(STEEL, WHEEL.mesh()),
        part(BRASS, pinion),
        part(STEEL, bolts),
        part(GREY, housing()),
    ]
}

/// A plate behind the gears and a rim around them.
fn housing() -> Mesh {
    let wall = |min: [f64; 2], max: [f64; 2], front_mm: f64| {
        cuboid(
            DVec3::new(min[0], min[1], -14.0),
            DVec3::new(max[0], max[1], front_mm),
        )
    };
    Mesh::joined([
        wall([-58.0, -58.0], [72.0, 68.0], -10.0),
        wall([-58.0, -58.0], [-48.0, 68.0], 26.0),
        wall([62.0, -58.0], [72.0, 68.0], 26.0),
        wall([-58.0, -58.0], [72.0, -48.0], 26.0),
        wall([-58.0, 58.0], [72.0, 68.0], 26.0),
    ])
}

impl Gear {
    fn pitch_radius_mm(&self) -> f64 {
        MODULE_MM * self.teeth as f64 / 2.0
    }

    /// Radius of the outline: the flanks rise and fall between the root and the tip of each tooth.
    fn outline_mm(&self, turn: f64) -> f64 {
        let phase = (turn * self.teeth as f64).fract();
        let rise =
            ((phase - 0.10) / 0.25).clamp(0.0, 1.0) - ((phase - 0.65) / 0.25).clamp(0.0, 1.0);
        self.pitch_radius_mm() + (rise - 0.5) * TOOTH_MM
    }

    fn mesh(&self) -> Mesh {
        let mut front = Mesh::joined([self.hub(), self.rim()]);
        for index in 0..self.holes {
            let turn = DQuat::from_rotation_z(TAU * index as f64 / self.holes as f64);
            front.append(self.web().transformed(DAffine3::from_quat(turn)));
        }
        let mirror = DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0));
        Mesh::joined([front.clone(), front.transformed(mirror)])
    }

    /// A loop of points around the axis.
    fn ring(&self, z_mm: f64, radius_mm: impl Fn(f64) -> f64) -> Vec<DVec3> {
        let count = self.teeth * POINTS_PER_TOOTH;
        let turns = (0..count).map(|index| index as f64 / count as f64);
        turns
            .map(|turn| (radius_mm(turn) * DVec2::from_angle(TAU * turn)).extend(z_mm))
            .collect()
    }

    /// From the mid-plane of the bore to the web.
    fn hub(&self) -> Mesh {
        let profile = [
            [self.bore_mm, 0.0],
            [self.bore_mm, 7.2],
            [self.bore_mm + 0.8, 8.0],
            [self.hub_mm - 0.8, 8.0],
            [self.hub_mm, 7.2],
            [self.hub_mm, 3.0],
            [self.hub_mm + 0.6, 2.4],
        ];
        loft(&profile.map(|[radius_mm, z_mm]| self.ring(z_mm, |_| radius_mm)))
    }

    /// From the web to the mid-plane of the teeth.
    fn rim(&self) -> Mesh {
        let circle = |radius_mm: f64, z_mm| self.ring(z_mm, move |_| radius_mm);
        let teeth =
            |inset_mm: f64, z_mm| self.ring(z_mm, move |turn| self.outline_mm(turn) - inset_mm);
        let root_mm = self.pitch_radius_mm() - 0.5 * TOOTH_MM;
        loft(&[
            circle(self.rim_mm - 0.6, 2.4),
            circle(self.rim_mm, 3.0),
            circle(self.rim_mm, 5.4),
            circle(self.rim_mm + 0.6, 6.0),
            circle(root_mm - 1.2, 6.0),
            teeth(0.6, 6.0),
            teeth(0.0, 5.4),
            teeth(0.0, 0.0),
        ])
    }

    /// The part of the web around a hole on the x axis, and the front half of the hole. Each point of the web's edge is joined to the point
    /// of the hole in the same direction.
    fn web(&self) -> Mesh {
        const STEPS: usize = 12;
        // Reaches a little below hub and rim, because the points of their circles are at other angles.
        let inner_mm = self.hub_mm + 0.5;
        let outer_mm = self.rim_mm - 0.5;
        let half_angle = 0.5 * TAU / self.holes as f64;
        let mut edge = Vec::new();
        for step in 0..4 * STEPS {
            let share = (step % STEPS) as f64 / STEPS as f64;
            let [radius_mm, angle] = match step / STEPS {
                0 => [inner_mm, half_angle * (1.0 - 2.0 * share)],
                1 => [inner_mm + share * (outer_mm - inner_mm), -half_angle],
                2 => [outer_mm, half_angle * (2.0 * share - 1.0)],
                _ => [outer_mm + share * (inner_mm - outer_mm), half_angle],
            };
            edge.push(radius_mm * DVec2::from_angle(angle));
        }
        let centre = DVec2::new(0.5 * (inner_mm + outer_mm), 0.0);
        let hole = |radius_mm: f64, z_mm: f64| -> Vec<DVec3> {
            let points = edge.iter().map(|point| (*point - centre).normalize());
            points
                .map(|direction| (centre + radius_mm * direction).extend(z_mm))
                .collect()
        };
        loft(&[
            hole(self.hole_mm, 0.0),
            hole(self.hole_mm, 1.9),
            hole(self.hole_mm + 0.5, 2.4),
            edge.iter().map(|point| point.extend(2.4)).collect(),
        ])
    }
}

/// A threaded bolt with washer and nut that stands on z = 0.
fn bolt(radius_mm: f64) -> Mesh {
    const SIDES: usize = 32;
    let r = radius_mm;
    let washer = [
        [1.9 * r, 0.0],
        [1.9 * r, 0.2 * r],
        [1.8 * r, 0.3 * r],
        [0.0, 0.3 * r],
    ];
    // A cone has cut off the upper corners.
    let nut = [
        [1.65 * r, 0.3 * r],
        [1.65 * r, 1.2 * r],
        [1.4 * r, 1.4 * r],
        [0.0, 1.4 * r],
    ];
    let mut thread = Vec::new();
    for index in 0..8 {
        let height = (1.2 + 0.16 * f64::from(index)) * r;
        thread.extend([[0.88 * r, height], [r, height + 0.08 * r]]);
    }
    thread.extend([[0.88 * r, 2.48 * r], [0.7 * r, 2.6 * r], [0.0, 2.6 * r]]);
    let along_y = Mesh::joined([lathe(&washer, SIDES), lathe(&nut, 6), lathe(&thread, SIDES)]);
    // From the y axis to the z axis.
    along_y.transformed(DAffine3::from_rotation_x(TAU / 4.0))
}
