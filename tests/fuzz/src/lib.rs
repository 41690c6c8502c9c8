//! Shared by all targets: a door, and mutations of its inputs that know lines and words as well as bytes.

pub use libfuzzer_sys;
pub use osl_tests;

/// A target: the door of this name.
#[macro_export]
macro_rules! target {
    ($door:ident) => {
        use $crate::libfuzzer_sys::{self, fuzz_mutator, fuzz_target, fuzzer_mutate};

        fuzz_target!(|data: &[u8]| {
            $crate::osl_tests::doors::$door(data);
        });

        fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
            $crate::change(stringify!($door), data, size, max_size, seed)
                .unwrap_or_else(|| fuzzer_mutate(data, size, max_size))
        });
    };
}

/// Mutates an input in place, and returns its new length; `None` means that the usual mutations are to be
/// used, which happens every second time.
pub fn change(door: &str, data: &mut [u8], size: usize, max_size: usize, seed: u32) -> Option<usize> {
    use osl_tests::fuzz::mutate::{Random, mutate};
    let door = osl_tests::doors::find(door)?;
    let mut random = Random::new(u64::from(seed));
    if random.below(2) == 0 {
        return None;
    }
    let old = data.get(..size)?.to_vec();
    let new = mutate(&mut random, &old, &old, door.words, max_size.min(data.len()));
    data.get_mut(..new.len())?.copy_from_slice(&new);
    Some(new.len())
}
