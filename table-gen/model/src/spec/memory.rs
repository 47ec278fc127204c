//! Whether a grid fits in this machine's memory, before hours are spent on finding out.

use std::fs;

/// What synthesis holds for each cell: mask (4 bytes) and rank (2) of up to three laws, and up to 6
/// bytes of eroded sets (a bit each) and of cells that a sweep won. Two laws take 18 to 19 bytes a
/// cell on grids of 11 to 90 million cells.
const BYTES_PER_CELL: u64 = 24;

/// What synthesis needs on any grid: the program, its buffers and its output.
const BYTES_FIXED: u64 = 16 << 20;

/// Assumed where the system does not tell.
const AVAILABLE_BYTES_DEFAULT: u64 = 4 << 30;

/// Estimate in bytes of what synthesis on this many cells needs: 24 bytes a cell and 16 MiB.
pub(super) fn needed_bytes(cells: u64) -> u64 {
    cells
        .saturating_mul(BYTES_PER_CELL)
        .saturating_add(BYTES_FIXED)
}

/// Memory in bytes that a new program may use: `MemAvailable` of `/proc/meminfo`, or 4 GiB where
/// there is none.
pub(super) fn available_bytes() -> u64 {
    fs::read_to_string("/proc/meminfo")
        .ok()
        .and_then(|text| parse_meminfo(&text))
        .unwrap_or(AVAILABLE_BYTES_DEFAULT)
}

fn parse_meminfo(text: &str) -> Option<u64> {
    let rest = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = rest.trim().strip_suffix("kB")?.trim_end().parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meminfo_is_read_in_kibibytes() {
        let text = "MemTotal:       32870000 kB\nMemFree: 1 kB\nMemAvailable:   2048 kB\n";
        assert_eq!(parse_meminfo(text), Some(2 << 20));
        assert_eq!(parse_meminfo("MemTotal: 5 kB\n"), None);
        assert_eq!(parse_meminfo("MemAvailable: many kB\n"), None);
    }

    #[test]
    fn the_estimate_is_linear_and_saturates() {
        assert_eq!(needed_bytes(0), 16 << 20);
        assert_eq!(needed_bytes(1_000_000), 24_000_000 + (16 << 20));
        assert_eq!(needed_bytes(u64::MAX), u64::MAX);
    }
}
