//! Values that clones of a scene share.

use std::{
    ops::{Deref, DerefMut},
    sync::{Arc, OnceLock},
};

use super::{Mesh, bounds::Extent};

/// A value that its clones share until one of them is changed, which copies it first.
///
/// So a clone of a scene costs next to nothing, and a [`Renderer`](crate::Renderer) that keeps one knows without looking
/// what has not changed since: a value that is still shared.
#[derive(Debug, Default)]
pub struct Shared<T>(Arc<Kept<T>>);

/// With what would take longer than a small frame to find out again.
#[derive(Debug, Clone, Default)]
struct Kept<T> {
    value: T,
    /// For [`Scene::hash`](super::Scene::hash).
    digest: OnceLock<[u8; 32]>,
    /// Of a mesh.
    extent: OnceLock<Extent>,
}

impl<T> Shared<T> {
    /// The digest that `make` makes of the value, made once.
    pub(super) fn digest(&self, make: impl FnOnce(&T) -> [u8; 32]) -> [u8; 32] {
        *self.0.digest.get_or_init(|| make(&self.0.value))
    }

    /// Tells values apart that are there at the same time.
    pub(crate) fn id(&self) -> usize {
        Arc::as_ptr(&self.0).addr()
    }

    /// Whether both are one value, and so equal. Equal values need not be one.
    pub fn ptr_eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Shared<Mesh> {
    /// Of a mesh of a validated scene.
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
