//! Values that clones of a scene share.

use std::{
    ops::{Deref, DerefMut},
    sync::Arc,
};

/// A value that its clones share until one of them is changed, which copies it first.
///
/// So a clone of a scene costs next to nothing, and a [`Renderer`](crate::Renderer) that keeps one knows without looking
/// what has not changed since: a value that is still shared.
#[derive(Debug, Default, PartialEq)]
pub struct Shared<T>(Arc<T>);

impl<T> Shared<T> {
    /// Whether both are one value, and so equal. Equal values need not be one.
    pub fn is_one(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl<T> Clone for Shared<T> {
    fn clone(&self) -> Self {
        Shared(self.0.clone())
    }
}

impl<T> From<T> for Shared<T> {
    fn from(value: T) -> Self {
        Shared(Arc::new(value))
    }
}

impl<T> Deref for Shared<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: Clone> DerefMut for Shared<T> {
    fn deref_mut(&mut self) -> &mut T {
        Arc::make_mut(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::Shared;

    #[test]
    fn a_change_does_not_reach_the_others() {
        let first = Shared::from(vec![1]);
        let mut second = first.clone();
        assert!(first.is_one(&second));
        second.push(2);
        assert_eq!((&*first, &*second), (&vec![1], &vec![1, 2]));
        assert!(!first.is_one(&second));
    }
}
