//! What a piece of work cost: processor time and peak memory of this process.

use rustix::time::{ClockId, clock_gettime};

/// Processor time of all threads of this process so far \[s\].
pub fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Largest resident memory of this process so far \[MB, 1e6 bytes\]; `None` where the system does
/// not tell.
pub fn peak_rss_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024.0 / 1e6)
}

/// Forgets the largest resident memory so far, where the system lets a process do so: then
/// [`peak_rss_mb`] tells of what comes after.
pub fn forget_peak() {
    // Where it is not possible the peak is that of the whole process, which is never too small.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}
