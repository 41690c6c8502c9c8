//! `--osl-version`.

use crate::in_process::oslrun_at;
use std::path::Path;

fn ok(folder: &Path, args: &str) -> String {
    let (code, out, err) = oslrun_at(folder, args);
    assert_eq!((code, err.as_str()), (0, ""), "{args}: {out}");
    out
}

#[test]
fn versions_differ_in_their_macros_and_in_linearstep() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(int asks = 0, float low = 1, output float r = 0, output color c = 0, output normal n = 0, output float slope = 0,
    output int version = 0, output int parts = 0, output int of_renderer = 0)
{
    version = OSL_VERSION;
    r = linearstep(low, 0, 0.25 + 0 * u);
    c = linearstep(color(low), color(0), color(0.25, 0.5, 0.75));
    n = linearstep(normal(low), normal(0), normal(2));
    slope = Dx(linearstep(low, 0, u)) / Dx(u);
    parts = 10000 * OSL_VERSION_MAJOR + 100 * OSL_VERSION_MINOR + OSL_VERSION_PATCH;
    if (asks) getattribute(\"osl:version\", of_renderer);
}\n";
    std::fs::write(dir.path().join("s.osl"), text).unwrap();
    let values = |version: &str, more: &str| {
        let out = ok(dir.path(), &format!("@/s.osl -g 3x1 {version} {more}"));
        let low = |line: &str| line.split_once(": ")?.1.split_once(" to ")?.0.parse().ok();
        out.lines().filter_map(low).collect::<Vec<f32>>()
    };
    let old = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 11312.0, 11312.0, 0.0];
    let new = [0.75, 0.75, 0.5, 0.25, 0.0, 0.0, 0.0, -1.0, 11502.0, 11502.0, 0.0];
    for (version, more, expected) in [
        ("", "", old),
        ("--osl-version 1.13", "", old),
        ("--osl-version 1.15", "", new),
        ("--osl-version 1.15", "--batch 1 --without-pass fold", new),
    ] {
        assert_eq!(values(version, more), expected, "{version} {more}");
    }
    // Where the edges ascend, both are the same ramp.
    assert_eq!(values("", "-p low=-1")[..7], values("--osl-version 1.15", "-p low=-1")[..7]);
    assert_eq!(ok(dir.path(), "check --osl-version 1.15 @/s.osl"), "");
    for (version, r) in [("1.13", "-0"), ("1.15", "0.75")] {
        let line = format!(
            "testshade --osl-version {version} -g 1 1 --print --param asks 1 -o r null -o of_renderer null @/s.osl"
        );
        let out = ok(dir.path(), &line);
        let number = if version == "1.13" { 11312 } else { 11502 };
        assert!(
            out.contains(&format!("r : {r}\n")) && out.contains(&format!("of_renderer : {number}\n")),
            "{out}"
        );
        ok(dir.path(), &format!("oslc -q --osl-version {version} -o @/c.oso @/s.osl"));
        let compiled = ok(dir.path(), "@/c.oso -g 3x1");
        assert!(compiled.contains(&format!("version: {number} ")), "{compiled}");
    }
    for args in
        ["@/s.osl --osl-version 1.14", "oslc --osl-version 2 @/s.osl", "testshade --osl-version x @/s.osl"]
    {
        let (code, _, err) = oslrun_at(dir.path(), args);
        assert!(code != 0 && err.contains("the versions of the language are 1.13 and 1.15"), "{args}: {err}");
    }
}
