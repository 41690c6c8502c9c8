//! The hash of strings: 64-bit FarmHash, the empty string 0.

/// The hash.
pub fn hash(s: &str) -> u64 {
    if s.is_empty() { 0 } else { farmhash::hash64(s.as_bytes()) }
}

#[cfg(test)]
mod tests {
    #[test]
    fn known() {
        assert_eq!(super::hash("foo") as u32 as i32, 798_196_707);
    }
}
