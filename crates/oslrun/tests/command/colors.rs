//! The names of color spaces that the main command knows and the tools do not.

use crate::in_process::oslrun_at;
use std::path::Path;

fn ok(folder: &Path, args: &str) -> String {
    let (code, out, err) = oslrun_at(folder, args);
    assert_eq!((code, err.as_str()), (0, ""), "{args}: {out}");
    out
}

#[test]
fn spaces_of_color_management_have_names_except_in_the_tools() {
    let dir = tempfile::tempdir().unwrap();
    let text = "shader s(string name = \"ACEScg\", output color c = 0, output color made = 0, output color back = 0, output float slope = 0)
{
    color rgb = color(1, 0.5, 0.25);
    c = transformc(\"rgb\", name, rgb);
    back = transformc(name, \"rgb\", c) - rgb;
    made = color(\"srgb_TX\", 0.5, -0.1, 2);
    color moved = transformc(name, \"rgb\", u);
    slope = Dx(moved[0]) / Dx(u);
}\n";
    std::fs::write(dir.path().join("s.osl"), text).unwrap();
    // Names that are known only in the run; colors in such spaces have no derivatives.
    let used =
        text.replace("Dx(moved[0]) / Dx(u)", "1").replace(", name", ", same").replace("(name", "(same");
    let computed = "string same = concat(name, u < 5 ? \"\" : \"?\"); color rgb =";
    std::fs::write(dir.path().join("c.osl"), used.replace("color rgb =", computed)).unwrap();
    let expected = [
        // The sum of each row of the matrix, times the color.
        0.613_097_4 + 0.5 * 0.339_523_15 + 0.25 * 0.047_379_45,
        0.070_193_72 + 0.5 * 0.916_353_9 + 0.25 * 0.013_452_4,
        0.020_615_59 + 0.5 * 0.109_569_77 + 0.25 * 0.869_814_6,
        0.214_041_14,
        -0.1 / 12.923_21,
        4.953_846,
        0.0,
        0.0,
        0.0,
        1.0,
    ];
    for args in ["@/s.osl", "@/c.osl", "@/s.osl -p name=lin_AP1", "@/s.osl --batch 1 --without-pass fold"] {
        let out = ok(dir.path(), &format!("{args} -g 3x1"));
        let low = |line: &str| line.split_once(": ")?.1.split_once(" to ")?.0.parse().ok();
        let found: Vec<f32> = out.lines().filter_map(low).collect();
        assert_eq!(found.len(), expected.len(), "{args}: {out}");
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-5, "{args}: {found} {expected}\n{out}");
        }
    }
    assert_eq!(ok(dir.path(), "check @/s.osl"), "");
    // An unknown name is reported once for each place, with its points.
    let (code, _, err) = oslrun_at(dir.path(), "@/s.osl -g 40x40 -p name=ACESxx");
    let told = err.lines().filter(|line| line.contains("Unknown color space")).count();
    assert!(code == 0 && told == 2 && err.contains("at 1600 of 1600 points"), "{err}");
    for tool in
        ["testshade -g 2 2 -o c null @/s.osl", "testshade --colorspace AdobeRGB -g 2 2 -o c null @/s.osl"]
    {
        let (_, _, err) = oslrun_at(dir.path(), tool);
        assert!(err.contains("Unknown color space transformation \"rgb\" -> \"ACEScg\""), "{tool}: {err}");
    }
}
