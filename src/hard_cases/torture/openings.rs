//! A room with a lamp behind a wall of zero thickness with openings. Its bounce is computed by quadrature in f64.
//!
//! The bounce is an integral over the openings: each element of an opening passes a solid angle of the lamp's light to a point Q. The
//! integrand stays smooth however narrow an opening is, while a sampler finds less and less of the light.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, dvec3};

use crate::{
    Scene,
    hard_cases::scenes::{GREY, append, quad, scene_of},
    scene::{Bands, Light, Mesh},
};

/// The empty room is a grey cube of 2 m around 0. Its openings are in the wall at x = −1 m.
const WALL_X_M: f64 = -1.0;

/// A rectangle in the wall, from the lowest to the highest y and z, m.
#[derive(Debug, Clone, Copy)]
pub struct Opening {
    pub y_m: [f64; 2],
    pub z_m: [f64; 2],
}

impl Opening {
    /// An opening from floor to ceiling, `width_m` wide around z.
    pub fn slit(z_m: f64, width_m: f64) -> Opening {
        Opening {
            y_m: [-1.0, 1.0],
            z_m: [z_m - 0.5 * width_m, z_m + 0.5 * width_m],
        }
    }

    fn halves(self) -> [Opening; 2] {
        let [y, z] = self.middle_m();
        let Opening { y_m, z_m } = self;
        let [across, along] = [z_m, y_m].map(|[low, high]| high - low);
        if along > across {
            [[y_m[0], y], [y, y_m[1]]].map(|y_m| Opening { y_m, z_m })
        } else {
            [[z_m[0], z], [z, z_m[1]]].map(|z_m| Opening { y_m, z_m })
        }
    }

    fn middle_m(self) -> [f64; 2] {
        [self.y_m, self.z_m].map(|[low, high]| 0.5 * (low + high))
    }
}

/// The room with the lamp behind the wall and no other light. The openings must be sorted along z.
pub fn room_behind(openings: &[Opening], lamp: Light, camera_m: DVec3, look_at_m: DVec3) -> Scene {
    let [x, y, z] = DVec3::AXES.map(|axis| 2.0 * axis);
    let corner = DVec3::splat(-1.0);
    let mut room = quad("room", corner + x, y, z, GREY);
    for (at, edges) in [
        (corner, [z, x]),
        (corner + y, [x, z]),
        (corner, [x, y]),
        (corner + z, [y, x]),
    ] {
        append(&mut room, quad("", at, edges[0], edges[1], GREY));
    }
    let mut wall = Mesh {
        name: "wall".into(),
        ..Mesh::default()
    };
    let mut add = |y_m: [f64; 2], z_m: [f64; 2]| {
        let at = dvec3(WALL_X_M, y_m[0], z_m[0]);
        let [height, width] = [y_m[1] - y_m[0], z_m[1] - z_m[0]];
        if height > 0.0 && width > 0.0 {
            let piece = quad("", at, height * DVec3::Y, width * DVec3::Z, GREY);
            append(&mut wall, piece);
        }
    };
    let mut z_m = -1.0;
    for opening in openings {
        add([-1.0, 1.0], [z_m, opening.z_m[0]]);
        add([-1.0, opening.y_m[0]], opening.z_m);
        add([opening.y_m[1], 1.0], opening.z_m);
        z_m = opening.z_m[1];
    }
    add([-1.0, 1.0], [z_m, 1.0]);
    scene_of(vec![room, wall], lamp, camera_m, look_at_m)
}

/// The bounce of a lamp behind the openings.
pub struct BehindOpenings<'a> {
    pub openings: &'a [Opening],
    pub lamp_m: DVec3,
    pub power_w: Bands,
    /// Reflectance of the room and of its wall.
    pub kd: Bands,
}

/// Point Q of the room, and its normal into the room.
struct Lit {
    position_m: DVec3,
    normal: DVec3,
}

impl BehindOpenings<'_> {
    /// L_{P→C} of the bounce at a point of the room, W/sr/m². The normal points into the room.
    pub fn indirect(&self, position_m: DVec3, normal: DVec3) -> Bands {
        let openings = self.openings.iter();
        let sum: f64 = openings
            .flat_map(|opening| self.pieces(*opening))
            .map(|piece| self.integral(piece, position_m, normal, 0))
            .sum();
        [0, 1, 2].map(|band| {
            let intensity = self.power_w[band] / (4.0 * PI);
            sum * intensity * (self.kd[band] * FRAC_1_PI).powi(2)
        })
    }

    /// Cuts the opening where its light moves from the far wall to another wall, so that the integrand is smooth in each piece. There is no
    /// cut between two of the other walls: the openings of these scenes are too narrow to need one.
    fn pieces(&self, opening: Opening) -> Vec<Opening> {
        let depth_m = WALL_X_M - self.lamp_m.x;
        let cut = |lamp: f64, [low, high]: [f64; 2]| {
            let at = [-1.0, 1.0].map(|side| {
                let edge = lamp + (side - lamp) * depth_m / (depth_m + 2.0);
                edge.clamp(low, high)
            });
            [[low, at[0]], at, [at[1], high]]
        };
        let mut pieces = Vec::new();
        for y_m in cut(self.lamp_m.y, opening.y_m) {
            for z_m in cut(self.lamp_m.z, opening.z_m) {
                if y_m[0] < y_m[1] && z_m[0] < z_m[1] {
                    pieces.push(Opening { y_m, z_m });
                }
            }
        }
        pieces
    }

    /// ∫ cosθ_{Q→P} cosθ_{P→Q} / d_PQ² over the solid angle of a piece as seen from the lamp. Halves the piece until the area that it
    /// lights is small as seen from P.
    fn integral(&self, piece: Opening, p_m: DVec3, normal: DVec3, depth: u32) -> f64 {
        /// Largest size of a lit piece, relative to its distance from P. The error of the quadrature rule falls with the tenth power of the
        /// size.
        const LARGEST: f64 = 0.5;
        /// Down to a thousandth of an opening's length and less, for P in the edge between a lit wall and another one.
        const DEEPEST: u32 = 24;
        let [y, z] = piece.middle_m();
        let q = self.lit(y, z);
        // A wall does not light itself.
        if q.normal.dot(p_m - q.position_m).abs() < 1e-6 {
            return 0.0;
        }
        let ends = |from: [f64; 2], to: [f64; 2]| {
            let [from, to] = [from, to].map(|[y, z]| self.lit(y, z).position_m);
            from.distance(to)
        };
        let along = ends([piece.y_m[0], z], [piece.y_m[1], z]);
        let across = ends([y, piece.z_m[0]], [y, piece.z_m[1]]);
        if along.max(across) > LARGEST * q.position_m.distance(p_m) && depth < DEEPEST {
            let halves = piece.halves().into_iter();
            return halves
                .map(|half| self.integral(half, p_m, normal, depth + 1))
                .sum();
        }
        let [height, width] = [piece.y_m, piece.z_m].map(|[low, high]| 0.5 * (high - low));
        let mut sum = 0.0;
        for (v, weight_v) in gauss_legendre() {
            for (u, weight_u) in gauss_legendre() {
                let (y, z) = (y + v * height, z + u * width);
                sum += weight_u * weight_v * self.integrand(y, z, p_m, normal);
            }
        }
        sum * height * width
    }

    fn integrand(&self, y_m: f64, z_m: f64, p_m: DVec3, normal: DVec3) -> f64 {
        let q = self.lit(y_m, z_m);
        let to_opening = dvec3(WALL_X_M, y_m, z_m) - self.lamp_m;
        let angle_per_area = to_opening.x / to_opening.length().powi(3);
        let offset = p_m - q.position_m;
        let distance_squared = offset.length_squared();
        let cosines = q.normal.dot(offset).max(0.0) * (-normal.dot(offset)).max(0.0);
        angle_per_area * cosines / distance_squared.powi(2)
    }

    /// The point that light through a point of the wall reaches.
    fn lit(&self, y_m: f64, z_m: f64) -> Lit {
        let direction = dvec3(WALL_X_M, y_m, z_m) - self.lamp_m;
        let mut nearest = (f64::INFINITY, DVec3::ZERO);
        for axis in DVec3::AXES {
            let (along, from) = (direction.dot(axis), self.lamp_m.dot(axis));
            // The side of the room that the ray leaves through.
            let distance = (along.signum() - from) / along;
            if along != 0.0 && distance < nearest.0 {
                nearest = (distance, -along.signum() * axis);
            }
        }
        let (distance, normal) = nearest;
        Lit {
            position_m: self.lamp_m + distance * direction,
            normal,
        }
    }
}

/// Five points in −1 to 1 with their weights.
fn gauss_legendre() -> [(f64, f64); 5] {
    let root = 2.0 * (10.0_f64 / 7.0).sqrt();
    let [inner, outer] = [5.0 - root, 5.0 + root].map(|square| square.sqrt() / 3.0);
    let weight = |sign: f64| (322.0 + sign * 13.0 * 70.0_f64.sqrt()) / 900.0;
    [
        (-outer, weight(-1.0)),
        (-inner, weight(1.0)),
        (0.0, 128.0 / 225.0),
        (inner, weight(1.0)),
        (outer, weight(-1.0)),
    ]
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::{hard_cases::scenes::point_light, output::Layer, reference::Reference};

    /// Openings wide enough for the reference to find the light; some pixels are in the edge between a lit wall and another one.
    #[test]
    fn quadrature_agrees_with_paths() {
        let openings = [
            Opening {
                y_m: [-0.9, 0.3],
                z_m: [-0.25, 0.0],
            },
            Opening::slit(0.15, 0.2),
        ];
        let lamp_m = dvec3(-2.1, 0.17, 0.02);
        let lamp = point_light(lamp_m);
        let eye_m = dvec3(-0.7, 0.2, 0.7);
        for look_at_m in [dvec3(0.8, -0.5, -0.1), dvec3(0.1, 0.2, -1.0)] {
            let mut scene = room_behind(&openings, lamp.clone(), eye_m, look_at_m);
            scene.camera.resolution_px = [16, 16];
            let mut reference = Reference::new(&scene, 1024).expect("the scene is valid");
            for _ in 0..8 {
                let go_on = &mut |_| ControlFlow::Continue(());
                reference.add_round(go_on).expect("nothing cancels it");
            }
            let frame = reference.frame();
            let bands = |layer: Layer| frame.values(layer).expect("it is there").chunks_exact(3);
            let behind = BehindOpenings {
                openings: &openings,
                lamp_m,
                power_w: lamp.emission(),
                kd: [0.5; 3],
            };
            let places = bands(Layer::Position).zip(bands(Layer::Normal));
            let found = bands(Layer::Indirect).zip(bands(Layer::StandardError));
            let [mut squares, mut largest, mut off, mut sum] = [0.0_f64; 4];
            for ((position, normal), (mean, standard_error)) in places.zip(found) {
                let vector = |xyz: &[f32]| DVec3::from([0, 1, 2].map(|i| f64::from(xyz[i])));
                let expected = behind.indirect(vector(position), vector(normal))[0];
                let score = (f64::from(mean[0]) - expected) / f64::from(standard_error[0]);
                squares += score * score;
                largest = largest.max(score.abs());
                off += f64::from(mean[0]) - expected;
                sum += expected;
            }
            let variance = squares / 256.0;
            println!(
                "z² {variance:.2}, largest {largest:.1}, bias {:.1e}",
                off / sum
            );
            assert!((0.7..=1.4).contains(&variance), "{variance}");
            assert!(largest <= 6.0, "{largest}");
            assert!((off / sum).abs() <= 3e-3, "{}", off / sum);
        }
    }
}
