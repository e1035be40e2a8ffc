//! A fluted tube along a trefoil knot, as OBJ text, with any number of triangles.

use std::f64::consts::TAU;
use std::fmt::Write;

type Vector = [f64; 3];

/// Rings along the knot and vertices around the tube, for the knot in the repository: quads of about 13 mm × 13 mm.
const RINGS: usize = 500;
const SIDES: usize = 52;

/// The centre line winds twice around the axis of a torus of these radii and three times about its tube.
const TORUS_MAJOR_M: f64 = 0.46;
const TORUS_MINOR_M: f64 = 0.22;

const TUBE_RADIUS_M: f64 = 0.115;
const FLUTE_DEPTH_M: f64 = 0.012;
const FLUTES: f64 = 6.0;
/// Whole turns of the flutes (times `FLUTES`) over the knot's length; an integer, so that the ends meet.
const FLUTE_TURNS: f64 = 30.0;

/// Coordinates are whole hundredths of a millimetre. This keeps the file short and independent of the machine: the last bit of the
/// platform's sine differs between machines.
const UNITS_PER_M: f64 = 1.0e5;

/// The knot around the origin, with its axis along z. Its quads face outwards and have no normals (flat shading), which halves the size of
/// the file.
pub fn obj() -> String {
    obj_of("26 000", RINGS, SIDES)
}

/// The same knot, in the same proportions, with about `triangle_count` triangles, at least 24.
pub fn obj_of_about(triangle_count: usize) -> String {
    let sides_squared = (triangle_count * SIDES) as f64 / (2 * RINGS) as f64;
    let sides = (sides_squared.sqrt().round() as usize).max(3);
    let rings = (triangle_count / (2 * sides)).max(4);
    obj_of(&(rings * sides).to_string(), rings, sides)
}

fn obj_of(quad_count: &str, rings: usize, sides: usize) -> String {
    let mut text = format!(
        "# Fluted trefoil knot, {quad_count} quads, unit 1/100 mm. Made by examples/generate_scenes.\no knot\n",
    );
    for ring in 0..rings {
        for side in 0..sides {
            let along = TAU * ring as f64 / rings as f64;
            let around = TAU * side as f64 / sides as f64;
            let [x, y, z] = surface_m(along, around).map(|c| (c * UNITS_PER_M).round() as i64);
            writeln!(text, "v {x} {y} {z}").expect("a String takes all that is written to it");
        }
    }
    let index = |ring: usize, side: usize| 1 + (ring % rings) * sides + side % sides;
    for ring in 0..rings {
        for side in 0..sides {
            let quad = [
                index(ring, side),
                index(ring, side + 1),
                index(ring + 1, side + 1),
                index(ring + 1, side),
            ];
            let [a, b, c, d] = quad;
            writeln!(text, "f {a} {b} {c} {d}").expect("a String takes all that is written to it");
        }
    }
    text
}

/// Point of the tube's surface; both parameters in [0, 2π).
fn surface_m(along: f64, around: f64) -> Vector {
    let (centre, tangent, torus_normal) = centre_line(along);
    // Uses the normal of the torus, which returns to itself after one round; a frame carried along the curve would not.
    let out = normalized(torus_normal);
    let side = normalized(cross(tangent, out));
    let radius_m = TUBE_RADIUS_M + FLUTE_DEPTH_M * (FLUTES * around + FLUTE_TURNS * along).cos();
    let (sin, cos) = around.sin_cos();
    std::array::from_fn(|i| centre[i] + radius_m * (cos * out[i] + sin * side[i]))
}

/// Position, tangent (d position/dt) and the torus' normal at parameter t of the (2, 3) torus knot.
fn centre_line(t: f64) -> (Vector, Vector, Vector) {
    let (sin_2t, cos_2t) = (2.0 * t).sin_cos();
    let (sin_3t, cos_3t) = (3.0 * t).sin_cos();
    let radius_m = TORUS_MAJOR_M + TORUS_MINOR_M * cos_3t;
    let radius_slope = -3.0 * TORUS_MINOR_M * sin_3t;
    (
        [radius_m * cos_2t, radius_m * sin_2t, TORUS_MINOR_M * sin_3t],
        [
            radius_slope * cos_2t - 2.0 * radius_m * sin_2t,
            radius_slope * sin_2t + 2.0 * radius_m * cos_2t,
            3.0 * TORUS_MINOR_M * cos_3t,
        ],
        [cos_3t * cos_2t, cos_3t * sin_2t, sin_3t],
    )
}

fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn normalized(v: Vector) -> Vector {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    v.map(|c| c / length)
}
