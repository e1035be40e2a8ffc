//! The host's memory, of which CPU drivers are made. What they call their heap is a number of their own choice.

use std::fs;

/// Bytes that are free, or that this process may use if that is less; `None` where the system does not tell (it is Linux that does).
pub(super) fn available_bytes() -> Option<u64> {
    let free = in_meminfo(&fs::read_to_string("/proc/meminfo").ok()?)?;
    // Absent, or "max", outside of containers.
    let allowed = fs::read_to_string("/sys/fs/cgroup/memory.max");
    let allowed = allowed.ok().and_then(|text| text.trim().parse().ok());
    Some(free.min(allowed.unwrap_or(u64::MAX)))
}

fn in_meminfo(text: &str) -> Option<u64> {
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_memory_is_found_among_the_lines() {
        let text = "MemTotal:       16000000 kB\nMemFree:  5 kB\nMemAvailable:    8000000 kB\nBuffers: 1 kB\n";
        assert_eq!(in_meminfo(text), Some(8_000_000 * 1024));
        assert_eq!(in_meminfo("MemTotal: 16000000 kB\n"), None);
        assert_eq!(in_meminfo("MemAvailable: many kB\n"), None);
    }
}
