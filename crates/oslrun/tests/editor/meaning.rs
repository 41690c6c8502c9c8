//! Hover, signature help, completion and hints.

use super::client::{Client, at, lines, position};
use serde_json::{Value, json};
use std::fmt::Write;

const URI: &str = "untitled:a.osl";

const TEXT: &str = "#define TWICE(x) (2 * (x))
// One of the slots.
struct slot { float at; color tint; };
// Half of a number.
float half(float x, output float rest) { rest = x; return x / 2; }
surface a(
    int count = 3, // How many.
    string where = \"world\" [[ string widget = \"filename\" ]],
    output color o = 0)
{
    slot s = { count, color(1, 0.5, 0) };
    float rest;
    float n = noise(\"perlin\", P * 4);
    point q = transform(where, P);
    for (int i = 0; i < count; i++)
        s.at += half(TWICE(n), rest) + i;
    o = s.tint * smoothstep(0.25, 0.75, s.at) * noise(q);
    Ci = o * emission();
}
";

#[test]
fn what_names_mean() {
    let mut client = Client::start(&json!({}));
    client.open(URI, TEXT);
    let mut out = String::new();
    let parts = [
        "smoothstep",
        "noise(q",
        "noise(\"",
        "perlin",
        "P * 4",
        "half(TWICE",
        "TWICE(n",
        "count, color",
        "s.at +=|",
        "tint * smo",
        "slot s",
        "for (",
        "+ i",
        "emission",
        "where, P",
        "Ci",
        "surface",
        "// Half",
    ];
    for part in parts {
        let answer = client.ask_at("hover", URI, TEXT, part);
        let text = answer["contents"]["value"].as_str().unwrap_or("nothing");
        let _ = writeln!(out, "==== {part} {}\n{text}", lines(&answer["range"]).trim_end());
    }
    insta::assert_snapshot!("hover", out);
}

#[test]
fn a_diagnostic_has_its_lesson() {
    let text = "shader a(output float o = 0) { o = 1 / 2; }";
    let mut client = Client::start(&json!({}));
    client.open(URI, text);
    let answer = client.ask_at("hover", URI, text, "/ 2");
    let said = answer["contents"]["value"].as_str().unwrap();
    assert!(said.contains("**W0312: ") && said.contains("int"), "{said}");
}

#[test]
fn forms_of_calls() {
    let text = TEXT.replace("    Ci = o", "    o = half(1, ");
    let mut client = Client::start(&json!({}));
    client.open(URI, &text);
    let mut out = String::new();
    for part in ["0.75, s.at", "smoothstep(|", "half(1, |", "P * 4|)", "rest) + i", "count, color|(1"] {
        let answer = client.ask_at("signatureHelp", URI, &text, part);
        let _ = writeln!(
            out,
            "==== {part} form {} argument {}",
            answer["activeSignature"], answer["activeParameter"]
        );
        for signature in answer["signatures"].as_array().into_iter().flatten() {
            let labels: Vec<&str> = signature["parameters"]
                .as_array()
                .unwrap()
                .iter()
                .map(|p| p["label"].as_str().unwrap())
                .collect();
            let _ = writeln!(out, "{} | {}", signature["label"].as_str().unwrap(), labels.join(" | "));
        }
    }
    insta::assert_snapshot!("signatures", out);
}

/// The labels that are offered where `|` is in a text, and the first of them in full.
fn offered(text: &str) -> (Vec<String>, Value) {
    let mut client = Client::start(&json!({ "knownSpaces": ["tangent"] }));
    let at = text.find('|').unwrap();
    let text = text.replacen('|', "", 1);
    client.open(URI, &text);
    let answer = client.ask("completion", URI, json!({ "position": position(&text, at) }));
    let list = answer.as_array().unwrap();
    let labels = list.iter().map(|entry| entry["label"].as_str().unwrap().to_string()).collect();
    (labels, list.first().cloned().unwrap_or_default())
}

#[test]
fn completion_knows_its_place() {
    let shader = |body: &str| {
        format!(
            "#define DEEP 3\nstruct inner {{ float w; }};\nstruct slot {{ float at; inner in[2]; }};\nfloat own(float f) {{ float gone = f; return f; }}\nshader a(float size = 1, output float o = 0) {{\n  slot s[4]; {{ float hidden = 1; }}\n  {body}\n}}\n"
        )
    };
    let cases = [
        ("fields of an element", shader("s[1].|")),
        ("fields of a field", shader("s[0].in[1].|;")),
        ("components", shader("P.|")),
        ("noise fields", shader("o = noise(\"|\", P);")),
        ("spaces", shader("point q = transform(\"wor|\", P);")),
        ("color spaces", shader("color c = color(\"|\", 1, 1, 1);")),
        ("in a comment", shader("// si|")),
        ("in a text", shader("printf(\"si|\");")),
        ("in a number", shader("o = 12|;")),
        ("directives", "#in|\nshader a() {}".to_string()),
        ("headers", "#include \"|\nshader a() {}".to_string()),
        ("metadata", "shader a(float size = 1 [[ | ]]) {}".to_string()),
        ("metadata of a type", "shader a(float size = 1 [[ int | ]]) {}".to_string()),
        ("widgets", "shader a(float size = 1 [[ string widget = \"|\" ]]) {}".to_string()),
    ];
    let mut out = String::new();
    for (name, text) in cases {
        let (labels, first) = offered(&text);
        let _ = writeln!(out, "{name}: {}\n  {}", labels.join(" "), lines(&first).trim_end());
    }
    insta::assert_snapshot!("completion", out);
    let (labels, first) = offered(&shader("float later = o; for (int i = 0; i < 3; i++) { o = s|; }"));
    let has = |name: &str| labels.iter().filter(|label| *label == name).count();
    for name in [
        "i",
        "later",
        "s",
        "size",
        "o",
        "own",
        "slot",
        "DEEP",
        "smoothstep",
        "P",
        "float",
        "while",
        "emission",
    ] {
        assert_eq!(has(name), 1, "{name}");
    }
    for name in ["hidden", "gone", "f", "at", "w", "color in space"] {
        assert_eq!(has(name), 0, "{name}");
    }
    assert_eq!(first["label"], json!("i"));
}

#[test]
fn hints_tell_what_is_not_written() {
    let mut client = Client::start(&json!({}));
    client.open(URI, TEXT);
    let all = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 99, "character": 0 } });
    let show = |answer: &Value| -> String {
        let mut text = TEXT.to_string();
        for hint in answer.as_array().unwrap().iter().rev() {
            let space = |side: &str| if hint[side] == json!(true) { " " } else { "" };
            let at = super::client::offset(&text, &hint["position"]);
            let label = hint["label"].as_str().unwrap();
            text.insert_str(at, &format!("{}«{label}»{}", space("paddingLeft"), space("paddingRight")));
        }
        text
    };
    let whole = client.ask("inlayHint", URI, json!({ "range": all }));
    let settings = json!({ "hints": { "parameters": false, "conversions": false, "results": false },
        "probe": { "x": 30, "y": 200, "size": 256 } });
    client.note("workspace/didChangeConfiguration", json!({ "settings": settings }));
    let values = client.ask("inlayHint", URI, json!({ "range": all }));
    insta::assert_snapshot!("hints", format!("{}----\n{}", show(&whole), show(&values)));
    let one = at(TEXT, "float n");
    let part = client.ask(
        "inlayHint",
        URI,
        json!({ "range": { "start": one, "end": { "line": one["line"], "character": 99 } } }),
    );
    assert_eq!(part.as_array().unwrap().len(), 1);
    client.note("workspace/didChangeConfiguration", json!({ "settings": { "probe": { "x": 300, "y": 0 } } }));
    let outside = client.ask("inlayHint", URI, json!({ "range": all }));
    assert!(!outside.to_string().contains(" = "));
}
