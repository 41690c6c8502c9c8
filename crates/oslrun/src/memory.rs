//! The allocator of the command: what it does with freed memory.

/// The largest block whose release raises the threshold of glibc's allocator, minus room for its header: see
/// mallopt(3), `M_MMAP_THRESHOLD`.
const LARGEST_TAUGHT: usize = (32 << 20) - (64 << 10);

/// Makes the allocator keep freed large blocks, up to 64 MB, instead of returning them to the system at once.
///
/// Strings, the vectors of passes, and what is known of pixels are allocated and freed in blocks of some
/// hundred kilobytes. Otherwise each would cost a system call and a fault for each page: two thirds of the
/// time of a shader with many strings. glibc raises its threshold when a large block is freed, so this
/// function frees one, without writing to it. In other allocators this has no effect.
pub fn keep_freed() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGEST_TAUGHT)));
}
