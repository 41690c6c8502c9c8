//! A client of the server. Positions and edits are computed apart from those of the product.

use lsp_server::{Message, Notification, Request, RequestId, Response};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::BufReader;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

pub(crate) struct Client {
    child: Child,
    to: Option<ChildStdin>,
    from: BufReader<ChildStdout>,
    requests: i32,
    /// The last reported diagnostics of each address.
    pub(crate) reported: BTreeMap<String, Value>,
    /// What the server said to the user.
    pub(crate) said: Vec<String>,
}

impl Client {
    /// A server with these settings, at the start of a session.
    pub(crate) fn start(settings: &Value) -> Client {
        Client::start_with(&[], settings)
    }

    pub(crate) fn start_with(args: &[&str], settings: &Value) -> Client {
        let mut child = Command::new(env!("CARGO_BIN_EXE_oslrun"))
            .arg("lsp")
            .args(args)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let (to, from) = (child.stdin.take(), BufReader::new(child.stdout.take().unwrap()));
        let mut client = Client { child, to, from, requests: 0, reported: BTreeMap::new(), said: Vec::new() };
        client.ask_raw("initialize", json!({ "capabilities": {}, "initializationOptions": settings }));
        client.note("initialized", json!({}));
        client
    }

    pub(crate) fn send(&mut self, message: Message) {
        message.write(self.to.as_mut().unwrap()).unwrap();
    }

    pub(crate) fn note(&mut self, method: &str, params: Value) {
        self.send(Notification::new(method.to_string(), params).into());
    }

    /// The next message of the server; what it reports or says is kept.
    pub(crate) fn next(&mut self) -> Message {
        let message = Message::read(&mut self.from).unwrap().expect("the server left");
        if let Message::Notification(Notification { method, params }) = &message {
            match method.as_str() {
                "textDocument/publishDiagnostics" => {
                    self.reported.insert(params["uri"].as_str().unwrap().to_string(), params.clone());
                }
                _ => self.said.push(params["message"].as_str().unwrap_or_default().to_string()),
            }
        }
        message
    }

    /// Sends a request and returns its number.
    pub(crate) fn send_request(&mut self, method: &str, params: Value) -> RequestId {
        self.requests += 1;
        let id = RequestId::from(self.requests);
        self.send(Request::new(id.clone(), method.to_string(), params).into());
        id
    }

    pub(crate) fn answer(&mut self, wanted: &RequestId) -> Response {
        loop {
            if let Message::Response(response) = self.next()
                && response.id == *wanted
            {
                return response;
            }
        }
    }

    /// The answer to a request, or its error.
    pub(crate) fn ask_raw(&mut self, method: &str, params: Value) -> Value {
        let id = self.send_request(method, params);
        let response = json!(self.answer(&id));
        match response.get("error") {
            Some(error) => json!({ "error": error["message"], "code": error["code"] }),
            None => response["result"].clone(),
        }
    }

    /// The answer to a request about a text, with further parameters.
    pub(crate) fn ask(&mut self, method: &str, uri: &str, mut more: Value) -> Value {
        more["textDocument"] = json!({ "uri": uri });
        self.ask_raw(&format!("textDocument/{method}"), more)
    }

    /// The answer to a request about the place of a part of a text.
    pub(crate) fn ask_at(&mut self, method: &str, uri: &str, text: &str, part: &str) -> Value {
        self.ask(method, uri, json!({ "position": at(text, part) }))
    }

    pub(crate) fn open(&mut self, uri: &str, text: &str) {
        let document = json!({ "uri": uri, "languageId": "osl", "version": 1, "text": text });
        self.note("textDocument/didOpen", json!({ "textDocument": document }));
    }

    pub(crate) fn change(&mut self, uri: &str, version: i32, changes: Value) {
        let document = json!({ "uri": uri, "version": version });
        self.note("textDocument/didChange", json!({ "textDocument": document, "contentChanges": changes }));
    }

    /// The diagnostics of a version of a text.
    pub(crate) fn diagnostics(&mut self, uri: &str, version: i32) -> Value {
        while self.reported.get(uri).is_none_or(|found| found["version"] != json!(version)) {
            self.next();
        }
        self.reported[uri]["diagnostics"].clone()
    }

    /// Ends the session, and returns the exit code.
    pub(crate) fn end(&mut self) -> Option<i32> {
        self.ask_raw("shutdown", Value::Null);
        self.note("exit", Value::Null);
        self.left()
    }

    /// Closes the input, and returns the exit code.
    pub(crate) fn left(&mut self) -> Option<i32> {
        self.to = None;
        self.child.wait().unwrap().code()
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The position of a part of a text; `|` in the part is the cursor.
pub(crate) fn at(text: &str, part: &str) -> Value {
    let before = part.find('|').unwrap_or(0);
    let part = part.replacen('|', "", 1);
    let found = text.find(&part).unwrap_or_else(|| panic!("no {part:?}"));
    position(text, found + before)
}

pub(crate) fn position(text: &str, offset: usize) -> Value {
    let before = &text[..offset];
    let line = before.matches('\n').count();
    let start = before.rfind('\n').map_or(0, |at| at + 1);
    let units: usize = before[start..].chars().map(char::len_utf16).sum();
    json!({ "line": line, "character": units })
}

/// The range of the first place of a part.
pub(crate) fn range(text: &str, part: &str) -> Value {
    let start = text.find(part).unwrap();
    json!({ "start": position(text, start), "end": position(text, start + part.len()) })
}

/// The byte at a position.
pub(crate) fn offset(text: &str, position: &Value) -> usize {
    let number = |name: &str| position[name].as_u64().unwrap() as usize;
    let start: usize = text.split_inclusive('\n').take(number("line")).map(str::len).sum();
    let mut units = 0;
    let within = text[start..].char_indices().find(|(_, c)| {
        let found = units >= number("character");
        units += c.len_utf16();
        found
    });
    within.map_or(text.len(), |(at, _)| start + at)
}

/// The text after edits, which do not overlap.
pub(crate) fn apply(text: &str, edits: &Value) -> String {
    let place = |edit: &Value, end: &str| offset(text, &edit["range"][end]);
    let mut list: Vec<(usize, usize, &str)> = edits
        .as_array()
        .unwrap()
        .iter()
        .map(|edit| (place(edit, "start"), place(edit, "end"), edit["newText"].as_str().unwrap()))
        .collect();
    list.sort();
    let mut out = text.to_string();
    for (start, end, new) in list.into_iter().rev() {
        out.replace_range(start..end, new);
    }
    out
}

/// An answer on few lines, for snapshots: one for each entry of a list.
pub(crate) fn lines(answer: &Value) -> String {
    match answer {
        Value::Array(list) => list.iter().map(|entry| format!("{}\n", line(entry))).collect(),
        answer => format!("{}\n", line(answer)),
    }
}

/// A value with ranges as `line:character-line:character`, and without quotes around names.
fn line(value: &Value) -> String {
    let place = |p: &Value| format!("{}:{}", p["line"], p["character"]);
    match value {
        Value::Object(map) if map.contains_key("start") && map.contains_key("end") => {
            format!("{}-{}", place(&value["start"]), place(&value["end"]))
        }
        Value::Object(map) if map.contains_key("line") && map.contains_key("character") => place(value),
        Value::Object(map) => {
            let fields: Vec<String> =
                map.iter().map(|(name, value)| format!("{name} {}", line(value))).collect();
            format!("{{{}}}", fields.join(", "))
        }
        Value::Array(list) => format!("[{}]", list.iter().map(line).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}
