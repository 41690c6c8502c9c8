//! The eye above the patch.

use crate::in_process::oslrun_at;
use std::path::Path;

/// The ranges of the channels that a run prints: name, smallest and largest value.
fn ranges(folder: &Path, args: &str) -> Vec<(String, f32, f32)> {
    let (code, out, err) = oslrun_at(folder, args);
    assert_eq!(code, 0, "{args}: {err}");
    let line = |line: &str| {
        let (name, rest) = line.split_once(": ")?;
        let (low, rest) = rest.split_once(" to ")?;
        let (high, _) = rest.split_once(", mean")?;
        Some((name.to_string(), low.parse().ok()?, high.parse().ok()?))
    };
    out.lines().filter_map(line).collect()
}

#[test]
fn the_patch_is_seen_from_above_except_in_the_tool() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(output normal n = 0, output vector i = 0) { n = faceforward(normal(0, 0, -2), I); i = I + Dx(I) + Dy(I); }";
    std::fs::write(dir.path().join("s.osl"), text).unwrap();
    let of = |args: &str| ranges(dir.path(), args).into_iter().map(|(_, low, _)| low).collect::<Vec<_>>();
    assert_eq!(of("@/s.osl -g 4x4"), [0.0, 0.0, 2.0, 0.0, 0.0, -1.0]);
    assert_eq!(of("@/s.osl -g 4x4 --global I=0,0,0"), [0.0, 0.0, -2.0, 0.0, 0.0, 0.0]);
    assert_eq!(of("@/s.osl -g 4x4 --global I=0,0,3"), [0.0, 0.0, -2.0, 0.0, 0.0, 3.0]);
    let (code, out, _) = oslrun_at(dir.path(), "testshade -g 1 1 --print -o i null -o n null @/s.osl");
    assert!(code == 0 && out.contains("i : 0 0 0") && out.contains("n : 0 0 -2"), "{out}");
}
