//! Values that the clones of a scene share.

use std::{
    ops::{Deref, DerefMut},
    sync::{Arc, OnceLock},
};

use super::{Mesh, bounds::Extent};

/// A value that its clones share. Changing one of them copies the value first.
///
/// So cloning a scene costs almost nothing. A [`Renderer`](crate::Renderer) that keeps a clone detects unchanged values without comparing
/// them: they are still shared.
#[derive(Debug, Default)]
pub struct Shared<T>(Arc<Kept<T>>);

/// The value, and derived data that would take longer than a small frame to compute again.
#[derive(Debug, Clone, Default)]
struct Kept<T> {
    value: T,
    /// For [`Scene::hash`](super::Scene::hash).
    digest: OnceLock<[u8; 32]>,
    /// For meshes.
    extent: OnceLock<Extent>,
}

impl<T> Shared<T> {
    /// The digest of the value. `make` computes it once.
    pub(super) fn digest(&self, make: impl FnOnce(&T) -> [u8; 32]) -> [u8; 32] {
        *self.0.digest.get_or_init(|| make(&self.0.value))
    }

    /// Identifies the value among those that exist at the same time.
    pub(crate) fn id(&self) -> usize {
        Arc::as_ptr(&self.0).addr()
    }

    /// Whether both share one value, and so are equal. Equal values need not be shared.
    pub fn ptr_eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Shared<Mesh> {
    /// The bounds of a mesh of a validated scene.
    pub(super) fn extent(&self) -> &Extent {
        self.0.extent.get_or_init(|| Extent::of(&self.0.value))
    }
}

impl<T: PartialEq> PartialEq for Shared<T> {
    fn eq(&self, other: &Self) -> bool {
        self.ptr_eq(other) || **self == **other
    }
}

impl<T> Clone for Shared<T> {
    fn clone(&self) -> Self {
        Shared(self.0.clone())
    }
}

impl<T> From<T> for Shared<T> {
    fn from(value: T) -> Self {
        Shared(Arc::new(Kept {
            value,
            digest: OnceLock::new(),
            extent: OnceLock::new(),
        }))
    }
}

impl<T> Deref for Shared<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0.value
    }
}

impl<T: Clone> DerefMut for Shared<T> {
    fn deref_mut(&mut self) -> &mut T {
        let kept = Arc::make_mut(&mut self.0);
        (kept.digest, kept.extent) = (OnceLock::new(), OnceLock::new());
        &mut kept.value
    }
}

#[cfg(test)]
mod tests {
    use super::Shared;

    #[test]
    fn a_change_takes_the_digest_along() {
        let digest = |value: &Shared<u8>| value.digest(|value| [*value; 32]);
        let mut first = Shared::from(1);
        assert_eq!(digest(&first), [1; 32]);
        *first = 2;
        assert_eq!(digest(&first), [2; 32]);
        let second = first.clone();
        *first = 3;
        assert_eq!([digest(&first), digest(&second)], [[3; 32], [2; 32]]);
    }
}
