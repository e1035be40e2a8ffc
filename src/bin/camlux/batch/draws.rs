//! Random numbers that depend on the job's seed, the frame and what they are for, and on nothing else: so a frame is the same whoever
//! renders it, and whatever else the job varies.

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

    /// Even from 0 to 1, without 1.
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

    /// Every rotation is as likely as any other (Shoemake 1992).
    pub fn rotation(&mut self) -> DQuat {
        let share = self.unit();
        let [a, b] = [0, 1].map(|_| self.between(0.0, std::f64::consts::TAU));
        let [x, y] = [a.sin(), a.cos()].map(|v| v * (1.0 - share).sqrt());
        let [z, w] = [b.sin(), b.cos()].map(|v| v * share.sqrt());
        DQuat::from_xyzw(x, y, z, w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_even_and_depend_on_seed_frame_and_purpose() {
        let draw = |seed, frame, purpose| Draws::new(seed, frame, purpose).between(2.0, 4.0);
        let first = draw(1, 2, "a");
        assert_eq!(first, draw(1, 2, "a"));
        for other in [draw(2, 2, "a"), draw(1, 3, "a"), draw(1, 2, "b")] {
            assert_ne!(first, other);
        }
        let values: Vec<f64> = (0..10_000).map(|frame| draw(7, frame, "c")).collect();
        assert!(values.iter().all(|value| (2.0..4.0).contains(value)));
        let mean = values.iter().sum::<f64>() / 1e4;
        // Six standard errors of the mean of a width of 2.
        assert!(
            (mean - 3.0).abs() < 6.0 * 2.0 / 12_f64.sqrt() / 100.0,
            "{mean}"
        );
    }

    /// The mean of a rotated axis vanishes, and so does each component of the mean quaternion.
    #[test]
    fn rotations_have_no_favourite() {
        let rotations: Vec<DQuat> = (0..10_000)
            .map(|frame| Draws::new(3, frame, "turn").rotation())
            .collect();
        assert!(rotations.iter().all(|q| (q.length() - 1.0).abs() < 1e-15));
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let mean = rotations.iter().map(|q| *q * axis).sum::<DVec3>() / 1e4;
            assert!(mean.length() < 6.0 / 100.0, "{axis}: {mean}");
        }
    }
}
