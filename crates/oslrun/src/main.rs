//! The `oslrun` command.

mod signals;
mod terminal;

use std::process::ExitCode;

/// The largest block whose release teaches glibc's allocator, with room for its head: see mallopt(3), `M_MMAP_THRESHOLD`.
const LARGEST_TAUGHT: usize = (32 << 20) - (64 << 10);

/// Makes the allocator keep large blocks that are freed, up to 64 MB, instead of returning them to the system at once.
///
/// Strings and the vectors of passes come and go in blocks of some hundred kilobytes. Each costs a call of the system and a
/// fault for each page otherwise: two thirds of the time of a shader that makes such strings. glibc raises its
/// threshold when a large block is freed, so one is, which nobody touches. Other allocators do not care.
fn keep_freed_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGEST_TAUGHT)));
}

fn main() -> ExitCode {
    keep_freed_memory();
    signals::watch();
    let code = oslrun::cli::main(std::env::args_os(), &mut *terminal::stdout(), &mut *terminal::stderr());
    ExitCode::from(code)
}
