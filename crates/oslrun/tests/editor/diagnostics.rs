//! Diagnostics while a user types.

use super::client::{Client, lines, position, range};
use serde_json::json;

const URI: &str = "untitled:a.osl";

#[test]
fn as_one_types() {
    let mut client = Client::start(&json!({ "lessons": "https://example.org/errors/" }));
    let text = "shader a(output float o = 0)\n{\n    float x = 1;\n    o = v;\n}\n";
    client.open(URI, text);
    let mut out = format!("opened\n{}", lines(&client.diagnostics(URI, 1)));
    // Two changes of one version: the second refers to the text after the first.
    let line = json!({ "start": { "line": 3, "character": 8 }, "end": { "line": 3, "character": 9 } });
    let end = json!({ "start": { "line": 4, "character": 0 }, "end": { "line": 9, "character": 0 } });
    client.change(URI, 2, json!([{ "range": line, "text": "x + y" }, { "range": end, "text": "" }]));
    out.push_str(&format!("without a brace, with `y`\n{}", lines(&client.diagnostics(URI, 2))));
    client.change(URI, 3, json!([{ "text": "shader a(output float o = 0)\n{\n    o = v;\n}\n" }]));
    out.push_str(&format!("whole\n{}", lines(&client.diagnostics(URI, 3))));
    client.change(URI, 2, json!([{ "text": "late" }]));
    client.change(URI, 4, json!([{ "text": "float f(float x) { return x; }\nfloat f(float x) { return x; }\nshader s() {}\n" }]));
    out.push_str(&format!("a related place\n{}", lines(&client.diagnostics(URI, 4))));
    client.note("textDocument/didClose", json!({ "textDocument": { "uri": URI } }));
    let closed = client.ask("hover", URI, json!({ "position": { "line": 0, "character": 0 } }));
    out.push_str(&format!("closed\n{}{}", lines(&client.reported[URI]), lines(&closed)));
    out.push_str(&format!("said\n{}\n", client.said.join("\n")));
    assert_eq!(client.end(), Some(0));
    insta::assert_snapshot!("as_one_types", out);
}

#[test]
fn positions_are_utf16_whatever_the_text_has() {
    // A byte-order mark, a character of two units before the error, tabs, and lines that end in three ways.
    let lines =
        ["\u{feff}// \u{10400}", "shader a(output float o = 0)", "{", "\t/* \u{10400}ü */ o = yy;", "}"];
    for end in ["\n", "\r\n", "\r"] {
        let text = lines.join(end);
        let mut client = Client::start(&json!({}));
        client.open(URI, &text);
        let found = client.diagnostics(URI, 1);
        let start = json!({ "line": 3, "character": 15 });
        assert_eq!(
            found[0]["range"],
            json!({ "start": start, "end": { "line": 3, "character": 17 } }),
            "{end:?}"
        );
        // A change after it, and one at the end of a line that is given too long.
        let error = json!({ "start": start, "end": { "line": 3, "character": 17 } });
        let long = json!({ "start": { "line": 2, "character": 99 }, "end": { "line": 2, "character": 99 } });
        client.change(URI, 2, json!([{ "range": error, "text": "u" }, { "range": long, "text": " // ü" }]));
        assert_eq!(client.diagnostics(URI, 2), json!([]), "{end:?}");
        client.change(URI, 3, json!([{ "range": { "start": { "line": 3, "character": 0 }, "end": { "line": 3, "character": 1 } }, "text": "zz " }]));
        let found = client.diagnostics(URI, 3);
        assert_eq!(found[0]["range"]["start"], json!({ "line": 3, "character": 0 }), "{end:?}");
    }
}

#[test]
fn headers_are_read_from_open_texts_first() {
    let folder = tempfile::tempdir().unwrap();
    // Addresses may be written in several ways: `%20` and `%c3%bc`.
    let path = folder.path().join("a ü");
    std::fs::create_dir(&path).unwrap();
    let base = format!("file://{}/a%20%c3%bc/", folder.path().display());
    let (main, header) = (format!("{base}main.osl"), format!("{base}h.h"));
    std::fs::write(path.join("h.h"), "float half(float x) { return x / 2 }\n").unwrap();
    let shader = "#include \"h.h\"\nshader a(output float o = 0) { o = half(u); }\n";
    let mut client = Client::start(&json!({}));
    client.open(&main, shader);
    assert_eq!(client.diagnostics(&main, 1), json!([]));
    // The error is in the file of the header, which is not open.
    let closed = format!("{}h.h", base.replace("%c3%bc", "%C3%BC"));
    let found = &client.reported[&closed];
    assert_eq!(found["diagnostics"][0]["code"], json!("E0110"));
    assert!(found.get("version").is_none());
    // The open text has no error, and the shader is checked again.
    client.open(&header, "float half(float x) { return x / 2; }\n");
    while client.reported.get(&header).is_none_or(|found| found["diagnostics"] != json!([])) {
        client.next();
    }
    let text = "float half(float x) { return x / y; }\n";
    client.change(&header, 2, json!([{ "text": text }]));
    assert_eq!(client.diagnostics(&header, 2)[0]["code"], json!("E0201"));
    // A header alone is no error. It is checked by itself when the shader is closed.
    client.note("textDocument/didClose", json!({ "textDocument": { "uri": main } }));
    let found = client.diagnostics(&header, 2);
    assert_eq!((found.as_array().unwrap().len(), &found[0]["range"]), (1, &range(text, "y")));
    client.change(&header, 3, json!([{ "text": "float half(float x) { return x / 2; }\n" }]));
    assert_eq!(client.diagnostics(&header, 3), json!([]));
}

#[test]
fn settings_and_options_choose_warnings_and_macros() {
    let text = "shader a(output float o = 0) { float x = SIZE; o = v; }\n";
    let mut client = Client::start_with(&["-D", "SIZE=2"], &json!({ "deny": ["unused-variable"] }));
    client.open(URI, text);
    assert_eq!(client.diagnostics(URI, 1)[0]["severity"], json!(1));
    client.note(
        "workspace/didChangeConfiguration",
        json!({ "settings": { "oslrun": { "allow": ["W0301"] } } }),
    );
    client.change(
        URI,
        2,
        json!([{ "range": { "start": position(text, 0), "end": position(text, 0) }, "text": " " }]),
    );
    assert_eq!(client.diagnostics(URI, 2), json!([]));
    client.note(
        "workspace/didChangeConfiguration",
        json!({ "settings": { "oslrun": { "allow": ["W9999"] } } }),
    );
    client.ask("documentSymbol", URI, json!({}));
    assert_eq!(client.said, ["the settings of oslrun: `W9999`: no such warning"]);
}
