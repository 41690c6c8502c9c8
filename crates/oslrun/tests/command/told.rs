//! The text and messages of shaders in the front ends of the reference's tools: in the order of the points,
//! on both streams, and without repeating a recent message.

use std::fs::File;
use std::process::Command;

/// Both streams of `testshade` in one file, as they were written.
fn both(shader: &str, args: &[&str]) -> String {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("s.osl"), shader).unwrap();
    let path = dir.path().join("log");
    let log = File::create(&path).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
    let command = command.current_dir(dir.path()).arg("testshade").args(args).arg("s");
    let status = command.stdout(log.try_clone().unwrap()).stderr(log).status().unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(status.success(), "{text}");
    text
}

#[test]
fn prints_and_messages_stand_in_the_order_of_the_program() {
    let shader = "shader s(output float f = 0) {\n  float a[2];\n  int i = (int)(3 * u);\n  printf(\"a%d \", i);\n  for (int k = 0; k < 2; k++) {\n    f += a[i + k];\n    printf(\"k%d \", k);\n  }\n  if (i == 1) warning(\"w%d\", i);\n  printf(\"z%d\\n\", i);\n}\n";
    insta::assert_snapshot!("order", both(shader, &["-t", "2", "-g", "3", "1"]));
}

#[test]
fn a_text_comes_again_once_25_others_have_come() {
    // The points print 0 to 29 and then again; a text is forgotten after 25 other ones.
    let shader = "shader s(output float f = 0) { int i = (int)(u * 59 + 0.5); error(\"%d\\n\", i % 30); }";
    let lines = |args: &[&str]| both(shader, args).lines().filter(|l| l.starts_with("ERROR")).count();
    assert_eq!(lines(&["-g", "60", "1"]), 60);
    let few = shader.replace("% 30", "% 25");
    let lines = |args: &[&str]| both(&few, args).lines().filter(|l| l.starts_with("ERROR")).count();
    assert_eq!(lines(&["-g", "60", "1"]), 25);
    assert_eq!(lines(&["-g", "60", "1", "--options", "error_repeats=1"]), 60);
}

#[test]
fn warnings_end_after_their_number() {
    let shader = "shader s(output float f = 0) { warning(\"%g\\n\", u + v * 64); }";
    let lines = |args: &[&str]| both(shader, args).lines().filter(|l| l.starts_with("WARNING")).count();
    assert_eq!(lines(&["-g", "64", "4"]), 100);
    assert_eq!(lines(&["-g", "64", "4", "--options", "max_warnings_per_thread=7"]), 7);
    assert_eq!(lines(&["-g", "64", "4", "--options", "max_warnings_per_thread=0"]), 0);
}

#[test]
fn many_points_are_told_in_pieces_in_their_order() {
    let shader = "shader s(output float f = 0) { if (u == 0) printf(\"%d\\n\", (int)(v * 699 + 0.5)); }";
    let text = both(shader, &["-g", "200", "700"]);
    let told: Vec<usize> = text.lines().filter_map(|line| line.parse().ok()).collect();
    assert_eq!(told, (0..700).collect::<Vec<_>>());
}
