//! Formatting and code actions: the texts after their edits.

use super::client::{Client, apply, at, range};
use serde_json::{Value, json};
use std::fmt::Write;

const URI: &str = "untitled:a.osl";

#[test]
fn formatting_edits_white_space() {
    let text = "shader a(float x=1,\toutput float o=0){\r\n  float ü=x*2; // ü \u{10400}\r\n\r\n\r\n if(x>1)o=2;\r\n}\r\n";
    let text = &text.replace("float ü", "float w");
    let mut client = Client::start(&json!({}));
    client.open(URI, text);
    let options = json!({ "tabSize": 4, "insertSpaces": true });
    let edits = client.ask("formatting", URI, json!({ "options": options }));
    let whole = apply(text, &edits);
    assert_eq!(whole, osl::format("a.osl", text, &osl::Limits::default()).unwrap());
    let part = client.ask(
        "rangeFormatting",
        URI,
        json!({ "options": options, "range": range(text, "  float w=x*2;") }),
    );
    let part = apply(text, &part);
    insta::assert_snapshot!(
        "formatting",
        format!("{}----\n{}", whole.replace('\r', "␍"), part.replace('\r', "␍"))
    );
    client.change(URI, 2, json!([{ "text": "shader a( {" }]));
    let refused = client.ask("formatting", URI, json!({ "options": options }));
    assert_eq!(refused["code"], json!(-32803));
}

/// The actions at a part of a text, each with the text after it.
fn actions(client: &mut Client, text: &str, part: &str, only: Value) -> String {
    let context = json!({ "diagnostics": [], "only": only });
    let at = at(text, part);
    let list =
        client.ask("codeAction", URI, json!({ "range": { "start": at, "end": at }, "context": context }));
    let mut out = String::new();
    for action in list.as_array().unwrap() {
        let edits = &action["edit"]["changes"][URI];
        let _ = writeln!(
            out,
            "{} ({}, preferred {})\n{}",
            action["title"].as_str().unwrap(),
            action["kind"].as_str().unwrap(),
            action["isPreferred"],
            apply(text, edits)
        );
    }
    out
}

#[test]
fn code_actions_repair_and_silence() {
    let text = "shader a(float size = 1, output float o = 0)\n{\n    float unused = 1;\n    o = sise * 2;\n    if (o == 0.5)\n        o = 1 / 2;\n}\n";
    let mut client = Client::start(&json!({}));
    client.open(URI, text);
    let mut out = actions(&mut client, text, "sise", Value::Null);
    let fixed = text.replace("sise", "size");
    client.change(URI, 2, json!([{ "text": fixed }]));
    for part in ["unused", "== 0.5", "1 / 2"] {
        let _ = write!(out, "---- {part}\n{}", actions(&mut client, &fixed, part, json!(["quickfix"])));
    }
    let _ = write!(out, "---- all\n{}", actions(&mut client, &fixed, "shader", json!(["source.fixAll"])));
    assert_eq!(actions(&mut client, &fixed, "unused", json!(["refactor"])), "");
    insta::assert_snapshot!("code_actions", out);
}

#[test]
fn a_silenced_line_has_no_warning() {
    let text = "shader a(output float o = 0)\r\n{\r\n    float unused = 1;\r\n    o = u;\r\n}\r\n";
    let mut client = Client::start(&json!({}));
    client.open(URI, text);
    let at = at(text, "unused");
    let list = client.ask(
        "codeAction",
        URI,
        json!({ "range": { "start": at, "end": at }, "context": { "diagnostics": [] } }),
    );
    let silence =
        list.as_array().unwrap().iter().find(|a| a["title"].as_str().unwrap().starts_with("silence"));
    let after = apply(text, &silence.unwrap()["edit"]["changes"][URI]);
    assert_eq!(after, text.replace("    float", "    #pragma osl nowarn\r\n    float"));
    client.change(URI, 2, json!([{ "text": after }]));
    assert_eq!(client.diagnostics(URI, 2), json!([]));
}
