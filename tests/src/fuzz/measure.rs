//! Processor time and memory of this process, from the system. On systems other than Linux they are unknown.

use std::fs;

/// Processor time in seconds that all threads of this process have used.
pub fn processor_seconds() -> Option<f64> {
    let text = fs::read_to_string("/proc/self/stat").ok()?;
    // After the name, which may contain anything, come the fields from 3 on: user and system time are 14 and
    // 15, in ticks of 10 ms.
    let rest = text.get(text.rfind(')')? + 1..)?;
    let fields: Vec<&str> = rest.split_whitespace().collect();
    let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

/// Peak resident memory in megabytes since the process started or [`forget_peak`] was called.
pub fn peak_megabytes() -> Option<f64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()? / 1024.0)
}

/// Resets the peak of memory.
pub fn forget_peak() {
    let _ = fs::write("/proc/self/clear_refs", "5");
}
