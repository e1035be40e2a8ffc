//! Free memory of the host, which CPU drivers allocate from. The heap size that they report is arbitrary.

use std::fs;

/// Free bytes, or the bytes that this process may use if that is less; `None` if the system does not report them (only Linux does).
pub(super) fn available_bytes() -> Option<u64> {
    let free = in_meminfo(&fs::read_to_string("/proc/meminfo").ok()?)?;
    // The file is absent, or holds "max", outside of containers.
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
