//! Work on all cores.

use std::thread;

/// Works on all parts in parallel, on the first one in this thread.
pub(crate) fn for_each_at_once<T: Send>(
    mut parts: impl Iterator<Item = T>,
    work: impl Fn(T) + Sync,
) {
    let first = parts.next();
    thread::scope(|scope| {
        for part in parts {
            let work = &work;
            scope.spawn(move || work(part));
        }
        first.into_iter().for_each(&work);
    });
}
