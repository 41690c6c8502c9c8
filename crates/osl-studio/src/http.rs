//! The few parts of HTTP that a page needs: the head of a request, a file as the answer, and the switch to a
//! WebSocket.
//!
//! Each connection carries one request.

use base64::Engine;
use sha1::{Digest, Sha1};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The maximum size of a head in bytes, and its maximum number of header lines.
const MAX_HEAD: usize = 16 << 10;
const MAX_HEADERS: usize = 100;
/// How long a client may take to send a head.
const PATIENCE: Duration = Duration::from_secs(20);
/// The same while many connections are open.
const PATIENCE_IN_A_CROWD: Duration = Duration::from_secs(1);
/// How long a connection is kept open after its answer.
const LINGER: Duration = Duration::from_millis(500);
/// What is added to the key of a WebSocket: RFC 6455, section 1.3.
const KEY_SUFFIX: &str = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";

/// The head of a request.
#[derive(Debug, Default)]
pub(crate) struct Head {
    pub(crate) method: String,
    pub(crate) path: String,
    headers: Vec<(String, String)>,
    /// Bytes that were sent after the head.
    pub(crate) rest: Vec<u8>,
}

impl Head {
    /// The value of a header that occurs once; `None` if it is missing or repeated.
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let mut found = self.headers.iter().filter(|(known, _)| known.eq_ignore_ascii_case(name));
        let (_, value) = found.next()?;
        found.next().is_none().then_some(value.as_str())
    }

    /// Whether a header occurs, once or several times.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.headers.iter().any(|(known, _)| known.eq_ignore_ascii_case(name))
    }

    /// The key of a request to switch to a WebSocket.
    pub(crate) fn socket_key(&self) -> Option<&str> {
        let upgrades = self.header("Upgrade").is_some_and(|to| to.eq_ignore_ascii_case("websocket"));
        let version = self.header("Sec-WebSocket-Version") == Some("13");
        self.header("Sec-WebSocket-Key").filter(|_| upgrades && version)
    }
}

/// Reads the head of a request. `None` if the client sends something else, too much, or nothing for too long,
/// which is a shorter time while the server `is_crowded`.
pub(crate) fn read(stream: &mut TcpStream, is_crowded: impl Fn() -> bool) -> Option<Head> {
    let started = Instant::now();
    let mut bytes = Vec::new();
    let mut block = [0; 4096];
    stream.set_read_timeout(Some(PATIENCE_IN_A_CROWD / 4)).ok()?;
    loop {
        let patience = if is_crowded() { PATIENCE_IN_A_CROWD } else { PATIENCE };
        if started.elapsed() >= patience {
            return None;
        }
        let n = match stream.read(&mut block) {
            Ok(0) => return None,
            Ok(n) => n,
            Err(error) if is_waiting(error.kind()) => continue,
            Err(_) => return None,
        };
        bytes.extend_from_slice(block.get(..n)?);
        match parse(&bytes) {
            Parsed::Head(head) => return Some(head),
            Parsed::Partial if bytes.len() < MAX_HEAD => {}
            Parsed::Partial | Parsed::Wrong => return None,
        }
    }
}

/// Whether a read ended only because nothing has come yet.
pub(crate) fn is_waiting(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

enum Parsed {
    Head(Head),
    Partial,
    Wrong,
}

fn parse(bytes: &[u8]) -> Parsed {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(bytes) {
        Ok(httparse::Status::Complete(length)) => {
            let text = |value: &[u8]| String::from_utf8_lossy(value).into_owned();
            Parsed::Head(Head {
                method: request.method.unwrap_or_default().to_string(),
                path: request.path.unwrap_or_default().to_string(),
                headers: request.headers.iter().map(|h| (h.name.to_string(), text(h.value))).collect(),
                rest: bytes.get(length..).unwrap_or_default().to_vec(),
            })
        }
        Ok(httparse::Status::Partial) => Parsed::Partial,
        Err(_) => Parsed::Wrong,
    }
}

/// An answer without a socket.
pub(crate) struct Answer<'a> {
    pub(crate) status: &'a str,
    pub(crate) kind: &'a str,
    pub(crate) body: &'a str,
    /// The content security policy.
    pub(crate) policy: &'a str,
}

/// Sends an answer. A client that is gone does not get it.
pub(crate) fn answer(stream: &mut TcpStream, answer: &Answer<'_>) {
    let Answer { status, kind, body, policy } = answer;
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\
         Cache-Control: no-store\r\nContent-Security-Policy: {policy}\r\nX-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\
         Cross-Origin-Opener-Policy: same-origin\r\nX-Frame-Options: DENY\r\n\r\n",
        body.len()
    );
    let _ = stream.write_all(head.as_bytes());
    let _ = stream.write_all(body.as_bytes());
    let _ = stream.flush();
    let _ = stream.shutdown(std::net::Shutdown::Write);
    drain(stream);
}

/// Reads what the client still sends, for a moment and up to the size of a head: closing with bytes unread
/// would reset the connection, and the client could lose the answer.
fn drain(stream: &mut TcpStream) {
    let started = Instant::now();
    let (mut block, mut room) = ([0; 4096], MAX_HEAD);
    while let Some(left) = LINGER.checked_sub(started.elapsed()).filter(|left| !left.is_zero()) {
        let _ = stream.set_read_timeout(Some(left));
        match stream.read(&mut block) {
            Ok(0) | Err(_) => return,
            Ok(n) if n >= room => return,
            Ok(n) => room -= n,
        }
    }
}

/// Switches the connection to a WebSocket.
pub(crate) fn switch(stream: &mut TcpStream, key: &str) -> std::io::Result<()> {
    let digest = Sha1::digest(format!("{key}{KEY_SUFFIX}").as_bytes());
    let accept = base64::engine::general_purpose::STANDARD.encode(digest);
    write!(
        stream,
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {accept}\r\n\r\n"
    )?;
    stream.flush()
}

#[cfg(test)]
#[allow(clippy::panic, reason = "a test says what must hold")]
mod tests {
    use super::*;

    #[test]
    fn heads_are_read_whole() {
        let text = "GET /a/b HTTP/1.1\r\nHost: x\r\nOrigin: a\r\norigin: b\r\n\r\nrest";
        let Parsed::Head(head) = parse(text.as_bytes()) else { panic!("no head") };
        assert_eq!(
            (head.method.as_str(), head.path.as_str(), head.rest.as_slice()),
            ("GET", "/a/b", &b"rest"[..])
        );
        assert_eq!(head.header("host"), Some("x"));
        assert_eq!(head.header("Origin"), None, "which of the two?");
        assert!(head.has("Origin") && !head.has("Upgrade"));
        assert!(matches!(parse(b"GET / HT"), Parsed::Partial));
        assert!(matches!(parse(b"\x16\x03\x01\x00"), Parsed::Wrong), "a client that speaks TLS");
    }
}
