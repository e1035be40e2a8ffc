//! Random numbers that depend only on the job's seed, the frame and their purpose. A frame is therefore the same on every machine, whatever
//! else the job varies.

use camlux::glam::{DQuat, DVec3};

pub struct Draws(blake3::OutputReader);

impl Draws {
    pub fn new(seed: u32, frame: u64, purpose: &str) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(b"camlux batch draws 1");
        hasher.update(&seed.to_le_bytes());
        hasher.update(&frame.to_le_bytes());
        hasher.update(purpose.as_bytes());
        Draws(hasher.finalize_xof())
    }

    /// Uniform in [0, 1).
    fn unit(&mut self) -> f64 {
        let mut bytes = [0; 8];
        self.0.fill(&mut bytes);
        (u64::from_le_bytes(bytes) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.unit()
    }

    pub fn inside(&mut self, min: DVec3, max: DVec3) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| self.between(min[axis], max[axis])))
    }

    /// A uniformly distributed rotation (Shoemake 1992).
    pub fn rotation(&mut self) -> DQuat {
        let share = self.unit();
        let [a, b] = [0, 1].map(|_| self.between(0.0, std::f64::consts::TAU));
        let [x, y] = [a.sin(), a.cos()].map(|v| v * (1.0 - share).sqrt());
        let [z, w] = [b.sin(), b.cos()].map(|v| v * share.sqrt());
        DQuat::from_xyzw(x, y, z, w)
    }
}
