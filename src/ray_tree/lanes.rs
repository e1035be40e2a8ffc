//! Eight floats at a time: the arithmetic of [`WideTree`](super::wide::WideTree), with the vector units that this machine has.
//!
//! Every operation is one of IEEE 754 without contraction, so results do not depend on the machine.

#[cfg(target_arch = "x86_64")]
use pulp::NullaryFnOnce;

pub(super) const LANES: usize = 8;

/// A way to compute with eight floats. `F` is what holds them.
pub(super) trait Lanes: Copy {
    type F: Copy;

    fn splat(self, value: f32) -> Self::F;
    fn load(self, values: &[f32; LANES]) -> Self::F;
    fn store(self, values: Self::F) -> [f32; LANES];
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// The lesser of two numbers that are not NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    fn abs(self, a: Self::F) -> Self::F;
    /// `a` with its sign flipped where that of `sign` is negative.
    fn flip(self, a: Self::F, sign: Self::F) -> Self::F;
    /// A bit for each lane with a ≤ b.
    fn le(self, a: Self::F, b: Self::F) -> u32;
    /// A bit for each lane with a < b.
    fn lt(self, a: Self::F, b: Self::F) -> u32;
}

/// Arrays, for any machine.
#[derive(Clone, Copy)]
pub(super) struct Plain;

#[inline(always)]
fn each(a: [f32; LANES], b: [f32; LANES], f: impl Fn(f32, f32) -> f32) -> [f32; LANES] {
    std::array::from_fn(|lane| f(a[lane], b[lane]))
}

#[inline(always)]
fn bits(a: [f32; LANES], b: [f32; LANES], f: impl Fn(f32, f32) -> bool) -> u32 {
    (0..LANES).fold(0, |bits, lane| {
        bits | u32::from(f(a[lane], b[lane])) << lane
    })
}

impl Lanes for Plain {
    type F = [f32; LANES];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        [value; LANES]
    }
    #[inline(always)]
    fn load(self, values: &[f32; LANES]) -> Self::F {
        *values
    }
    #[inline(always)]
    fn store(self, values: Self::F) -> [f32; LANES] {
        values
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        each(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        a.map(f32::abs)
    }
    #[inline(always)]
    fn flip(self, a: Self::F, sign: Self::F) -> Self::F {
        let signed = |a: f32, sign: f32| f32::from_bits(a.to_bits() ^ (sign.to_bits() & 1 << 31));
        each(a, sign, signed)
    }
    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> u32 {
        bits(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> u32 {
        bits(a, b, |a, b| a < b)
    }
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V3 {
    type F = pulp::f32x8;

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        self.splat_f32x8(value)
    }
    #[inline(always)]
    fn load(self, values: &[f32; LANES]) -> Self::F {
        pulp::cast(*values)
    }
    #[inline(always)]
    fn store(self, values: Self::F) -> [f32; LANES] {
        pulp::cast(values)
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        self.add_f32x8(a, b)
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        self.sub_f32x8(a, b)
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        self.mul_f32x8(a, b)
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        self.div_f32x8(a, b)
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        self.min_f32x8(a, b)
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        self.max_f32x8(a, b)
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        self.abs_f32x8(a)
    }
    #[inline(always)]
    fn flip(self, a: Self::F, sign: Self::F) -> Self::F {
        let sign = self.and_f32x8(sign, self.splat_f32x8(-0.0));
        self.xor_f32x8(a, sign)
    }
    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> u32 {
        let is_le = self
            .avx
            ._mm256_cmp_ps::<{ std::arch::x86_64::_CMP_LE_OQ }>(pulp::cast(a), pulp::cast(b));
        self.avx._mm256_movemask_ps(is_le) as u32
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> u32 {
        let is_lt = self
            .avx
            ._mm256_cmp_ps::<{ std::arch::x86_64::_CMP_LT_OQ }>(pulp::cast(a), pulp::cast(b));
        self.avx._mm256_movemask_ps(is_lt) as u32
    }
}

/// Work that is compiled for each way to compute.
pub(super) trait WithLanes {
    fn with<L: Lanes>(self, lanes: L);
}

/// Does the work in the fastest way that this machine has.
pub(super) fn compute(work: impl WithLanes) {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        struct Wide<W>(W, pulp::x86::V3);
        impl<W: WithLanes> NullaryFnOnce for Wide<W> {
            type Output = ();

            #[inline(always)]
            fn call(self) {
                self.0.with(self.1);
            }
        }
        return simd.vectorize(Wide(work, simd));
    }
    work.with(Plain);
}
