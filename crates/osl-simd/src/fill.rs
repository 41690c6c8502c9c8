//! Loops that set lanes from a function of their index, in a form that the compiler turns into vectors.
//!
//! The slices are separate parameters so that the compiler knows that they do not alias. The loops use an
//! index, because an iterator over the output leaves bounds checks of the inputs in the loop, which then runs
//! its last 64 lanes one by one.

/// Sets each lane.
#[inline(always)]
#[expect(clippy::needless_range_loop, reason = "checks would be left in the loop")]
pub fn fill<T>(out: &mut [T], f: impl Fn(usize) -> T) {
    let n = out.len();
    for i in 0..n {
        out[i] = f(i);
    }
}

/// Sets each lane of three slices, as far as all of them go.
#[inline(always)]
pub fn fill_three<T: Copy>(x: &mut [T], y: &mut [T], z: &mut [T], f: impl Fn(usize) -> [T; 3]) {
    let n = x.len().min(y.len()).min(z.len());
    let (x, y, z) = (&mut x[..n], &mut y[..n], &mut z[..n]);
    for i in 0..n {
        let v = f(i);
        x[i] = v[0];
        y[i] = v[1];
        z[i] = v[2];
    }
}
