//! Shader cases. A case is `FOLDER/NAME.osl`, with directives in its first lines (`//@ grid W H`,
//! `//@ center`, `//@ include DIR`). Next to it are the recordings of the reference: `NAME.csv` (`x,y,u,v`
//! and one column per component), `NAME.out` (printed text), `NAME.err` (errors and warnings of the run) and
//! `NAME.compile` (exit code and messages of the compiler); missing files mean that there was no such output.

use crate::{OSLRUN, data, names_in};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Integers in files of floats are divided by this number.
const LARGEST_INT: f64 = 2_147_483_647.0;

/// All cases, as `FOLDER/NAME`.
pub(crate) fn cases() -> Vec<String> {
    let root = data("corpus");
    let in_folder = |folder: String| {
        let names = names_in(&root.join(&folder)).into_iter();
        names
            .filter_map(move |name| name.strip_suffix(".osl").map(|stem| format!("{folder}/{stem}")))
            .collect::<Vec<_>>()
    };
    names_in(&root).into_iter().flat_map(in_folder).collect()
}

/// The differences between a case and its recording.
pub(crate) fn check(case: &str) -> Vec<String> {
    let source = data("corpus").join(case).with_extension("osl");
    let folder = source.parent().unwrap().canonicalize().unwrap();
    let stem = source.file_stem().unwrap().to_string_lossy().into_owned();
    let text = fs::read_to_string(&source).unwrap();
    let target = tempfile::tempdir().unwrap();
    let recorded = |ending: &str| fs::read_to_string(source.with_extension(ending)).unwrap_or_default();

    let compiled = compile_all(&folder, target.path(), &stem, directive(&text, "include"));
    let should_fail = recorded("compile").lines().next().is_some_and(|line| line != "exit 0");
    if compiled.status.success() == should_fail {
        return vec![format!("compiles differently: {}", String::from_utf8_lossy(&compiled.stdout))];
    }
    if should_fail {
        return Vec::new();
    }

    let table = Table::read(&recorded("csv"));
    let mut arguments: Vec<String> = ["testshade", "-t", "1", "-od", "float", "-g"].map(String::from).into();
    arguments.extend(directive(&text, "grid").unwrap_or("4 4").split_whitespace().map(String::from));
    arguments.extend(directive(&text, "center").map(|_| "-center".to_owned()));
    for output in table.outputs() {
        arguments.extend(["-o".to_owned(), output.to_owned(), format!("{output}.exr")]);
    }
    arguments.push(stem);
    let run = Command::new(OSLRUN).args(&arguments).current_dir(target.path()).output().unwrap();

    let mut differences = table.differences(target.path(), &text);
    differences.extend(text_differences(&run, &recorded("out"), &recorded("err")));
    differences
}

/// The text after `//@ NAME`, if the source has that directive.
fn directive<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let lines = text.lines().filter_map(|line| line.strip_prefix("//@ "));
    lines.filter_map(|line| line.strip_prefix(name)).map(str::trim).next()
}

/// Compiles every shader of a folder into another folder, and returns the output for the named shader.
fn compile_all(folder: &Path, target: &Path, stem: &str, include: Option<&str>) -> Output {
    let mut wanted = None;
    for name in names_in(folder) {
        let Some(other) = name.strip_suffix(".osl") else { continue };
        let mut command = Command::new(OSLRUN);
        command.args(["oslc", "-q"]);
        if let Some(include) = include {
            command.arg(format!("-I{}", folder.join(include).display()));
        }
        command
            .arg(format!("-I{}", folder.display()))
            .arg("-o")
            .arg(target.join(format!("{other}.oso")))
            .arg(&name);
        let output = command.current_dir(folder).output().unwrap();
        if other == stem {
            wanted = Some(output);
        }
    }
    wanted.unwrap()
}

/// Compares the text and messages of the run with the recording: printed lines in order, messages as a set.
fn text_differences(run: &Output, out: &str, err: &str) -> Vec<String> {
    let (printed, said) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    let is_message = |line: &&str| line.starts_with("ERROR") || line.starts_with("WARNING");
    let of_shader = |line: &&str| {
        let names_an_image = line.starts_with("Output ") && line.contains(" to ");
        !(line.trim().is_empty() || line.starts_with("No output copy for ") || names_an_image)
    };
    let printed: Vec<&str> = printed.lines().filter(of_shader).collect();
    let lines: Vec<&str> = printed.iter().copied().filter(|line| !is_message(line)).collect();
    let messages: BTreeSet<&str> = said
        .lines()
        .filter(|line| !line.trim().is_empty())
        .chain(printed.iter().copied().filter(is_message))
        .collect();
    let mut differences = Vec::new();
    let expected: Vec<&str> = out.lines().collect();
    if lines != expected {
        differences.push(format!("prints {lines:?}, not {expected:?}"));
    }
    let expected: BTreeSet<&str> = err.lines().collect();
    if messages != expected {
        differences.push(format!("reports {messages:?}, not {expected:?}"));
    }
    differences
}

/// Recorded values: one column per component, one row per point.
struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<f32>>,
}

impl Table {
    /// Reads the table. Its first line contains the grid, its second the columns; the first four are
    /// coordinates.
    fn read(text: &str) -> Self {
        let mut lines = text.lines().skip(1);
        let columns = lines.next().unwrap_or_default().split(',').skip(4).map(String::from).collect();
        let row = |line: &str| line.split(',').skip(4).map(|word| word.parse().unwrap()).collect();
        Self { columns, rows: lines.map(row).collect() }
    }

    /// The outputs of the columns, each once.
    fn outputs(&self) -> Vec<&str> {
        let mut outputs: Vec<&str> = self.columns.iter().map(|column| output_of(column)).collect();
        outputs.dedup();
        outputs
    }

    /// The differences between the pictures in a folder and the table. `source` shows which outputs are ints.
    fn differences(&self, folder: &Path, source: &str) -> Vec<String> {
        let mut differences = Vec::new();
        for output in self.outputs() {
            let Ok(image) = osl_image::read_image(&folder.join(format!("{output}.exr"))) else {
                differences.push(format!("no picture of {output}"));
                continue;
            };
            let of_output = self.columns.iter().enumerate().filter(|(_, column)| output_of(column) == output);
            let channels = in_order(&image.channels);
            let declared = format!("output int {output}");
            let is_int = source
                .split(&declared)
                .skip(1)
                .any(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'));
            for (channel, (index, column)) in channels.into_iter().zip(of_output) {
                let plane = image.plane(channel);
                for (point, (row, &got)) in self.rows.iter().zip(&plane).enumerate() {
                    let got = if is_int { (f64::from(got) * LARGEST_INT).round() as f32 } else { got };
                    if !near(row[index], got) {
                        differences.push(format!("{column} at point {point}: {got}, not {}", row[index]));
                        break;
                    }
                }
            }
        }
        differences
    }
}

/// `x` of `x.r` and `x[3]`.
fn output_of(column: &str) -> &str {
    column.split(['.', '[']).next().unwrap_or(column)
}

/// The channels of a file in the order of the output's components: R, G, B, A, then by number.
fn in_order(channels: &[String]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..channels.len()).collect();
    order.sort_by_key(|&channel| {
        let name = channels[channel].as_str();
        let digits: String = name.chars().filter(char::is_ascii_digit).collect();
        ["R", "G", "B", "A"].iter().position(|&known| known == name).or(digits.parse().ok()).unwrap_or(0)
    });
    order
}

/// Within 1e-6, or two units in the last place.
fn near(expected: f32, got: f32) -> bool {
    expected == got
        || (expected - got).abs() <= (2.5e-7 * expected.abs()).max(1e-6)
        || (expected.is_nan() && got.is_nan())
}
