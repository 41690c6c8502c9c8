//! What the protocol asks of a server, whatever the language.

use super::client::Client;
use lsp_server::{Message, Request};
use serde_json::{Value, json};

const URI: &str = "untitled:a.osl";

#[test]
fn requests_that_have_no_answer_are_errors() {
    let mut client = Client::start(&json!({}));
    client.open(URI, "shader a() {}");
    let unknown = client.ask("moniker", URI, json!({ "position": { "line": 0, "character": 0 } }));
    let other = client.ask_raw("workspace/symbol", json!({ "query": "" }));
    let closed =
        client.ask("hover", "file:///nowhere.osl", json!({ "position": { "line": 0, "character": 0 } }));
    let wrong = client.ask("hover", URI, json!({ "position": 7 }));
    let far = client.ask(
        "hover",
        URI,
        json!({ "position": { "line": 4294967295u32, "character": 4294967295u32 } }),
    );
    let codes: Vec<&Value> = [&unknown, &other, &closed, &wrong].map(|answer| &answer["code"]).into();
    assert_eq!(json!(codes), json!([-32601, -32601, -32602, -32602]));
    assert_eq!(far, Value::Null);
    client.note("textDocument/unheardOf", json!({}));
    client.note("textDocument/didChange", json!({ "textDocument": 3 }));
    assert_eq!(client.end(), Some(0));
    assert_eq!(client.said.len(), 1, "{:?}", client.said);
}

#[test]
fn an_editor_that_leaves_ends_the_server() {
    let mut client = Client::start(&json!({}));
    client.open(URI, "shader a() {}");
    assert_eq!(client.left(), Some(0));
    let mut client = Client::start(&json!({}));
    client.note("exit", Value::Null);
    assert_eq!(client.left(), Some(1));
    let mut client = Client::start(&json!({}));
    client.ask_raw("shutdown", Value::Null);
    let after = client.ask("hover", URI, json!({ "position": { "line": 0, "character": 0 } }));
    assert!(after["error"].as_str().unwrap().contains("shut down"));
}

#[test]
fn a_waiting_request_can_be_cancelled() {
    let mut client = Client::start(&json!({}));
    let body: String = (0..3000).map(|n| format!("  float v{n} = u * {n}; o += v{n};\n")).collect();
    client.open(URI, &format!("shader a(output float o = 0) {{\n{body}}}\n"));
    // The first request takes a while, so that the second one waits.
    let asked = json!({ "textDocument": { "uri": URI } });
    let first = client.send_request("textDocument/documentSymbol", asked.clone());
    let second = client.send_request("textDocument/documentSymbol", asked);
    client.note("$/cancelRequest", json!({ "id": second }));
    client.send(Message::Request(Request::new(99.into(), "shutdown".to_string(), Value::Null)));
    // The cancelled request is answered before work on the first one begins, or after it.
    let mut answers = std::collections::BTreeMap::new();
    while answers.len() < 2 {
        if let Message::Response(response) = client.next() {
            answers.insert(response.id.to_string(), json!(response));
        }
    }
    assert!(answers[&first.to_string()].get("result").is_some());
    assert_eq!(answers[&second.to_string()]["error"]["code"], json!(-32800));
}
