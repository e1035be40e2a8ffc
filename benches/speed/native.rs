//! The opponent: the Lambert gather, hand-written for AVX2 and FMA, as fast as possible with 256-bit vectors.
//!
//! It computes the formulas of `shaders/gather.wgsl` in f32, for the receivers and VPLs of a rendered frame. It sums in one
//! level and keeps `R` vectors of receivers in registers.

use std::{
    arch::x86_64::*,
    sync::Mutex,
    time::{Duration, Instant},
};

use camlux::{internals::Intermediates, scene::VplSum};

const PI: f64 = std::f64::consts::PI;
/// Receivers that a thread takes at once: a multiple of the block of every kernel.
const CHUNK: usize = 2048;
/// Lanes of a vector.
const LANES: usize = 8;

/// A matte VPL: position Q, normal n_Q, and the light that it sends, as in the shaders.
struct Vpl {
    position: [f32; 3],
    normal: [f32; 3],
    diffuse: [f32; 3],
}

/// The work of one frame with one light and matte surfaces.
pub struct Work {
    estimator: VplSum,
    /// P and n_P, one list per coordinate, padded with points that receive nothing.
    receivers: [Vec<f32>; 6],
    /// k_d/π of each receiver.
    reflectance: Vec<[f64; 3]>,
    vpls: Vec<Vpl>,
}

/// A kernel: the sums of `CHUNK` receivers from the given index, one list per band.
type Kernel = unsafe fn(&Work, usize, &mut [[f32; CHUNK]; 3]);

impl Work {
    /// Takes the receivers and VPLs of a frame.
    pub fn of(kept: &Intermediates, estimator: VplSum) -> Work {
        let mut receivers: [Vec<f32>; 6] = Default::default();
        let mut reflectance = Vec::new();
        for point in kept.gbuffer.iter().flatten() {
            let (p, n) = (point.position_m.as_vec3(), point.normal.as_vec3());
            let coordinates = [p.x, p.y, p.z, n.x, n.y, n.z];
            for (list, coordinate) in receivers.iter_mut().zip(coordinates) {
                list.push(coordinate);
            }
            reflectance.push(point.brdf.kd.map(|kd| kd / PI));
        }
        let padded = reflectance.len().next_multiple_of(CHUNK);
        for list in &mut receivers {
            list.resize(padded, 0.0);
        }
        let light = &kept.lights[0];
        let domain = &light.domain;
        let mut vpls = Vec::new();
        for (texel, emission) in light.rsm.iter().zip(&domain.texels) {
            let Some(texel) = texel else { continue };
            let q = &texel.point;
            let incident = match estimator {
                VplSum::RsmAverage => {
                    let to_light = (domain.origin_m - q.position_m).normalize();
                    let share = emission.measure / domain.total_measure();
                    texel.irradiance_per_intensity * q.normal.dot(to_light).max(0.0) * share
                }
                VplSum::InstantRadiosity => emission.measure * emission.falloff,
            };
            vpls.push(Vpl {
                position: q.position_m.as_vec3().to_array(),
                normal: q.normal.as_vec3().to_array(),
                diffuse: std::array::from_fn(|band| {
                    (q.brdf.kd[band] / PI * incident * domain.axial_intensity[band]) as f32
                }),
            });
        }
        Work {
            estimator,
            receivers,
            reflectance,
            vpls,
        }
    }

    pub fn pairs(&self) -> f64 {
        self.reflectance.len() as f64 * self.vpls.len() as f64
    }

    /// The kernels for the estimator, and the number of vectors of receivers that each keeps in registers.
    fn kernels(&self) -> [(usize, Kernel); 3] {
        match self.estimator {
            VplSum::RsmAverage => [
                (1, gather::<1, true>),
                (2, gather::<2, true>),
                (4, gather::<4, true>),
            ],
            VplSum::InstantRadiosity => [
                (1, gather::<1, false>),
                (2, gather::<2, false>),
                (4, gather::<4, false>),
            ],
        }
    }

    /// The fastest kernel on this machine, from three runs each, or `None` if the CPU lacks AVX2 or FMA.
    pub fn opponent(&self, threads: usize) -> Option<Opponent<'_>> {
        if !(is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")) {
            return None;
        }
        let all = self.kernels().map(|(vectors, kernel)| Opponent {
            work: self,
            threads,
            vectors,
            kernel,
        });
        all.into_iter()
            .min_by_key(|opponent| (0..3).map(|_| opponent.run().0).min())
    }
}

/// A kernel that the CPU can run.
pub struct Opponent<'w> {
    work: &'w Work,
    threads: usize,
    /// Number of vectors of receivers in registers.
    pub vectors: usize,
    kernel: Kernel,
}

impl Opponent<'_> {
    /// Runs the kernel. Returns the time, and the sum of the indirect radiance over all pixels and bands.
    pub fn run(&self) -> (Duration, f64) {
        let chunks = Mutex::new(0..self.work.receivers[0].len() / CHUNK);
        let start = Instant::now();
        let sum = std::thread::scope(|scope| {
            let work = || {
                let mut sum = 0.0;
                let mut radiance = Box::new([[0.0; CHUNK]; 3]);
                loop {
                    let Some(chunk) = chunks.lock().expect("no thread panics").next() else {
                        return sum;
                    };
                    // SAFETY: `Work::opponent` has checked that the CPU has the features that the kernels need.
                    unsafe { (self.kernel)(self.work, chunk * CHUNK, &mut radiance) };
                    sum += self.reflected(chunk * CHUNK, &radiance);
                }
            };
            let threads: Vec<_> = (0..self.threads).map(|_| scope.spawn(work)).collect();
            let join =
                |thread: std::thread::ScopedJoinHandle<f64>| thread.join().expect("no panic");
            threads.into_iter().map(join).sum()
        });
        (start.elapsed(), sum)
    }

    fn reflected(&self, first: usize, radiance: &[[f32; CHUNK]; 3]) -> f64 {
        let points = self.work.reflectance[first..].iter().take(CHUNK);
        points
            .enumerate()
            .map(|(i, kd)| {
                (0..3)
                    .map(|band| kd[band] * f64::from(radiance[band][i]))
                    .sum::<f64>()
            })
            .sum()
    }
}

/// Sums for `CHUNK` receivers from `first`, `R` vectors at once. `AVERAGE` selects rsm-average, otherwise instant-radiosity.
#[target_feature(enable = "avx2,fma")]
fn gather<const R: usize, const AVERAGE: bool>(
    work: &Work,
    first: usize,
    radiance: &mut [[f32; CHUNK]; 3],
) {
    let zero = _mm256_setzero_ps();
    let tiny = _mm256_set1_ps(1e-37);
    for block in (0..CHUNK).step_by(LANES * R) {
        let mut receivers = [[zero; 6]; R];
        for (r, receiver) in receivers.iter_mut().enumerate() {
            for (vector, list) in receiver.iter_mut().zip(&work.receivers) {
                *vector = load(&list[first + block + LANES * r..]);
            }
        }
        let mut sums = [[zero; 3]; R];
        for vpl in &work.vpls {
            let [qx, qy, qz] = broadcast(vpl.position);
            let [mx, my, mz] = broadcast(vpl.normal);
            let diffuse = broadcast(vpl.diffuse);
            for ([px, py, pz, nx, ny, nz], sum) in receivers.iter().zip(&mut sums) {
                let dx = _mm256_sub_ps(qx, *px);
                let dy = _mm256_sub_ps(qy, *py);
                let dz = _mm256_sub_ps(qz, *pz);
                let d2 = dot([dx, dy, dz], [dx, dy, dz]);
                let cos_p = _mm256_max_ps(dot([*nx, *ny, *nz], [dx, dy, dz]), zero);
                let behind = dot([mx, my, mz], [dx, dy, dz]);
                let weight = if AVERAGE {
                    let distance = _mm256_sqrt_ps(_mm256_max_ps(d2, tiny));
                    let is_lit = _mm256_cmp_ps::<_CMP_LT_OQ>(behind, zero);
                    _mm256_and_ps(is_lit, _mm256_div_ps(cos_p, distance))
                } else {
                    let cos_q = _mm256_max_ps(_mm256_sub_ps(zero, behind), zero);
                    let d4 = _mm256_fmadd_ps(d2, d2, tiny);
                    _mm256_div_ps(_mm256_mul_ps(cos_p, cos_q), d4)
                };
                for (sum, diffuse) in sum.iter_mut().zip(diffuse) {
                    *sum = _mm256_fmadd_ps(weight, diffuse, *sum);
                }
            }
        }
        for (r, sum) in sums.iter().enumerate() {
            for (radiance, sum) in radiance.iter_mut().zip(sum) {
                store(*sum, &mut radiance[block + LANES * r..]);
            }
        }
    }
}

#[target_feature(enable = "avx2,fma")]
fn dot(a: [__m256; 3], b: [__m256; 3]) -> __m256 {
    let z = _mm256_mul_ps(a[2], b[2]);
    _mm256_fmadd_ps(a[0], b[0], _mm256_fmadd_ps(a[1], b[1], z))
}

#[target_feature(enable = "avx2")]
fn broadcast([x, y, z]: [f32; 3]) -> [__m256; 3] {
    [_mm256_set1_ps(x), _mm256_set1_ps(y), _mm256_set1_ps(z)]
}

#[target_feature(enable = "avx2")]
fn load(values: &[f32]) -> __m256 {
    let v = &values[..LANES];
    _mm256_setr_ps(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7])
}

#[target_feature(enable = "avx2")]
fn store(vector: __m256, values: &mut [f32]) {
    let v = _mm256_castps_si256(vector);
    let bits = [
        _mm256_extract_epi32::<0>(v),
        _mm256_extract_epi32::<1>(v),
        _mm256_extract_epi32::<2>(v),
        _mm256_extract_epi32::<3>(v),
        _mm256_extract_epi32::<4>(v),
        _mm256_extract_epi32::<5>(v),
        _mm256_extract_epi32::<6>(v),
        _mm256_extract_epi32::<7>(v),
    ];
    for (value, bits) in values.iter_mut().zip(bits) {
        *value = f32::from_bits(bits as u32);
    }
}
