//! The `oslrun` command.

mod signals;
mod terminal;

use std::process::ExitCode;

/// The largest block whose release raises the threshold of glibc's allocator, minus room for its header: see
/// mallopt(3), `M_MMAP_THRESHOLD`.
const LARGEST_TAUGHT: usize = (32 << 20) - (64 << 10);

/// Makes the allocator keep freed large blocks, up to 64 MB, instead of returning them to the system at once.
///
/// Strings and the vectors of passes are allocated and freed in blocks of some hundred kilobytes. Otherwise
/// each would cost a system call and a fault for each page: two thirds of the time of a shader with many
/// strings. glibc raises its threshold when a large block is freed, so this function frees one, without
/// writing to it. In other allocators this has no effect.
fn keep_freed_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGEST_TAUGHT)));
}

fn main() -> ExitCode {
    keep_freed_memory();
    signals::watch();
    let code = oslrun::cli::main(std::env::args_os(), &mut *terminal::stdout(), &mut *terminal::stderr());
    ExitCode::from(code)
}
