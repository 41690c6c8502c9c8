//! The choice of instruction set: detected once, then passed as a value that proves its presence; and
//! registers of eight or sixteen words.
//!
//! The unsafe code is the calls of functions compiled for a feature set that the [`Isa`] proves, the
//! registers of `narrow` and `wide`, and a conversion to integers that compiles to one vector instruction.
//! This crate must not know what is computed.

#![expect(unsafe_code, reason = "feature sets are proved by a value, and one conversion by a comparison")]

mod fill;
#[cfg(target_arch = "x86_64")]
pub mod narrow;
#[cfg(target_arch = "x86_64")]
pub mod registers;
#[cfg(target_arch = "x86_64")]
pub mod wide;

pub use fill::{fill, fill_three};

/// An instruction set that this machine has.
///
/// The field is private and every constructor detects the features, so that a value is proof of their
/// presence.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Isa(Level);

#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Level {
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// Loops are compiled as for the baseline, which has these vectors. But products and sums may be fused,
    /// and there is machine code.
    #[cfg(target_arch = "aarch64")]
    Neon,
}

/// Work that is compiled for each instruction set.
pub trait Kernel {
    /// Its result.
    type Output;
    /// The work. Mark it `#[inline(always)]`, and everything that its loops call: functions that are not
    /// inlined are compiled for the baseline.
    fn run(self) -> Self::Output;
}

/// Work that is compiled with fused multiply-add for the instruction sets that have it, and without for the
/// others. Mark both functions `#[inline(always)]`, as with [`Kernel`].
pub trait FusedKernel {
    /// The work, fused.
    fn fused(self);
    /// The work, not fused.
    fn plain(self);
}

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
struct Fused<K>(K);

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
impl<K: FusedKernel> Kernel for Fused<K> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.0.fused();
    }
}

impl Isa {
    /// The baseline of the architecture.
    pub fn baseline() -> Isa {
        Isa(Level::Baseline)
    }

    /// The widest instruction set of this machine.
    pub fn detect() -> Isa {
        Isa::all().last().copied().unwrap_or(Isa(Level::Baseline))
    }

    /// All instruction sets of this machine, narrowest first.
    pub fn all() -> Vec<Isa> {
        let mut all = vec![Isa(Level::Baseline)];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
            {
                all.push(Isa(Level::Avx2));
                if ["avx512f", "avx512bw", "avx512dq", "avx512vl", "avx512cd"].iter().all(|f| has(f)) {
                    all.push(Isa(Level::Avx512));
                }
            }
        }
        #[cfg(target_arch = "aarch64")]
        all.push(Isa(Level::Neon));
        all
    }

    /// The instruction set with a name, if this machine has it.
    pub fn from_name(name: &str) -> Option<Isa> {
        Isa::all().into_iter().find(|isa| isa.name() == name)
    }

    /// `baseline`, `avx2`, `avx512` or `neon`.
    pub fn name(self) -> &'static str {
        match self.0 {
            Level::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => "avx512",
            #[cfg(target_arch = "aarch64")]
            Level::Neon => "neon",
        }
    }

    /// The proof for registers of sixteen words, if this is AVX-512.
    #[cfg(target_arch = "x86_64")]
    #[inline]
    pub fn wide(self) -> Option<wide::Wide> {
        // Only `all` makes a value of this level, after it has detected the features.
        (self.0 == Level::Avx512).then(wide::Wide::detected)
    }

    /// The proof for registers of eight words, if this is AVX2.
    #[cfg(target_arch = "x86_64")]
    #[inline]
    pub fn narrow(self) -> Option<narrow::Narrow> {
        // As above.
        (self.0 == Level::Avx2).then(narrow::Narrow::detected)
    }

    /// Runs the kernel as compiled for this instruction set.
    #[inline]
    pub fn dispatch<K: Kernel>(self, kernel: K) -> K::Output {
        self.dispatch_if_wide(kernel).unwrap_or_else(run_baseline)
    }
}

impl Isa {
    /// Runs the kernel as compiled for the widest instruction set if this is it, else for the baseline. This
    /// halves the code to compile, for work that is rare or mostly calls other functions.
    #[inline]
    pub fn dispatch_widest<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            // SAFETY: only `all` makes a value of this level, after it has detected every feature that the
            // function is compiled for.
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => unsafe { run_avx512(kernel) },
            _ => run_baseline(kernel),
        }
    }

    /// Runs the kernel as compiled for this instruction set, but as for AVX2 if it is AVX-512. This saves a
    /// third of the code to compile and the slowest part of compiling it, for loops that machine code made
    /// while running replaces as soon as they matter.
    #[inline]
    pub fn dispatch_to_avx2<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            // SAFETY: only `all` makes a value of these levels, after it has detected every feature that the
            // function is compiled for.
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 => unsafe { run_avx2(kernel) },
            _ => run_baseline(kernel),
        }
    }

    /// Runs the kernel as compiled for this instruction set, except for the baseline of x86-64, for which
    /// large kernels would take much code that few machines run. Then it returns the kernel, which has not
    /// run.
    ///
    /// # Errors
    /// The kernel, on a machine without wider registers.
    #[inline]
    pub fn dispatch_if_wide<K: Kernel>(self, kernel: K) -> Result<K::Output, K> {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Baseline => Err(kernel),
            #[cfg(not(target_arch = "x86_64"))]
            Level::Baseline => Ok(run_baseline(kernel)),
            #[cfg(target_arch = "aarch64")]
            Level::Neon => Ok(run_baseline(kernel)),
            // SAFETY: only `all` makes a value of this level, after it has detected every feature that the
            // function is compiled for.
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => Ok(unsafe { run_avx2(kernel) }),
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => Ok(unsafe { run_avx512(kernel) }),
        }
    }

    /// Runs a kernel with fused multiply-add if this instruction set has it, as for AVX2 if it is AVX-512.
    /// Otherwise runs the plain kernel, as compiled for the baseline.
    #[inline]
    pub fn dispatch_fused<K: FusedKernel>(self, kernel: K) {
        match self.0 {
            // SAFETY: only `all` makes a value of these levels, after it has detected the features; `fma` is
            // detected here.
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 | Level::Avx512 if is_x86_feature_detected!("fma") => unsafe {
                run_avx2_fma(Fused(kernel));
            },
            #[cfg(target_arch = "aarch64")]
            Level::Neon => run_baseline(Fused(kernel)),
            _ => kernel.plain(),
        }
    }

    /// `out[i] = table[index[i]]`, up to the length of the shorter slice; an index beyond the table selects
    /// its last word. Uses one instruction per vector where the instruction set has one.
    #[inline]
    pub fn look_up(self, table: &[u32; 16], index: &[u32], out: &mut [u32]) {
        match self.0 {
            // SAFETY: only `all` makes a value of this level, after it has detected the features.
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => unsafe { look_up_avx512(table, index, out) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => unsafe { look_up_avx2(table, index, out) },
            #[cfg(target_arch = "aarch64")]
            Level::Neon => look_up_neon(table, index, out),
            Level::Baseline => look_up(table, index, out),
        }
    }
}

fn look_up(table: &[u32; 16], index: &[u32], out: &mut [u32]) {
    for (o, i) in out.iter_mut().zip(index) {
        *o = table[(*i).min(15) as usize];
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn look_up_avx512(table: &[u32; 16], index: &[u32], out: &mut [u32]) {
    use std::arch::x86_64::{
        _mm512_loadu_si512, _mm512_min_epu32, _mm512_permutexvar_epi32, _mm512_set1_epi32,
        _mm512_storeu_si512,
    };
    // SAFETY: the table has the sixteen words that are read.
    let words = unsafe { _mm512_loadu_si512(table.as_ptr().cast()) };
    let n = index.len().min(out.len());
    let (index, index_rest) = index[..n].as_chunks::<16>();
    let (out, out_rest) = out[..n].as_chunks_mut::<16>();
    for (to, at) in out.iter_mut().zip(index) {
        // SAFETY: both chunks have sixteen words.
        unsafe {
            let at = _mm512_min_epu32(_mm512_loadu_si512(at.as_ptr().cast()), _mm512_set1_epi32(15));
            let found = _mm512_permutexvar_epi32(at, words);
            _mm512_storeu_si512(to.as_mut_ptr().cast(), found);
        }
    }
    look_up(table, index_rest, out_rest);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn look_up_avx2(table: &[u32; 16], index: &[u32], out: &mut [u32]) {
    use std::arch::x86_64::{
        _mm256_blendv_ps, _mm256_castsi256_ps, _mm256_loadu_ps, _mm256_loadu_si256, _mm256_min_epu32,
        _mm256_permutevar8x32_ps, _mm256_set1_epi32, _mm256_slli_epi32, _mm256_storeu_ps,
    };
    let (low, high) = table.split_at(8);
    // SAFETY: each half of the table has the eight words that are read.
    let (low, high) =
        unsafe { (_mm256_loadu_ps(low.as_ptr().cast()), _mm256_loadu_ps(high.as_ptr().cast())) };
    let n = index.len().min(out.len());
    let (index, index_rest) = index[..n].as_chunks::<8>();
    let (out, out_rest) = out[..n].as_chunks_mut::<8>();
    for (to, at) in out.iter_mut().zip(index) {
        // SAFETY: both chunks have eight words.
        unsafe {
            let at = _mm256_min_epu32(_mm256_loadu_si256(at.as_ptr().cast()), _mm256_set1_epi32(15));
            // Each half is looked up by the lowest three bits; the fourth, as a sign, selects the half.
            let (first, second) = (_mm256_permutevar8x32_ps(low, at), _mm256_permutevar8x32_ps(high, at));
            let is_high = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(at));
            let found = _mm256_blendv_ps(first, second, is_high);
            _mm256_storeu_ps(to.as_mut_ptr().cast(), found);
        }
    }
    look_up(table, index_rest, out_rest);
}

#[cfg(target_arch = "aarch64")]
fn look_up_neon(table: &[u32; 16], index: &[u32], out: &mut [u32]) {
    use std::arch::aarch64::{
        vaddq_u32, vdupq_n_u32, vld1q_u8_x4, vld1q_u32, vminq_u32, vmulq_n_u32, vqtbl4q_u8,
        vreinterpretq_u8_u32, vreinterpretq_u32_u8, vst1q_u32,
    };
    // SAFETY: the table has the 64 bytes that are read. Every processor with this architecture has the
    // instructions of this function.
    let words = unsafe { vld1q_u8_x4(table.as_ptr().cast()) };
    let n = index.len().min(out.len());
    let (index, index_rest) = index[..n].as_chunks::<4>();
    let (out, out_rest) = out[..n].as_chunks_mut::<4>();
    for (to, at) in out.iter_mut().zip(index) {
        // SAFETY: both chunks have four words.
        unsafe {
            let at = vminq_u32(vld1q_u32(at.as_ptr()), vdupq_n_u32(15));
            // The instruction selects bytes: the four of each word.
            let bytes = vaddq_u32(vmulq_n_u32(at, 0x0404_0404), vdupq_n_u32(0x0302_0100));
            let found = vqtbl4q_u8(words, vreinterpretq_u8_u32(bytes));
            vst1q_u32(to.as_mut_ptr(), vreinterpretq_u32_u8(found));
        }
    }
    look_up(table, index_rest, out_rest);
}

impl std::fmt::Debug for Isa {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(target_arch = "x86_64")]
fn has(feature: &str) -> bool {
    match feature {
        "avx512f" => is_x86_feature_detected!("avx512f"),
        "avx512bw" => is_x86_feature_detected!("avx512bw"),
        "avx512dq" => is_x86_feature_detected!("avx512dq"),
        "avx512vl" => is_x86_feature_detected!("avx512vl"),
        "avx512cd" => is_x86_feature_detected!("avx512cd"),
        _ => false,
    }
}

// A kernel that dispatches another one stays apart from it: without `never`, a function for an instruction
// set would also contain what it calls, and compiling a function takes more than twice the time if it is
// twice as large.
#[inline(never)]
fn run_baseline<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

// No FMA in these two lists: fusing would change the bits.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2")]
#[inline(never)]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,avx512f,avx512bw,avx512dq,avx512vl,avx512cd")]
#[inline(never)]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

// For arithmetic whose bits may differ between machines.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,fma")]
#[inline(never)]
fn run_avx2_fma<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

/// Truncation to an integer; −2³¹ for NaN and for values beyond `i32`. A cast with `as` saturates instead,
/// which prevents vectorisation.
#[inline(always)]
pub fn to_int(x: f32) -> i32 {
    let fits = (-2_147_483_648.0..2_147_483_648.0).contains(&x);
    let x = if fits { x } else { -2_147_483_648.0 };
    // SAFETY: after the line above the number is from −2³¹ to below 2³¹, never NaN.
    unsafe { x.to_int_unchecked() }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sum<'a>(&'a [f32], &'a mut [f32]);

    impl Kernel for Sum<'_> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            for (o, x) in self.1.iter_mut().zip(self.0) {
                *o = x * x + 1.0;
            }
        }
    }

    #[test]
    fn conversion_covers_every_float() {
        for bits in (0..=u32::MAX).step_by(4999) {
            let x = f32::from_bits(bits);
            let expected = if x.is_nan() || x >= 2_147_483_648.0 { i32::MIN } else { x as i32 };
            assert_eq!(to_int(x), expected, "{x:e}");
        }
    }

    #[test]
    fn words_are_looked_up() {
        // Any word, also one that is no ordinary float.
        let table: [u32; 16] = std::array::from_fn(|i| 0x7fa0_0000 + i as u32);
        let index: Vec<u32> = (0..1003).map(|i| if i % 97 == 0 { u32::MAX - i } else { i % 19 }).collect();
        for isa in Isa::all() {
            for n in [0, 1, 7, 8, 15, 16, 33, index.len()] {
                let mut out = vec![0; n];
                isa.look_up(&table, &index, &mut out);
                let expected: Vec<u32> = index.iter().take(n).map(|i| table[(*i).min(15) as usize]).collect();
                assert_eq!(out, expected, "{isa:?}, {n}");
            }
        }
    }

    #[test]
    fn every_level_runs_and_agrees() {
        let input: Vec<f32> = (0..1000).map(|i| i as f32 * 0.37).collect();
        let mut first = vec![0.0; 1000];
        Isa::baseline().dispatch(Sum(&input, &mut first));
        for isa in Isa::all() {
            let mut out = vec![0.0; 1000];
            isa.dispatch(Sum(&input, &mut out));
            assert_eq!(out, first, "{isa:?}");
            assert_eq!(Isa::from_name(isa.name()), Some(isa));
        }
    }
}
