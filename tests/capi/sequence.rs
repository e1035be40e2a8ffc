//! The state of a random sequence of calls: which handles it holds and which are gone.

use std::{
    collections::BTreeMap,
    ptr::{null_mut, without_provenance_mut},
};

use crate::host::ok;
use camlux::capi::*;

/// Deterministic random numbers (SplitMix64), so that a failure can be reproduced.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    pub fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    pub fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }

    /// Mostly a usual number; 1 in 40 is extreme or not finite.
    pub fn real(&mut self) -> f64 {
        match self.below(40) {
            0 => self.pick(&[f64::NAN, f64::INFINITY, -1e300, 1e300, 1e13, -0.0, 5e-324]),
            _ => self.below(2001) as f64 / 500.0 - 2.0,
        }
    }

    pub fn reals<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.real())
    }

    pub fn whole(&mut self) -> u32 {
        match self.below(20) {
            0 => self.pick(&[u32::MAX, 1 << 31, 1000]),
            _ => self.below(4) as u32,
        }
    }

    pub fn choice(&mut self) -> i32 {
        match self.below(20) {
            0 => self.pick(&[-1, i32::MAX, i32::MIN, 100]),
            _ => self.below(6) as i32,
        }
    }

    /// A pointer to a struct; 1 in 40 is NULL, and 1 in 40 is misaligned.
    pub fn pointer<T>(&mut self, value: &mut T) -> *mut T {
        match self.below(40) {
            0 => null_mut(),
            1 => (&raw mut *value).wrapping_byte_add(1),
            _ => value,
        }
    }
}

/// The state of a sequence: its live handles with the number of references that it must release, and handles that are gone.
pub struct Sequence {
    pub random: Random,
    pub live: BTreeMap<(usize, usize), u32>,
    /// Live handles of which the test itself holds a reference, which no sequence releases.
    pub lent: Vec<(usize, usize)>,
    pub gone: Vec<usize>,
    pub renders: usize,
    pub statuses: BTreeMap<i32, usize>,
}

pub const DEVICE: usize = 0;
pub const SCENE: usize = 1;
pub const RENDERER: usize = 2;
pub const FRAME: usize = 3;
pub const TOKEN: usize = 4;

/// The maximum number of live objects of a kind, so that most calls are cheap.
pub const MOST_LIVE: usize = 6;

impl Sequence {
    pub fn count(&self, kind: usize) -> usize {
        self.live.keys().filter(|(k, _)| *k == kind).count()
    }

    pub fn handle<T>(&mut self, kind: usize) -> *mut T {
        let of_kind: Vec<usize> = self
            .live
            .keys()
            .filter(|(k, _)| *k == kind)
            .map(|(_, h)| *h)
            .collect();
        let number = match self.random.below(16) {
            0 => 0,
            1 => self.random.next() as usize,
            2 => {
                let all: Vec<usize> = self.live.keys().map(|(_, h)| *h).collect();
                if all.is_empty() {
                    7
                } else {
                    self.random.pick(&all)
                }
            }
            3 if !self.gone.is_empty() => {
                let gone = self.gone.clone();
                self.random.pick(&gone)
            }
            _ if of_kind.is_empty() => 0,
            _ => self.random.pick(&of_kind),
        };
        without_provenance_mut(number)
    }

    pub fn born<T>(&mut self, kind: usize, status: camlux_status, handle: *mut T) {
        if status == CAMLUX_OK {
            self.live.insert((kind, handle.addr()), 1);
        } else {
            assert!(handle.is_null());
        }
    }

    pub fn retain(&mut self, kind: usize) -> camlux_status {
        let handle = self.handle::<()>(kind);
        let status = match kind {
            DEVICE => camlux_device_retain(handle.cast()),
            SCENE => camlux_scene_retain(handle.cast()),
            RENDERER => camlux_renderer_retain(handle.cast()),
            FRAME => camlux_frame_retain(handle.cast()),
            _ => camlux_cancel_token_retain(handle.cast()),
        };
        let known = self.live.get_mut(&(kind, handle.addr()));
        assert_eq!(status == CAMLUX_OK, known.is_some());
        if let Some(references) = known {
            *references += 1;
        }
        status
    }

    fn release_one(kind: usize, handle: usize) -> camlux_status {
        match kind {
            DEVICE => camlux_device_release(without_provenance_mut(handle)),
            SCENE => camlux_scene_release(without_provenance_mut(handle)),
            RENDERER => camlux_renderer_release(without_provenance_mut(handle)),
            FRAME => camlux_frame_release(without_provenance_mut(handle)),
            _ => camlux_cancel_token_release(without_provenance_mut(handle)),
        }
    }

    pub fn release(&mut self, kind: usize) -> camlux_status {
        let handle = self.handle::<()>(kind).addr();
        let lent = self.lent.iter().find(|(_, lent)| *lent == handle);
        if lent.is_some_and(|lent| self.live[lent] == 1) {
            return CAMLUX_OK;
        }
        let status = Self::release_one(kind, handle);
        match self.live.get_mut(&(kind, handle)) {
            Some(references) => {
                assert_eq!(status, CAMLUX_OK);
                *references -= 1;
                if *references == 0 {
                    self.live.remove(&(kind, handle));
                    self.gone.push(handle);
                }
            }
            None => assert_eq!(status == CAMLUX_OK, handle == 0),
        }
        status
    }

    /// Releases all but the test's own references.
    pub fn end(mut self) -> BTreeMap<i32, usize> {
        for lent in std::mem::take(&mut self.lent) {
            let owed = self.live.remove(&lent);
            for _ in 1..owed.expect("the test's own reference is left") {
                ok(Self::release_one(lent.0, lent.1));
            }
        }
        for ((kind, handle), references) in std::mem::take(&mut self.live) {
            for _ in 0..references {
                ok(Self::release_one(kind, handle));
            }
            assert_eq!(Self::release_one(kind, handle), CAMLUX_ERROR_INVALID_HANDLE);
        }
        self.statuses
    }
}
