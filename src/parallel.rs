//! Work on all cores.

use std::{
    env,
    sync::{LazyLock, Mutex},
    thread,
};

/// Threads for the host's work: as many as lavapipe has. A CPU driver and the host then take turns on the same cores.
pub(crate) fn thread_count() -> usize {
    static COUNT: LazyLock<usize> = LazyLock::new(|| {
        let cores = thread::available_parallelism().map_or(1, usize::from);
        let wanted = env::var("LP_NUM_THREADS").ok();
        wanted_threads(wanted.as_deref(), cores)
    });
    #[cfg(test)]
    if let Some(count) = COUNT_OF_TEST.get() {
        return count;
    }
    *COUNT
}

/// The threads that a value of `LP_NUM_THREADS` requests, at most one for each core. Without a number: all.
fn wanted_threads(wanted: Option<&str>, cores: usize) -> usize {
    let count = wanted.and_then(|text| text.parse().ok());
    count.unwrap_or(cores).clamp(1, cores)
}

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

/// Works on many parts with all threads. Each takes the next part when it is done with one.
pub(crate) fn for_each<T: Send>(
    parts: impl ExactSizeIterator<Item = T> + Send,
    work: impl Fn(T) + Sync,
) {
    let threads = thread_count().min(parts.len());
    let parts = Mutex::new(parts);
    for_each_at_once(0..threads, |_| {
        while let Some(part) = parts.lock().map_or(None, |mut parts| parts.next()) {
            work(part);
        }
    });
}

#[cfg(test)]
thread_local! {
    static COUNT_OF_TEST: std::cell::Cell<Option<usize>> = const { std::cell::Cell::new(None) };
}

/// Does work with another number of threads.
#[cfg(test)]
pub(crate) fn with_threads<T>(count: usize, work: impl FnOnce() -> T) -> T {
    COUNT_OF_TEST.set(Some(count));
    let done = work();
    COUNT_OF_TEST.set(None);
    done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_host_has_the_threads_of_lavapipe() {
        let counts = [
            None,
            Some("2"),
            Some("0"),
            Some("64"),
            Some("-1"),
            Some("all"),
        ];
        let counts = counts.map(|wanted| wanted_threads(wanted, 4));
        assert_eq!(counts, [4, 2, 1, 4, 4, 4]);
    }

    #[test]
    fn every_part_is_worked_on_once() {
        for threads in [1, 2, 5] {
            let mut parts = [0; 100];
            with_threads(threads, || for_each(parts.iter_mut(), |part| *part += 1));
            assert_eq!(parts, [1; 100]);
        }
        for_each([0_u32; 0].iter(), |_| unreachable!());
    }
}
