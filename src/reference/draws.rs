//! The random numbers of a sample: points of Owen-scrambled Sobol' nets.

use sobol_burley::sample_4d;

use super::pixel::mix;

/// Uniform numbers in 0 to 1 for one vertex of a sample's path.
#[derive(Debug, Clone, Copy)]
pub struct Draws {
    sample: u32,
    seed: u32,
}

/// For the direction in which a path goes on.
pub struct Onward {
    pub direction: [f64; 2],
    pub lobe: f64,
    pub survival: f64,
}

impl Draws {
    /// For P. Samples with the same seed cover all values evenly.
    pub fn new(sample: u32, seed: u32) -> Draws {
        Draws { sample, seed }
    }

    /// For the vertex after so many others. Its numbers are even in themselves, and independent of those of other vertices.
    pub fn at_vertex(self, vertex: u32) -> Draws {
        match vertex {
            0 => self,
            _ => Draws {
                seed: mix(self.seed, !vertex),
                ..self
            },
        }
    }

    pub fn onward(self) -> Onward {
        let [u, v, lobe, survival] = self.set(0, self.seed);
        Onward {
            direction: [u, v],
            lobe,
            survival,
        }
    }

    /// The place in a pixel's area.
    pub fn footprint(self) -> [f64; 2] {
        let [u, v, ..] = self.set(2, self.seed);
        [u, v]
    }

    /// The direction of a light's ray.
    pub fn emission(self, light: usize) -> [f64; 2] {
        self.of_light(1, light)
    }

    /// The place in a light's area.
    pub fn area(self, light: usize) -> [f64; 2] {
        self.of_light(3, light)
    }

    /// A place on the emissive surfaces, which lights P itself.
    pub fn own(self, light: usize) -> [f64; 2] {
        let [u, v, ..] = self.set(4, mix(self.seed, light as u32));
        [u, v]
    }

    /// Two lights share a set of four dimensions; another seed gives another sequence.
    fn of_light(self, set: u32, light: usize) -> [f64; 2] {
        let [a, b, c, d] = self.set(set, mix(self.seed, light as u32 / 2));
        [[a, b], [c, d]][light % 2]
    }

    fn set(self, set: u32, seed: u32) -> [f64; 4] {
        sample_4d(self.sample, set, seed).map(f64::from)
    }
}
