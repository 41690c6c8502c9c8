//! Definitions, references, renaming, and the structure of a text.

use super::client::{Client, apply, at, lines};
use serde_json::{Value, json};
use std::fmt::Write;

const URI: &str = "untitled:a.osl";

const TEXT: &str = "#include \"vector2.h\"
#define SCALED(x) ((x) * scale)
struct slot { float at; };
float half(float x);
float half(float x) { return x / 2; }

// Two lines
// of words.
shader a(float scale = 2, float other = 1, output float o = 0)
{
    slot s = { scale };
    float sum = 0;
    for (int i = 0; i < 3; i++) {
        sum += half(s.at) + SCALED(other);
        float x = sum;
        s.at = x;
    }
    color c = color(0.25, 1, 0);
#if 1
    o = sum + c[0];
#endif
}
";

#[test]
fn from_names_to_places() {
    let mut client = Client::start(&json!({}));
    client.open(URI, TEXT);
    let mut out = String::new();
    for part in ["half(s.at", "at) +", "SCALED(other", "scale }", "slot s", "sum + c", "vector2.h", "color c"]
    {
        let _ =
            write!(out, "==== {part}\ndefinition\n{}", lines(&client.ask_at("definition", URI, TEXT, part)));
        let context = json!({ "includeDeclaration": true });
        let found = client.ask("references", URI, json!({ "position": at(TEXT, part), "context": context }));
        let _ = write!(out, "references\n{}", lines(&found));
        let _ = write!(out, "highlights\n{}", lines(&client.ask_at("documentHighlight", URI, TEXT, part)));
    }
    insta::assert_snapshot!("places", out);
}

#[test]
fn the_structure_of_a_text() {
    let mut client = Client::start(&json!({}));
    client.open(URI, TEXT);
    let mut out = String::new();
    for method in ["documentSymbol", "foldingRange", "documentColor", "documentLink"] {
        let _ = write!(out, "==== {method}\n{}", lines(&client.ask(method, URI, json!({}))));
    }
    let positions = json!([at(TEXT, "at) +"), at(TEXT, "0.25")]);
    let mut selections = client.ask("selectionRange", URI, json!({ "positions": positions }));
    for selection in selections.as_array_mut().unwrap() {
        let mut ranges = String::new();
        while !selection.is_null() {
            ranges.push_str(&lines(&selection["range"]));
            *selection = selection["parent"].take();
        }
        let _ = write!(out, "==== selection\n{ranges}");
    }
    let color = json!({ "red": 0.5, "green": 0.1234567, "blue": 0.0, "alpha": 1.0 });
    let range = super::client::range(TEXT, "color(0.25, 1, 0)");
    let picked = client.ask("colorPresentation", URI, json!({ "color": color, "range": range }));
    let _ = write!(out, "==== picked\n{}", lines(&picked));
    insta::assert_snapshot!("structure", out);
}

#[test]
fn words_have_classes() {
    let mut client = Client::start(&json!({}));
    client.open(URI, TEXT);
    let answer = client.ask("semanticTokens/full", URI, json!({}));
    let classes = osl_editor::legend().token_types;
    let numbers: Vec<usize> =
        answer["data"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap() as usize).collect();
    let (mut line, mut start, mut out) = (0, 0, String::new());
    for token in numbers.chunks(5) {
        start = if token[0] == 0 { start + token[1] } else { token[1] };
        line += token[0];
        let text: String = TEXT.lines().nth(line).unwrap().chars().skip(start).take(token[2]).collect();
        let _ = writeln!(out, "{line}:{start} {text} {} {}", classes[token[3]], token[4]);
    }
    insta::assert_snapshot!("tokens", out);
    let part = client.ask(
        "semanticTokens/range",
        URI,
        json!({ "range": super::client::range(TEXT, "float sum = 0") }),
    );
    assert_eq!(part["data"].as_array().unwrap().len(), 3 * 5);
}

fn renamed(client: &mut Client, text: &str, part: &str, new: &str) -> String {
    let answer = client.ask("rename", URI, json!({ "position": at(text, part), "newName": new }));
    match answer.get("changes") {
        Some(changes) => apply(text, &changes[URI]),
        None => answer["error"].as_str().unwrap_or("nothing").to_string(),
    }
}

#[test]
fn renaming_keeps_the_meaning() {
    let mut client = Client::start(&json!({}));
    client.open(URI, TEXT);
    assert_eq!(renamed(&mut client, TEXT, "sum +=", "total"), TEXT.replace("sum", "total"));
    assert_eq!(renamed(&mut client, TEXT, "half(s", "semi"), TEXT.replace("half", "semi"));
    // The new name hides another variable where nothing names that one.
    for new in ["y", "scale", "i"] {
        let text = TEXT.replace("float x = sum", &format!("float {new} = sum"));
        let text = text.replace("at = x", &format!("at = {new}"));
        assert_eq!(renamed(&mut client, TEXT, "x = sum", new), text);
    }
    assert_eq!(
        renamed(&mut client, TEXT, "at; }", "place"),
        TEXT.replace("at; }", "place; }").replace("s.at", "s.place")
    );
    let prepared = client.ask_at("prepareRename", URI, TEXT, "sum +=");
    assert_eq!(prepared["placeholder"], json!("sum"));
    let refused = [
        // A macro of the text uses it.
        ("scale = 2", "size"),
        // The macro would mean the local variable.
        ("sum = 0", "scale"),
        ("other = 1", "scale"),
        ("x = sum", "smoothstep"),
        ("x = sum", "P"),
        ("x = sum", "lerp"),
        ("x = sum", "SCALED"),
        ("x = sum", "a b"),
        ("x = sum", "1x"),
        ("SCALED(o", "Z"),
        ("color c", "Z"),
        ("vector2", "Z"),
        ("// Two", "Z"),
    ];
    let said: Vec<String> = refused
        .map(|(part, new)| format!("{part} to {new}: {}", renamed(&mut client, TEXT, part, new)))
        .into();
    insta::assert_snapshot!("rename", said.join("\n"));
}

#[test]
fn a_name_of_a_header_is_found_in_all_open_texts() {
    let folder = tempfile::tempdir().unwrap();
    let uri = |name: &str| format!("file://{}/{name}", folder.path().display());
    let header = "// Half of it.\nfloat half(float x) { return x / 2; }\n";
    std::fs::write(folder.path().join("h.h"), header).unwrap();
    let shader =
        |name: &str| format!("#include \"h.h\"\nshader {name}(output float o = 0) {{ o = half(u); }}\n");
    let mut client = Client::start(&json!({}));
    client.open(&uri("a.osl"), &shader("a"));
    client.open(&uri("b.osl"), &shader("b"));
    let text = shader("a");
    let position = at(&text, "half(u");
    let found = client.ask(
        "references",
        &uri("a.osl"),
        json!({ "position": position, "context": { "includeDeclaration": true } }),
    );
    let hide = |answer: &Value| lines(answer).replace(&format!("{}", folder.path().display()), "FOLDER");
    let mut out = hide(&found);
    out.push_str(&hide(&client.ask_at("definition", &uri("a.osl"), &text, "half(u")));
    out.push_str(&hide(&client.ask_at("definition", &uri("a.osl"), &text, "h.h")));
    out.push_str(&hide(&client.ask("documentLink", &uri("a.osl"), json!({}))));
    out.push_str(&hide(&client.ask(
        "rename",
        &uri("a.osl"),
        json!({ "position": position, "newName": "semi" }),
    )));
    insta::assert_snapshot!("header_names", out);
}
