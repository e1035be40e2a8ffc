//! A bush of flat leaves, as OBJ text. Each leaf is a square with an alpha texture.

use std::fmt::Write;

const LEAVES: u32 = 260;
/// Edge length of a leaf's square.
const LEAF_M: f64 = 0.15;
/// Size of the bush.
const RADIUS_M: f64 = 0.42;
/// Coordinates are whole tenths of a millimetre, so that every machine writes the same file.
const UNITS_PER_M: f64 = 1.0e4;

/// The bush around the origin.
pub fn obj() -> String {
    let mut text = "# Leaves, unit 1/10 mm. Made by examples/generate_scenes.\n\
        mtllib leaves.mtl\nusemtl leaf\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
        .to_string();
    let mut random = Random(1);
    for leaf in 0..LEAVES {
        // On the outside, where the light is.
        let out = random.direction();
        let centre = out.map(|c| c * RADIUS_M * (0.6 + 0.4 * random.unit()));
        let along = normalized(cross(random.direction(), out));
        let across = cross(out, along);
        for [x, y] in [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]] {
            // The tip bends inwards, the sides bend upwards.
            let lift = 0.35 * y + 0.2;
            let [x, y, z] = [0, 1, 2].map(|i| {
                let corner = centre[i] + LEAF_M * (x * across[i] + y * along[i] - lift * out[i]);
                (corner * UNITS_PER_M).round() as i64
            });
            writeln!(text, "v {x} {y} {z}").expect("a String takes all that is written to it");
        }
        let [a, b, c, d] = [1, 2, 3, 4].map(|corner| 4 * leaf + corner);
        writeln!(text, "f {a}/1 {b}/2 {c}/3 {d}/4")
            .expect("a String takes all that is written to it");
    }
    text
}

/// Knuth's linear congruential generator of MMIX.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / f64::from(1 << 24)
    }

    /// Uniformly distributed over the sphere.
    fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = [(); 3].map(|()| 2.0 * self.unit() - 1.0);
            let square: f64 = v.iter().map(|c| c * c).sum();
            if (0.01..1.0).contains(&square) {
                return normalized(v);
            }
        }
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn normalized(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    v.map(|c| c / length)
}
