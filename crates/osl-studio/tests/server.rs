//! The server with a subject of its own: who may connect, what is too much, and which work is outdated.

#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "a test says what must hold")]

use osl_limits::Cancel;
use osl_studio::{
    Edit, Files, First, Layer, Line, Options, Outdate, Picture, Saved, Server, Shader, State, Stop, Subject,
    Thumbnail, version,
};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tungstenite::protocol::Role;
use tungstenite::{Message, WebSocket};

/// A failing test is better than one that waits for ever.
const PATIENCE: Duration = Duration::from_secs(300);

/// A picture of two pixels that shows how many runs were cancelled. The output `slow` and the line 7 are done
/// only when they are cancelled.
struct Fake {
    file: PathBuf,
    cancelled: Arc<AtomicUsize>,
    started: Arc<AtomicUsize>,
}

/// Samples of a picture that does not fit in the buffers of a connection.
const LARGE: usize = 15 << 20;

impl Fake {
    /// Work that ends when it is cancelled.
    fn slow<T>(&self, cancel: &Cancel) -> Result<T, Stop> {
        self.started.fetch_add(1, Ordering::SeqCst);
        while !cancel.is_cancelled() {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.cancelled.fetch_add(1, Ordering::SeqCst);
        Err(Stop::Cancelled)
    }
}

impl Subject for Fake {
    fn outdate(&self) -> Outdate {
        let present = Mutex::new(Cancel::new());
        Box::new(move |_| {
            let mut present = present.lock().unwrap();
            present.cancel();
            *present = Cancel::new();
            present.clone()
        })
    }

    fn shader(&mut self, state: &State, files: &mut Files) -> Result<Shader, Stop> {
        files.insert(self.file.clone(), osl_files::stamp(&self.file));
        if state.file.as_deref() == Some("missing") {
            return Err(Stop::error("no such file"));
        }
        let text = std::fs::read_to_string(&self.file).unwrap();
        let layer = Layer { name: String::new(), description: json!({ "parameters": [] }) };
        let layers = if text.contains("broken") { vec![] } else { vec![layer] };
        Ok(Shader { text, layers, ..Shader::default() })
    }

    fn picture(
        &mut self,
        state: &State,
        first: Option<First<'_>>,
        cancel: &Cancel,
        _: &mut Files,
    ) -> Result<Picture, Stop> {
        if state.output.as_deref() == Some("slow") {
            return self.slow(cancel);
        }
        let output = state.output.clone().unwrap_or_default();
        let picture = |samples: Vec<u8>| Picture {
            output: output.clone(),
            width: samples.len(),
            height: 1,
            channels: 1,
            samples,
            phases: vec![("run", 0.5)],
            ..Picture::default()
        };
        if let Some(First { step, show }) = first {
            match output.as_str() {
                "small" => show(picture(vec![step as u8])),
                "large" => show(picture(vec![9; LARGE])),
                _ => {}
            }
        }
        Ok(picture(vec![7, 8]))
    }

    fn pin(&mut self, state: Option<&State>, _: &Cancel) -> Result<(), Stop> {
        match state.and_then(|state| state.output.as_deref()) {
            Some("bad") => Err(Stop::error("not this one")),
            _ => Ok(()),
        }
    }

    fn explain(&mut self, _: &State, at: [usize; 2], _: &Cancel) -> Result<String, Stop> {
        match at {
            [0, 0] => Ok("{\n  \"x\": 0.1\n}\n".to_string()),
            _ => Err(Stop::error("outside")),
        }
    }

    fn line(&mut self, _: &State, line: u32, cancel: &Cancel) -> Result<Line, Stop> {
        match line {
            7 => self.slow(cancel),
            8 => Err(Stop::error("no such line")),
            _ => {
                let name = format!("line {line}");
                Ok(Line { pictures: vec![Thumbnail { name, ..Thumbnail::default() }], more: 2 })
            }
        }
    }

    fn group(&mut self, state: &State, _: &Cancel) -> Result<String, Stop> {
        match state.output.as_deref() {
            Some("bad") => Err(Stop::error("no text")),
            output => Ok(format!("shader {}", output.unwrap_or_default())),
        }
    }

    fn save(&mut self, state: &State, edit: &Edit) -> Result<Saved, Stop> {
        let now = version(&std::fs::read_to_string(&self.file).unwrap());
        if state.file.as_deref() != Some(&edit.file) {
            return Err(Stop::error("another file"));
        }
        if now != edit.version {
            return Ok(Saved::Changed(now));
        }
        std::fs::write(&self.file, &edit.text).unwrap();
        Ok(Saved::Done(version(&edit.text)))
    }
}

/// A running server; the parts of its address; what its subject counts.
struct Running {
    port: u16,
    token: String,
    cancelled: Arc<AtomicUsize>,
    started: Arc<AtomicUsize>,
    folder: tempfile::TempDir,
}

fn start() -> Running {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.osl");
    std::fs::write(&file, "one").unwrap();
    let server = Server::new(Options::default()).unwrap();
    let url = server.url();
    let (port, token) = url.strip_prefix("http://127.0.0.1:").unwrap().split_once('/').unwrap();
    let (port, token) = (port.parse().unwrap(), token.trim_end_matches('/').to_string());
    let (cancelled, started) = (Arc::<AtomicUsize>::default(), Arc::<AtomicUsize>::default());
    let counts = (cancelled.clone(), started.clone());
    std::thread::spawn(move || {
        server.run(move || {
            let (cancelled, started) = counts.clone();
            Box::new(Fake { file: file.clone(), cancelled, started })
        });
    });
    Running { port, token, cancelled, started, folder }
}

impl Running {
    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// The status line and everything else of the answer to a request with these headers.
    fn ask(&self, path: &str, headers: &str) -> (String, String) {
        self.try_ask(path, headers).unwrap()
    }

    /// The same; an error if the connection was closed before the answer.
    fn try_ask(&self, path: &str, headers: &str) -> std::io::Result<(String, String)> {
        let mut stream = self.connect();
        write!(stream, "GET {path} HTTP/1.1\r\n{headers}\r\n")?;
        let mut text = String::new();
        stream.read_to_string(&mut text)?;
        let (status, rest) = text.split_once("\r\n").unwrap_or_default();
        Ok((status.to_string(), rest.to_string()))
    }

    fn host(&self) -> String {
        format!("Host: 127.0.0.1:{}\r\n", self.port)
    }

    fn upgrade(&self, origin: &str) -> String {
        format!(
            "{}Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
             Sec-WebSocket-Version: 13\r\n{origin}",
            self.host()
        )
    }

    fn origin(&self) -> String {
        format!("Origin: http://127.0.0.1:{}\r\n", self.port)
    }

    /// A socket of a page, as a stream after the switch.
    fn switched(&self) -> TcpStream {
        let mut stream = self.connect();
        let headers = self.upgrade(&self.origin());
        write!(stream, "GET /{}/socket HTTP/1.1\r\n{headers}\r\n", self.token).unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.push(byte[0]);
        }
        let head = String::from_utf8(head).unwrap();
        assert!(head.starts_with("HTTP/1.1 101 "), "{head}");
        // The example of RFC 6455.
        assert!(head.contains("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n"), "{head}");
        stream
    }

    fn page(&self) -> Page {
        Page(WebSocket::from_raw_socket(self.switched(), Role::Client, None))
    }
}

struct Page(WebSocket<TcpStream>);

impl Page {
    fn send(&mut self, message: Value) {
        self.0.send(Message::text(message.to_string())).unwrap();
    }

    fn state(&mut self, id: u64, output: &str) {
        self.send(json!({ "type": "state", "id": id, "state": { "output": output } }));
    }

    /// The next answer, and the samples of a picture.
    fn next(&mut self) -> (Value, Vec<u8>) {
        match self.0.read().unwrap() {
            Message::Text(text) => (serde_json::from_str(&text).unwrap(), Vec::new()),
            Message::Binary(bytes) => {
                let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
                (serde_json::from_slice(&bytes[4..4 + length]).unwrap(), bytes[4 + length..].to_vec())
            }
            other => panic!("{other:?}"),
        }
    }

    /// The next answer of a kind.
    fn until(&mut self, kind: &str) -> (Value, Vec<u8>) {
        loop {
            let answer = self.next();
            if answer.0["type"] == kind && answer.0["coarse"] != true {
                return answer;
            }
        }
    }
}

#[test]
fn only_the_page_of_the_address_is_served() {
    let server = start();
    let (host, token) = (server.host(), server.token.clone());
    let ask = |path: &str, headers: &str| server.ask(path, headers).0;
    let ok = "HTTP/1.1 200 OK";
    let forbidden = "HTTP/1.1 403 Forbidden";
    let (status, rest) = server.ask(&format!("/{token}/"), &host);
    assert_eq!(status, ok);
    assert!(rest.contains("Content-Security-Policy: default-src 'none'; script-src 'self'"), "{rest}");
    assert!(!rest.contains("unsafe") && rest.contains("<!doctype html>"), "{rest}");
    assert_eq!(ask(&format!("/{token}/main.js"), &host), ok);
    assert_eq!(ask(&format!("/{token}/"), &(host.clone() + &server.origin())), ok);
    assert_eq!(ask(&format!("/{token}/"), &format!("Host: localhost:{}\r\n", server.port)), ok);
    // Without the token, or with another one.
    for path in ["/", "/main.js", "/socket", &format!("/{token}"), &format!("/{}0/", &token[1..])] {
        assert_eq!(ask(path, &host), forbidden, "{path}");
    }
    // For another host, or none, or two.
    for headers in ["", "Host: evil.example\r\n", &format!("{host}{host}"), "Host: 127.0.0.1\r\n"] {
        assert_eq!(ask(&format!("/{token}/"), headers), forbidden, "{headers}");
    }
    // From another page.
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1", ""] {
        let headers = format!("{host}Origin: {origin}\r\n");
        assert_eq!(ask(&format!("/{token}/"), &headers), forbidden, "{origin}");
        let headers = server.upgrade(&format!("Origin: {origin}\r\n"));
        assert_eq!(ask(&format!("/{token}/socket"), &headers), forbidden, "{origin}");
    }
    assert_eq!(ask(&format!("/{token}/socket"), &server.upgrade("")), forbidden, "no origin");
    assert_eq!(ask("/0123456789abcdef/socket", &server.upgrade(&server.origin())), forbidden);
    // Files that are not of the page.
    for path in ["a.osl", "../a.osl", "%2e%2e/a.osl", "/etc/passwd", "page/main.js"] {
        assert_eq!(ask(&format!("/{token}/{path}"), &host), "HTTP/1.1 404 Not Found", "{path}");
    }
    assert_eq!(ask(&format!("/{token}/socket"), &(host + &server.origin())), "HTTP/1.1 426 Upgrade Required");
}

#[test]
fn a_state_has_a_shader_and_a_picture_and_points_have_explanations() {
    let server = start();
    let mut page = server.page();
    page.send(json!({ "type": "state", "id": 1, "state": { "output": "a", "params": [["x", "1"]] } }));
    assert_eq!(page.next().0["text"], "one");
    let (picture, samples) = page.until("picture");
    assert_eq!((&picture["id"], &picture["output"], &picture["width"]), (&json!(1), &json!("a"), &json!(2)));
    assert_eq!(samples, [7, 8]);
    page.send(json!({ "type": "point", "id": 2, "at": [0, 0] }));
    assert_eq!(
        page.next().0,
        json!({ "type": "explanation", "id": 2, "at": [0, 0], "explanation": { "x": 0.1 } })
    );
    page.send(json!({ "type": "point", "id": 3, "at": [9, 0] }));
    assert_eq!(page.next().0["messages"][0]["message"], "outside");
    page.send(json!({ "type": "state", "id": 4, "state": { "file": "missing" } }));
    assert_eq!(page.until("failed").0["messages"][0]["message"], "no such file");
}

#[test]
fn a_small_picture_comes_before_the_whole_one() {
    let server = start();
    let mut page = server.page();
    page.state(1, "small");
    assert_eq!(page.next().0["type"], "shader");
    let (picture, samples) = page.next();
    assert_eq!((&picture["id"], &picture["coarse"], samples), (&json!(1), &json!(true), vec![4]));
    let (picture, samples) = page.next();
    assert_eq!((&picture["id"], &picture["coarse"], samples), (&json!(1), &json!(false), vec![7, 8]));
    assert_eq!(picture["phases"], json!({ "run": 0.5 }));
}

#[test]
fn a_page_that_does_not_read_its_small_picture_keeps_no_other_waiting() {
    let server = start();
    let (mut slow, mut other) = (server.page(), server.page());
    slow.state(1, "large");
    other.state(2, "small");
    assert_eq!(other.until("picture").0["id"], 2);
    // What was left of it comes before the whole one.
    assert_eq!(slow.next().0["type"], "shader");
    let (picture, samples) = slow.next();
    assert_eq!(picture["coarse"], true);
    assert!(samples == vec![9; LARGE]);
    let (picture, samples) = slow.next();
    assert_eq!((&picture["coarse"], samples), (&json!(false), vec![7, 8]));
}

#[test]
fn values_are_pinned_or_not() {
    let server = start();
    let mut page = server.page();
    page.state(1, "a");
    page.send(json!({ "type": "pin", "id": 2, "pinned": true }));
    let answer =
        |pinned: bool, id: u64| json!({ "type": "pinned", "id": id, "pinned": pinned, "messages": [] });
    assert_eq!(page.until("pinned").0, answer(true, 2));
    page.send(json!({ "type": "pin", "id": 3, "pinned": false }));
    assert_eq!(page.until("pinned").0, answer(false, 3));
    page.state(4, "bad");
    page.send(json!({ "type": "pin", "id": 5, "pinned": true }));
    let (failed, _) = page.until("pinned");
    assert_eq!(
        (&failed["pinned"], &failed["messages"][0]["message"]),
        (&json!(false), &json!("not this one"))
    );
}

#[test]
fn a_state_is_written_as_a_group() {
    let server = start();
    let mut page = server.page();
    let mut ask = |id: u64| {
        page.send(json!({ "type": "group", "id": id }));
        page.until("group").0
    };
    assert_eq!(ask(1)["messages"][0]["message"], "the page shows no file");
    let mut page = server.page();
    page.state(2, "a");
    page.send(json!({ "type": "group", "id": 3 }));
    assert_eq!(
        page.until("group").0,
        json!({ "type": "group", "id": 3, "text": "shader a", "messages": [] })
    );
    page.state(4, "bad");
    page.send(json!({ "type": "group", "id": 5 }));
    let (failed, _) = page.until("group");
    assert_eq!((&failed["text"], &failed["messages"][0]["message"]), (&Value::Null, &json!("no text")));
}

#[test]
fn a_text_is_saved_and_shown_or_refused_with_words() {
    let server = start();
    let mut page = server.page();
    let save = |id: u64, file: &str, before: &str, text: &str| {
        let version = version(before);
        json!({ "type": "save", "id": id, "file": file, "version": version, "text": text })
    };
    page.send(save(1, "a.osl", "one", "two"));
    let (refused, _) = page.until("saved");
    assert_eq!((&refused["id"], &refused["saved"]), (&json!(1), &json!(false)));
    assert!(refused["messages"][0]["message"].as_str().unwrap().contains("shows no file"), "{refused}");
    // A picture that takes long is not waited for, and is made again afterwards.
    page.send(json!({ "type": "state", "id": 2, "state": { "file": "a.osl", "output": "slow" } }));
    let (shader, _) = page.until("shader");
    assert_eq!(shader["version"], version("one"));
    let wait = |n: usize| {
        while server.started.load(Ordering::SeqCst) < n {
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    wait(1);
    page.send(save(3, "a.osl", "one", "two"));
    let (saved, _) = page.until("saved");
    assert_eq!(
        saved,
        json!({ "type": "saved", "id": 3, "saved": true, "version": version("two"), "messages": [] })
    );
    assert_eq!(page.until("shader").0["text"], "two");
    wait(2);
    // A file that was changed since is not overwritten.
    page.send(save(4, "a.osl", "one", "three"));
    let (changed, _) = page.until("saved");
    assert_eq!((&changed["saved"], &changed["version"]), (&json!(false), &json!(version("two"))));
    assert!(changed["messages"][0]["message"].as_str().unwrap().contains("has changed on the disk"));
    page.send(save(5, "b.osl", "two", "three"));
    let (other, _) = page.until("saved");
    assert_eq!((&other["version"], &other["messages"][0]["message"]), (&Value::Null, &json!("another file")));
    // The file of a state that came before counts, also if it is not shown yet.
    page.send(json!({ "type": "state", "id": 6, "state": { "file": "b.osl" } }));
    page.send(save(7, "b.osl", "two", "three"));
    assert_eq!(page.until("saved").0["saved"], true);
    assert_eq!(std::fs::read_to_string(server.folder.path().join("a.osl")).unwrap(), "three");
}

#[test]
fn a_changed_file_is_shown_again() {
    let server = start();
    let write = |text: &str| std::fs::write(server.folder.path().join("a.osl"), text).unwrap();
    let mut page = server.page();
    page.state(1, "a");
    page.until("picture");
    write("broken now");
    assert_eq!(page.until("shader").0["layers"], json!([]));
    assert_eq!(page.until("failed").0["id"], 1);
    write("good again, and longer");
    assert_eq!(page.until("shader").0["text"], "good again, and longer");
    assert_eq!(page.until("picture").0["id"], 1);
}

#[test]
fn outdated_work_is_cancelled() {
    let server = start();
    let mut page = server.page();
    page.state(1, "slow");
    while server.started.load(Ordering::SeqCst) == 0 {
        std::thread::sleep(Duration::from_millis(1));
    }
    page.state(2, "quick");
    assert_eq!(page.until("picture").0["id"], 2);
    assert_eq!(server.cancelled.load(Ordering::SeqCst), 1);
    // A page that is closed needs nothing either.
    page.state(3, "slow");
    while server.started.load(Ordering::SeqCst) == 1 {
        std::thread::sleep(Duration::from_millis(1));
    }
    drop(page);
    while server.cancelled.load(Ordering::SeqCst) == 1 {
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn lines_are_shown_and_outdated_ones_are_cancelled() {
    let server = start();
    let mut page = server.page();
    page.state(1, "a");
    page.until("picture");
    let line = |id: u64, line: u32| json!({ "type": "line", "id": id, "line": line });
    page.send(line(2, 3));
    let (found, _) = page.until("line");
    assert_eq!((&found["id"], &found["line"], &found["more"]), (&json!(2), &json!(3), &json!(2)));
    assert_eq!(found["pictures"][0]["name"], "line 3");
    page.send(line(3, 8));
    assert_eq!(page.until("line").0["messages"][0]["message"], "no such line");
    // A newer line, and a newer state.
    let wait = |n: usize| {
        while server.started.load(Ordering::SeqCst) < n {
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    page.send(line(4, 7));
    wait(1);
    page.send(line(5, 4));
    let given_up = page.until("line").0;
    assert_eq!((&given_up["id"], &given_up["messages"]), (&json!(4), &json!([])));
    assert_eq!(page.until("line").0["id"], 5);
    page.send(line(6, 7));
    wait(2);
    page.state(7, "b");
    assert_eq!(page.until("line").0["messages"], json!([]));
    assert_eq!(page.until("picture").0["id"], 7);
    // A point is explained without an end of the line.
    page.send(line(8, 7));
    wait(3);
    page.send(json!({ "type": "point", "id": 9, "at": [0, 0] }));
    page.send(line(10, 5));
    assert_eq!(page.until("line").0["id"], 8);
    assert_eq!(page.until("line").0["id"], 10);
    assert_eq!(server.cancelled.load(Ordering::SeqCst), 3);
}

/// Waits until the server closes the connection; how many bytes it accepted before.
fn fill(mut stream: TcpStream, total: u64) -> u64 {
    stream.set_write_timeout(Some(PATIENCE)).unwrap();
    let block = vec![0; 1 << 16];
    let mut sent = 0;
    while sent < total {
        match stream.write(&block) {
            Ok(n) => sent += n as u64,
            Err(_) => return sent,
        }
    }
    sent
}

#[test]
fn a_huge_message_ends_its_connection_and_no_other() {
    let server = start();
    let mut other = server.page();
    let gigabyte = 1_u64 << 30;
    // A text message of one frame, masked as those of clients are; and one that never ends, of many frames.
    let mut stream = server.switched();
    let mut head = vec![0x81, 0xff];
    head.extend_from_slice(&gigabyte.to_be_bytes());
    head.extend_from_slice(&[0; 4]);
    stream.write_all(&head).unwrap();
    assert!(fill(stream, gigabyte) < gigabyte / 8, "the message was received");
    let mut page = server.page();
    let endless = Message::text("x".repeat(64 << 20));
    assert!(page.0.send(endless).is_err() || page.0.read().is_err());
    // A head that never ends.
    assert!(fill(server.connect(), gigabyte) < gigabyte / 8, "the head was received");
    // Words that are no request.
    let mut page = server.page();
    page.0.send(Message::text("{\"type\":\"format-disk\"}")).unwrap();
    assert!(page.0.read().is_err() || !page.0.can_read());
    other.state(1, "a");
    assert_eq!(other.until("picture").0["id"], 1);
}

#[test]
fn a_hundred_pages_are_served_and_more_are_turned_away() {
    let server = start();
    let mut pages: Vec<Page> = (0..100).map(|_| server.page()).collect();
    for (at, page) in pages.iter_mut().enumerate() {
        page.state(at as u64, "a");
    }
    for (at, page) in pages.iter_mut().enumerate() {
        assert_eq!(page.until("picture").0["id"], at);
    }
    // Connections that say nothing take the other places. The server gives up on them after a while, so the
    // test makes new ones.
    let path = format!("/{}/", server.token);
    let status = || server.try_ask(&path, &server.host()).map(|(status, _)| status).unwrap_or_default();
    let mut silent: Vec<TcpStream> = Vec::new();
    loop {
        silent.extend((0..100).map(|_| server.connect()));
        if status() == "HTTP/1.1 503 Service Unavailable" {
            break;
        }
    }
    drop((pages, silent));
    while status() != "HTTP/1.1 200 OK" {
        std::thread::sleep(Duration::from_millis(10));
    }
}
