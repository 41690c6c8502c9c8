//! `docs/questions.md`: fifteen questions about a shader, each with the command that answers it and its
//! output.
//!
//! `UPDATE_DOCS=1` writes the page and its pictures. Numbers that depend on the machine are not compared.

#![allow(clippy::unwrap_used, missing_docs, reason = "a test says what must hold")]

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A question, and the command that answers it.
struct Question {
    asks: &'static str,
    /// What to do, in plain words.
    how: &'static str,
    /// The shader, in `docs/questions`; may be empty.
    shader: &'static str,
    args: &'static str,
    shows: Shows,
    /// How to read the answer.
    reads: &'static str,
}

/// Which part of the output the page shows.
enum Shows {
    All,
    /// Lines that begin so; their numbers depend on the machine.
    Timed(&'static str),
    /// Lines that begin so.
    Begins(&'static str),
    /// The picture that the command writes.
    Picture(&'static str),
}

const QUESTIONS: [Question; 15] = [
    Question {
        asks: "Why is this line an error, and how do I fix it?",
        how: "`check` names the place, the reason, and often the repair. `oslrun explain-error E0201` explains the kind of \
              error with a wrong and a right example.",
        shader: "error",
        args: "check docs/questions/error.osl",
        shows: Shows::All,
        reads: "The marks under the line are the place. The second part is the repaired line.",
    },
    Question {
        asks: "Which function is called, and why this one?",
        how: "Many functions have several forms: `noise` has 24. `explain` shows which form a call uses, with its \
              arguments and its result.",
        shader: "overload",
        args: "explain docs/questions/overload.osl --uv 0.3,0.7 -g 256x256",
        shows: Shows::All,
        reads: "Both lines have the same argument. The result is assigned to a color in the first and to a float in \
                the second, so the first calls the form that returns a color. `oslrun doc noise` lists all forms.",
    },
    Question {
        asks: "What is the value of this variable at this pixel?",
        how: "`explain` runs the shader at one point and prints every value. `--at 76,178` chooses a pixel by column and \
              row, `--uv 0.3,0.7` the pixel that is closest to these coordinates.",
        shader: "",
        args: "explain examples/steps.osl --at 5,9 -g 16x16",
        shows: Shows::All,
        reads: "Several values in a row are the values that the variable had one after the other.",
    },
    Question {
        asks: "Which branch was taken, and how often did the loop run?",
        how: "The same command says it below each `if` and each loop.",
        shader: "loop",
        args: "explain docs/questions/loop.osl --uv 0.3,0.7 -g 256x256",
        shows: Shows::All,
        reads: "Other points take other branches: ask for another pixel.",
    },
    Question {
        asks: "What does `noise(\"cell\", p)` return, in which range, and what does it look like?",
        how: "`oslrun doc noise` has a table of all fields with their ranges. The quickest way to see one is a shader of \
              one line.",
        shader: "cells",
        args: "docs/questions/cells.osl -g 256x256 -o docs/images/questions.cells.png",
        shows: Shows::Picture("docs/images/questions.cells.png"),
        reads: "One value from 0 to 1 for each cell; as a color, three of them. Without `-o`, the command prints the range \
                of each output instead.",
    },
    Question {
        asks: "Point, vector or normal: what changes under `transform`?",
        how: "Give an object space that stretches and moves, and transform the same three numbers as each type. \
              `oslrun doc transform` has the rule.",
        shader: "spaces",
        args: "explain docs/questions/spaces.osl -g 16x16 --object-space 2,0,0,0,0,0.5,0,0,0,0,1,0,5,0,0,1",
        shows: Shows::All,
        reads: "The space doubles x, halves y and moves by 5 along x. The point (1 1 0) is stretched and moved: (7 0.5 0). \
                The vector is stretched, but not moved: (2 0.5 0). The normal is stretched the other way, (0.5 2 0), so \
                that it stays perpendicular to the surface.",
    },
    Question {
        asks: "What is the derivative here, and where does it come from?",
        how: "`explain --derivatives` shows below each variable how it changes with u and v and from pixel to pixel, and \
              through which variables. `Dx(y)` in a shader is the change to the next pixel.",
        shader: "slope",
        args: "explain docs/questions/slope.osl --derivatives -g 256x256",
        shows: Shows::All,
        reads: "y = sin(6 u), so d/du is 6 cos(6 u) = -5.95. From one pixel to the next, u grows by 1/255, so y changes by \
                -5.95 / 255 = -0.0233: that is `Dx(y)`. To follow the chain further, look up the variables after `through`. \
                `oslrun doc sin` has the derivative of each function. Where the language gives another derivative than mathematics, as for `atan2` and for colors in a named space, `explain` says so.",
    },
    Question {
        asks: "What did the compiler throw away, and why?",
        how: "Only what the requested outputs need is computed. `explain --outputs height` says below each line whether it is \
              needed, and why not.",
        shader: "needed",
        args: "explain docs/questions/needed.osl --outputs height -g 256x256",
        shows: Shows::All,
        reads: "`height` alone was requested, so `grain` and `tint` are not computed. `quality` is 0 in this run, so the branch \
                with `bumps` is never taken, and `bumps` is not computed either. `explain` follows these lines all the same, \
                to show their values. `oslrun ir --stage after` shows all that is left: u.",
    },
    Question {
        asks: "What does this line cost?",
        how: "`--profile` measures each line and each instruction. Its first sentence names the line that costs most, \
              or says which lines are equal within the noise.",
        shader: "cost",
        args: "docs/questions/cost.osl --profile",
        shows: Shows::Timed("Most of the time"),
        reads: "(The sentence about the second line and the tables are left out here.) Five times noise in three dimensions costs far more than a sine. \
                On a busy machine times mislead: `oslrun explain docs/questions/cost.osl --cost` ranks the lines by their operations, without a clock.",
    },
    Question {
        asks: "Where do I lose digits?",
        how: "`stability` runs the shader in single and in double precision and names the lines to blame.",
        shader: "digits",
        args: "stability docs/questions/digits.osl --no-params --budget 60",
        shows: Shows::All,
        reads: "A float has about seven digits. 10000.3 spends five of them before the point, and the subtraction shows that \
                only two or three are left. `explain --f64` shows the same at one pixel.",
    },
    Question {
        asks: "Does anything divide by zero, overflow, or leave a function's domain?",
        how: "`sanitize` follows points of the picture and counts such events by line.",
        shader: "events",
        args: "sanitize docs/questions/events.osl -g 65x65 --budget 600",
        shows: Shows::All,
        reads: "The last line of each event is an example, with the operands at its first pixel. OSL defines a result for \
                everything, so the picture has no hole; but half of the rays are black, and the numbers of the cells are not \
                what the formula says. [accuracy.md](accuracy.md#numeric-events-by-line) lists the kinds of events.",
    },
    Question {
        asks: "How many samples do I need for an error of 2 %?",
        how: "`tradeoff` tries many settings and compares them with an almost exact picture.",
        shader: "",
        args: "tradeoff docs/questions/ball.osl -g 16x16 --budget 40",
        shows: Shows::Timed("For "),
        reads: "(The table before is left out here.) Each line is the fastest setting that keeps this error at 999 of 1000 \
                pixels, with its time. `--samples N` takes N samples in every pixel; `--max-error 2%` takes \
                many only where they are needed; `--within 5s` takes as many as fit into a time.",
    },
    Question {
        asks: "What does it look like on a sphere?",
        how: "`--preview` shows a sphere on a floor, under a lamp and a sky. `--on` names another surface: `torus`, `cube`, `plane`, \
              `cylinder`, or a mesh from a file.",
        shader: "ball",
        args: "docs/questions/ball.osl --preview -g 160x160 --samples 4 -o docs/images/questions.ball.png",
        shows: Shows::Picture("docs/images/questions.ball.png"),
        reads: "The first color output is the color of the surface; `--base`, `--bump`, `--normal`, `--roughness` and `--displace` \
                name outputs for other roles. A surface shader that writes `Ci` is shown as it is. (Without `--samples`, the \
                picture has less noise.) `--on sphere` without `--preview` shows the values of the outputs, without light.",
    },
    Question {
        asks: "Does this hold at every point, or only at those of my picture?",
        how: "`sanitize` counts what happens at the points of a picture. `bounds` proves what holds at all points, and with \
              `--over` for all values of a parameter between two.",
        shader: "safe",
        args: "bounds docs/questions/safe.osl --over radius=0.1:0.5 --budget 60",
        shows: Shows::All,
        reads: "`mask` and `angle` are in [0, 1] for every float u, v and radius in these ranges, and `acos` and the division are \
                safe, thanks to the `clamp` and the `if`. The root is not: the report names a point with a negative argument. \
                `height` is still never NaN, because OSL defines such a root as 0. A statement under `Not proven` may hold: \
                the enclosures of intervals are wider than the values. [accuracy.md](accuracy.md#proven-bounds) says how it works.",
    },
    Question {
        asks: "Which simpler shader is as good from far away?",
        how: "Where a pixel covers many cells of a pattern, one sample of it is mostly noise, and its mean is closer to the right \
              picture. `lod` finds from which size of a pixel on this holds, and `-o far.lod.osl` writes one shader that fades \
              to the means there.",
        shader: "far",
        args: "lod docs/questions/far.osl --budget 120",
        shows: Shows::Begins("from size "),
        reads: "(The table that follows is left out here: for footprints 1 to 256, the errors and times with and without levels.) A \
                size is that of a pixel in `P`; a pattern of 12 cells has a cell every 0.083. Both errors are against many \
                samples of the original, at points that were not used to find the level. At footprint 1 the original \
                runs, with the same bits. The written shader uses derivatives only, so it works in every renderer. \
                `--html levels.html` shows both side by side.",
    },
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The output of a question's command, both streams. Pictures go to a folder.
fn answer(question: &Question, pictures: &Path) -> String {
    let args: Vec<String> = question
        .args
        .split(' ')
        .map(|arg| match arg.strip_prefix("docs/images/") {
            Some(name) => pictures.join(name).display().to_string(),
            None => arg.to_string(),
        })
        .collect();
    let output = Command::new(env!("CARGO_BIN_EXE_oslrun")).args(&args).current_dir(root()).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap() + &String::from_utf8(output.stderr).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let shown: Vec<&str> = match question.shows {
        Shows::All => lines,
        Shows::Timed(start) | Shows::Begins(start) => {
            lines.into_iter().filter(|line| line.starts_with(start)).collect()
        }
        Shows::Picture(_) => Vec::new(),
    };
    assert!(!shown.is_empty() || matches!(question.shows, Shows::Picture(_)), "{}: {text}", question.args);
    shown.join("\n").trim_end().to_string()
}

/// The page, and the pictures with their paths in the project.
fn page() -> (String, Vec<(&'static str, Vec<u8>)>) {
    let dir = tempfile::tempdir().unwrap();
    let mut page = String::from(
        "# Fifteen questions about a shader\n\nEach question has one command. The outputs on this page are real: a test compares them with what the \
         command prints\n(`UPDATE_DOCS=1 cargo test --release -p oslrun --test questions` writes the page). Times are those of a release build.\n",
    );
    let mut pictures = Vec::new();
    for (at, question) in QUESTIONS.iter().enumerate() {
        let _ = write!(page, "\n## {}. {}\n\n{}\n\n", at + 1, question.asks, question.how);
        if !question.shader.is_empty() {
            let path = root().join(format!("docs/questions/{}.osl", question.shader));
            let text = std::fs::read_to_string(path).unwrap();
            let _ = write!(page, "```osl\n{}\n```\n\n", text.trim_end());
        }
        let answer = answer(question, dir.path());
        let _ = write!(page, "```\n$ oslrun {}\n", question.args);
        if !answer.is_empty() {
            let _ = writeln!(page, "{answer}");
        }
        page.push_str("```\n");
        if let Shows::Picture(path) = question.shows {
            let name = path.strip_prefix("docs/").unwrap();
            let _ = write!(page, "\n![the picture]({name})\n");
            let file = dir.path().join(path.strip_prefix("docs/images/").unwrap());
            pictures.push((path, std::fs::read(file).unwrap()));
        }
        if !question.reads.is_empty() {
            let _ = write!(page, "\n{}\n", question.reads);
        }
    }
    (page, pictures)
}

/// The page without the numbers that depend on the machine.
fn comparable(page: &str) -> String {
    let timed = |line: &&str| {
        QUESTIONS.iter().any(|q| matches!(q.shows, Shows::Timed(start) if line.starts_with(start)))
    };
    let without = |line: &str| {
        line.split_once(if line.starts_with("For") { ": " } else { ", " }).unwrap().0.to_string()
    };
    page.lines()
        .map(|line| if timed(&line) { without(line) } else { line.to_string() })
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn the_page_is_current() {
    let (page, pictures) = page();
    let path = root().join("docs/questions.md");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &page).unwrap();
        for (path, bytes) in &pictures {
            std::fs::write(root().join(path), bytes).unwrap();
        }
    }
    let held = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        comparable(&held) == comparable(&page),
        "docs/questions.md is not current: run this test with UPDATE_DOCS=1"
    );
    for (path, bytes) in pictures {
        assert!(std::fs::read(root().join(path)).unwrap() == bytes, "{path} is not current");
    }
}
