//! Random edits of real shaders: after any sequence of them, the server reports what `oslrun check` does of
//! the text. And how long answers take.

use super::client::{Client, position};
use osl::{Analysis, Levels, ReadOptions};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

const URI: &str = "untitled:a.osl";

/// A sequence of numbers (splitmix64).
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n.max(1) as u64) as usize
    }
}

fn shaders() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl");
    let names = [
        "flakes.osl",
        "sprinkles.osl",
        "chaosmosaic.osl",
        "nodes/mix.osl",
        "nodes/remap.osl",
        "nodes/ramp.osl",
    ];
    names.iter().map(|name| std::fs::read_to_string(folder.join(name)).unwrap()).collect()
}

const PIECES: [&str; 24] = [
    "{",
    "}",
    "(",
    ")",
    ";",
    "\n",
    "\r\n",
    " ",
    "\t",
    "float x = 1;\n",
    "if (u > 0.5) ",
    "noise(P)",
    "\"",
    "//",
    "/*",
    "*/",
    "#define A 1\n",
    "#if 0\n",
    "#endif\n",
    "é",
    "\u{10400}",
    "x",
    "0.5f",
    "[[ string help = \"a\" ]]",
];

/// A change of a text as the protocol has it, and the text after it.
fn change(text: &str, dice: &mut Dice) -> (Value, String) {
    let border = |at: usize| (at..=text.len()).find(|at| text.is_char_boundary(*at)).unwrap_or(0);
    // A position between the two characters of a line end does not exist.
    let border = |at: usize| match border(at) {
        at if text[..at].ends_with('\r') && text[at..].starts_with('\n') => at - 1,
        at => at,
    };
    let start = border(dice.below(text.len() + 1));
    let length = if dice.below(3) == 0 { 0 } else { dice.below(12) };
    let end = border((start + length).min(text.len())).max(start);
    let other = border(dice.below(text.len() + 1));
    let copied = text.get(other..border((other + dice.below(40)).min(text.len())).max(other)).unwrap_or("");
    let new = match dice.below(4) {
        0 => "",
        1 => copied,
        _ => PIECES[dice.below(PIECES.len())],
    };
    let range = json!({ "start": position(text, start), "end": position(text, end) });
    (json!({ "range": range, "text": new }), format!("{}{new}{}", &text[..start], &text[end..]))
}

/// What the compiler reports, in the units of the protocol.
fn expected(text: &str) -> Vec<Value> {
    let found =
        Analysis::of(URI, text, &osl::NoFiles, &ReadOptions::default()).diagnostics(&Levels::default());
    let place = |p: &osl::Position| json!({ "line": p.line - 1, "character": p.utf16 });
    let zero = json!({ "line": 0, "character": 0 });
    let mut list: Vec<Value> = Vec::new();
    for d in found {
        let range = d.range.as_ref().filter(|range| range.file == URI);
        let (start, end) = range.map_or((zero.clone(), zero.clone()), |r| (place(&r.start), place(&r.end)));
        list.push(json!([d.code, d.is_error(), start, end]));
    }
    list
}

fn reported(found: &Value) -> Vec<Value> {
    let list = found.as_array().unwrap().iter();
    list.map(|d| json!([d["code"], d["severity"] == json!(1), d["range"]["start"], d["range"]["end"]]))
        .collect()
}

/// Runs sequences of up to eight edits, and also asks questions at random positions.
fn sequences(count: usize, seed: u64) {
    let shaders = shaders();
    let mut dice = Dice(seed);
    let mut client = Client::start(&json!({ "probe": { "x": 3, "y": 3, "size": 8 } }));
    let mut version = 1;
    client.open(URI, "");
    for n in 0..count {
        let mut text = shaders[dice.below(shaders.len())].replace('\r', "");
        version += 1;
        client.change(URI, version, json!([{ "text": text }]));
        for _ in 0..=dice.below(3) {
            let mut changes = Vec::new();
            for _ in 0..=dice.below(3) {
                let (change, after) = change(&text, &mut dice);
                changes.push(change);
                text = after;
            }
            version += 1;
            client.change(URI, version, json!(changes));
        }
        let mut found = reported(&client.diagnostics(URI, version));
        let mut wanted = expected(&text);
        for list in [&mut found, &mut wanted] {
            list.sort_by_key(Value::to_string);
            list.dedup();
        }
        assert_eq!(found, wanted, "sequence {n} of {seed}:\n{text}");
        if n % 8 == 0 {
            questions(&mut client, &text, &mut dice);
        }
    }
}

/// Asks everything about a text; no answer may be an internal error.
fn questions(client: &mut Client, text: &str, dice: &mut Dice) {
    let at = (dice.below(text.len() + 1)..=text.len()).find(|at| text.is_char_boundary(*at)).unwrap();
    let at = position(text, at);
    let range = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 999, "character": 0 } });
    let asked = json!({ "position": at, "positions": [at], "range": range, "newName": "renamed",
        "context": { "diagnostics": [], "includeDeclaration": true }, "options": { "tabSize": 4, "insertSpaces": true } });
    for method in ALL {
        let answer = client.ask(method, URI, asked.clone());
        assert!(
            answer["code"] != json!(-32603) && answer["code"] != json!(-32602),
            "{method}: {answer}\n{text}"
        );
    }
}

const ALL: [&str; 18] = [
    "hover",
    "completion",
    "signatureHelp",
    "definition",
    "references",
    "documentHighlight",
    "documentSymbol",
    "codeAction",
    "formatting",
    "rangeFormatting",
    "prepareRename",
    "rename",
    "documentLink",
    "documentColor",
    "foldingRange",
    "selectionRange",
    "semanticTokens/full",
    "inlayHint",
];

#[test]
fn edits_in_any_order_are_followed() {
    sequences(2500, 1);
}

#[test]
#[ignore = "takes minutes; OSLRUN_SEED chooses another beginning"]
fn many_edits_in_any_order_are_followed() {
    let seed = std::env::var("OSLRUN_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(2);
    sequences(100_000, seed);
}

/// A shader with about this many lines.
fn long(lines: usize) -> String {
    let mut text = String::from("float mixed(float x, float y) { return mix(x, y, 0.5); }\n");
    text.push_str("shader a(float scale = 2, output float o = 0)\n{\n    color c = 0;\n    float sum = 0;\n");
    for n in 0..lines / 5 {
        text.push_str(&format!(
            "    float v{n} = noise(\"perlin\", P * {n}) * scale;\n    if (v{n} > 0.5) {{\n        \
             sum += mixed(v{n}, smoothstep(0, 1, u));\n        c += color(v{n}, sum, 0.5);\n    }}\n"
        ));
    }
    text.push_str("    o = sum + c[0];\n}\n");
    text
}

#[test]
#[ignore = "measures time: run it with --release, and nothing beside it"]
fn answers_are_quick() {
    for (lines, bound) in [(500, 20), (10_000, 150)] {
        let text = long(lines);
        let mut client = Client::start(&json!({}));
        client.open(URI, &text);
        client.diagnostics(URI, 1);
        let mut slow = Vec::new();
        let middle = position(&text, text.find(&format!("v{} >", lines / 10)).unwrap());
        let end = position(&text, text.len() - 2);
        let asked = json!({ "position": middle, "positions": [middle], "range": { "start": position("", 0), "end": end },
            "newName": "renamed", "context": { "diagnostics": [] }, "options": { "tabSize": 4, "insertSpaces": true } });
        let all = ["diagnostics"].into_iter().chain(ALL);
        for (n, method) in all.enumerate() {
            let mut best = Duration::MAX;
            for round in 0..5 {
                // Each answer is about a text that changed.
                let version = (n * 5 + round + 2) as i32;
                let space = json!({ "start": end, "end": end });
                let began = Instant::now();
                client.change(URI, version, json!([{ "range": space, "text": " " }]));
                if method == "diagnostics" {
                    client.diagnostics(URI, version);
                } else {
                    client.ask(method, URI, asked.clone());
                }
                best = best.min(began.elapsed());
                client.diagnostics(URI, version);
            }
            println!("{lines} lines, {method}: {:.1} ms", best.as_secs_f64() * 1e3);
            if best > Duration::from_millis(bound) {
                slow.push(method);
            }
        }
        assert!(slow.is_empty(), "slower than {bound} ms for {lines} lines: {slow:?}");
    }
}
