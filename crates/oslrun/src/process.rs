//! What the process needs of the system: a stack, and room for addresses. Without this, a small limit would
//! end the command in the middle of its work, without a message.

use std::io::Write;

/// Bytes of the stack of the main thread, whatever `ulimit -s` says.
const STACK: usize = 8 << 20;

/// The smallest `ulimit -v` in bytes: more than a small shader needs on two threads, which is 80 MB.
const MIN_ADDRESSES: u64 = 128 << 20;

/// Runs the command on a stack of its own, and returns its exit code: 1 with a message if the process lacks
/// memory.
pub(crate) fn on_a_stack(work: impl FnOnce() -> u8 + Send) -> u8 {
    if let Some(limit) = address_limit().filter(|limit| *limit < MIN_ADDRESSES) {
        let need = MIN_ADDRESSES >> 20;
        return refuse(&format!(
            "the process may use {} MB of addresses (`ulimit -v`), and needs {need}",
            limit >> 20
        ));
    }
    std::thread::scope(|scope| {
        let builder = std::thread::Builder::new().name("main".to_string()).stack_size(STACK);
        match builder.spawn_scoped(scope, work) {
            Ok(running) => running.join().unwrap_or(101),
            Err(why) => refuse(&format!("cannot start a thread: {why}")),
        }
    })
}

fn refuse(why: &str) -> u8 {
    let _ = writeln!(std::io::stderr(), "error: {why}");
    1
}

/// The largest size of the process in bytes, if there is a limit that can be known.
#[cfg(target_os = "linux")]
fn address_limit() -> Option<u64> {
    let file = osl_files::open_named(std::path::Path::new("/proc/self/limits")).ok()?;
    let text = file.text(1 << 16).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(not(target_os = "linux"))]
fn address_limit() -> Option<u64> {
    None
}
