//! Starts the live page as a process of its own, and speaks its protocol.

#![allow(dead_code, reason = "each test uses what it needs")]

pub(crate) mod browser;
pub(crate) mod shown;

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tungstenite::protocol::Role;
use tungstenite::{Message, WebSocket};

/// A failing test is better than one that waits for ever.
const PATIENCE: Duration = Duration::from_secs(300);

/// A running command, ended when it is dropped.
pub(crate) struct Studio {
    child: Child,
    /// The address of the page.
    pub(crate) url: String,
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Studio {
    /// Starts the command in a folder.
    pub(crate) fn start(folder: &Path, args: &[&str]) -> Studio {
        Studio::start_at(folder, args).unwrap()
    }

    /// Starts the command; none if it cannot have its port.
    pub(crate) fn start_at(folder: &Path, args: &[&str]) -> Option<Studio> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_oslrun"));
        command.current_dir(folder).arg("studio").args(args).arg("--no-open");
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let url = line.trim().to_string();
        let is_address = url.starts_with("http://");
        let studio = Studio { child, url };
        is_address.then_some(studio)
    }

    /// Runs another command in the same folder; what it prints.
    pub(crate) fn run_beside(&self, folder: &Path, args: &[String]) -> Vec<u8> {
        let output =
            Command::new(env!("CARGO_BIN_EXE_oslrun")).current_dir(folder).args(args).output().unwrap();
        assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    }

    /// The JSON that another command prints in the same folder.
    pub(crate) fn beside(&self, folder: &Path, args: &[&str]) -> Value {
        let args: Vec<String> = args.iter().map(ToString::to_string).collect();
        serde_json::from_slice(&self.run_beside(folder, &args)).unwrap()
    }

    /// The memory of the process in bytes.
    pub(crate) fn memory(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
        line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10
    }

    /// Connects a page.
    pub(crate) fn page(&self) -> Page {
        let address = self.url.strip_prefix("http://").unwrap();
        let (host, path) = address.split_once('/').unwrap();
        let mut stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        write!(
            stream,
            "GET /{path}socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nUpgrade: websocket\r\n\
             Connection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
             Sec-WebSocket-Version: 13\r\n\r\n"
        )
        .unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.push(byte[0]);
        }
        assert!(head.starts_with(b"HTTP/1.1 101 "), "{}", String::from_utf8_lossy(&head));
        Page { socket: WebSocket::from_raw_socket(stream, Role::Client, None), id: 0 }
    }
}

/// A connected page.
pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    /// The number of the last request.
    id: u64,
}

impl Page {
    /// Shows a state.
    pub(crate) fn state(&mut self, state: Value) {
        self.id += 1;
        self.send(json!({ "type": "state", "id": self.id, "state": state }));
    }

    /// Asks for the explanation of a pixel.
    pub(crate) fn point(&mut self, x: usize, y: usize) {
        self.id += 1;
        self.send(json!({ "type": "point", "id": self.id, "at": [x, y] }));
    }

    /// Keeps the values of the present state.
    pub(crate) fn pin(&mut self) {
        self.id += 1;
        self.send(json!({ "type": "pin", "id": self.id, "pinned": true }));
    }

    /// Asks what a line does.
    pub(crate) fn line(&mut self, line: u32) {
        self.id += 1;
        self.send(json!({ "type": "line", "id": self.id, "line": line }));
    }

    /// Asks for the state as the text of a group.
    pub(crate) fn group(&mut self) {
        self.id += 1;
        self.send(json!({ "type": "group", "id": self.id }));
    }

    /// Saves a text of a file in place of the text with this version.
    pub(crate) fn save(&mut self, file: &str, version: &Value, text: &str) {
        self.id += 1;
        self.send(json!({ "type": "save", "id": self.id, "file": file, "version": version, "text": text }));
    }

    fn send(&mut self, message: Value) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    /// Begins a message of a gigabyte, and sends as much of it as the server takes.
    pub(crate) fn huge(&mut self) {
        let stream = self.socket.get_mut();
        let mut head = vec![0x81, 0xff];
        head.extend_from_slice(&(1_u64 << 30).to_be_bytes());
        head.extend_from_slice(&[0; 4]);
        stream.write_all(&head).unwrap();
        let block = vec![b'x'; 1 << 16];
        let sent = (0..1 << 14).take_while(|_| stream.write_all(&block).is_ok()).count();
        assert!(sent < 1 << 11, "the message was received");
    }

    /// The next answer, with the samples of a picture.
    pub(crate) fn next(&mut self) -> (Value, Vec<u8>) {
        match self.socket.read().unwrap() {
            Message::Text(text) => (serde_json::from_str::<Value>(&text).unwrap(), Vec::new()),
            Message::Binary(bytes) => {
                let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
                (serde_json::from_slice(&bytes[4..4 + length]).unwrap(), bytes[4 + length..].to_vec())
            }
            other => panic!("{other:?}"),
        }
    }

    /// The next answer of a kind to the last request, or to a change on disk, with the samples of a picture.
    /// Coarse pictures are not counted.
    pub(crate) fn until(&mut self, kind: &str) -> (Value, Vec<u8>) {
        loop {
            let (header, samples) = self.next();
            let is_current = header["id"].as_u64().is_none_or(|id| id == self.id);
            if is_current && header["coarse"] != true {
                assert!(header["type"] == kind || header["type"] == "shader", "no {kind} but {header}");
                if header["type"] == kind {
                    return (header, samples);
                }
            }
        }
    }
}
