//! The server: accepts connections on the loopback interface, turns away those that may not be here, and
//! answers with a file of the page or with a session.
//!
//! The number of connections is bounded, and so are the size of a message and the time for a request.

use crate::guard::{self, Token};
use crate::http::{self, Answer, Head};
use crate::subject::Subject;
use crate::{page, session};
use std::net::{Ipv4Addr, SocketAddrV4, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Maximum number of connections at a time.
const MAX_CONNECTIONS: usize = 160;

/// How the server is started.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The port; by default any that is free.
    pub port: Option<u16>,
    /// The secret in the address; by default a random one.
    pub token: Option<Token>,
}

/// Why the server does not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The port is taken, or not permitted.
    #[error("cannot listen on port {0} of the loopback interface: {1}")]
    Listen(u16, std::io::Error),
    /// There is no random secret.
    #[error("{0}")]
    Token(String),
}

/// A server that waits for connections.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    gate: Gate,
}

/// Who may connect.
#[derive(Clone, Debug)]
struct Gate {
    token: Token,
    port: u16,
}

/// Makes the subject of a connection.
type Make = dyn Fn() -> Box<dyn Subject> + Send + Sync;

impl Server {
    /// Starts to listen on the loopback interface.
    ///
    /// # Errors
    /// The port is taken or not permitted, or there is no random secret.
    pub fn new(options: Options) -> Result<Server, StartError> {
        let port = options.port.unwrap_or(0);
        let wrong = |why| StartError::Listen(port, why);
        let listener = TcpListener::bind(SocketAddrV4::new(Ipv4Addr::LOCALHOST, port)).map_err(wrong)?;
        let port = listener.local_addr().map_err(wrong)?.port();
        let token = options.token.map_or_else(Token::random, Ok).map_err(StartError::Token)?;
        Ok(Server { listener, gate: Gate { token, port } })
    }

    /// The address of the page.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.gate.port, self.gate.token.text())
    }

    /// Answers connections until the process ends. `make` makes the subject of each page.
    pub fn run(self, make: impl Fn() -> Box<dyn Subject> + Send + Sync + 'static) {
        let make: Arc<Make> = Arc::new(make);
        let (open, turn) = (Arc::new(AtomicUsize::new(0)), Arc::new(Mutex::new(())));
        loop {
            let Ok((stream, _)) = self.listener.accept() else {
                // Too many files are open, or a client was gone before it was accepted.
                std::thread::sleep(Duration::from_millis(20));
                continue;
            };
            let place = ConnectionSlot::take(&open);
            let (gate, make, turn) = (self.gate.clone(), make.clone(), turn.clone());
            let serve = move || gate.serve(stream, &place, &*make, turn);
            // If there is no thread for it, the connection is closed.
            let _ = std::thread::Builder::new().name("studio".to_string()).spawn(serve);
        }
    }
}

/// A place among the connections, free again when it is dropped.
struct ConnectionSlot {
    open: Arc<AtomicUsize>,
    is_free: bool,
}

/// From so many connections on, one that sends nothing is soon closed.
const CROWD: usize = MAX_CONNECTIONS / 2;

impl ConnectionSlot {
    fn take(open: &Arc<AtomicUsize>) -> ConnectionSlot {
        ConnectionSlot { is_free: open.fetch_add(1, Ordering::Relaxed) < MAX_CONNECTIONS, open: open.clone() }
    }

    /// Whether many connections are open.
    fn is_in_a_crowd(&self) -> bool {
        self.open.load(Ordering::Relaxed) > CROWD
    }
}

impl Drop for ConnectionSlot {
    fn drop(&mut self) {
        self.open.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Why a request is refused: the status, and a sentence for whoever reads it.
type Refusal = (&'static str, &'static str);

const FORBIDDEN: &str = "403 Forbidden";

impl Gate {
    /// Answers the request of a connection.
    fn serve(&self, mut stream: TcpStream, slot: &ConnectionSlot, make: &Make, turn: Arc<Mutex<()>>) {
        let _ = stream.set_write_timeout(Some(session::PATIENCE));
        let _ = stream.set_nodelay(true);
        let policy = guard::policy(self.port);
        let refuse = |stream: &mut TcpStream, (status, why): Refusal| {
            let body = &format!("oslrun studio: {why}\n");
            http::answer(
                stream,
                &Answer { status, kind: "text/plain; charset=utf-8", body, policy: &policy },
            );
        };
        if !slot.is_free {
            return refuse(&mut stream, ("503 Service Unavailable", "too many pages are open; close some"));
        }
        let Some(head) = http::read(&mut stream, || slot.is_in_a_crowd()) else {
            return refuse(&mut stream, ("400 Bad Request", "this is not a request that a browser sends"));
        };
        let name = match self.admit(&head) {
            Ok(name) => name,
            Err(refusal) => return refuse(&mut stream, refusal),
        };
        if name == "socket" {
            match head.socket_key() {
                Some(key) if http::switch(&mut stream, key).is_ok() => {
                    session::run(stream, head.rest, make(), turn);
                }
                Some(_) => {}
                None => refuse(&mut stream, ("426 Upgrade Required", "this address is for a WebSocket")),
            }
            return;
        }
        match page::file(name) {
            Some(page::File { kind, text: body }) => {
                http::answer(&mut stream, &Answer { status: "200 OK", kind, body, policy: &policy });
            }
            None => refuse(&mut stream, ("404 Not Found", "the page has no such file")),
        }
    }

    /// The name of the requested file; or why the request is refused.
    fn admit<'a>(&self, head: &'a Head) -> Result<&'a str, Refusal> {
        if !guard::is_host(head.header("Host"), self.port) {
            return Err((FORBIDDEN, "the request is for another host"));
        }
        let origin = head.header("Origin").map(|origin| guard::is_origin(origin, self.port));
        if head.has("Origin") && origin != Some(true) {
            return Err((FORBIDDEN, "the request comes from another page"));
        }
        let path = head.path.split('?').next().unwrap_or_default();
        let Some(name) = self.token.rest(path) else {
            return Err((FORBIDDEN, "the address lacks the token that the command printed"));
        };
        if head.method != "GET" {
            return Err(("405 Method Not Allowed", "a page is only read"));
        }
        if name == "socket" && origin.is_none() {
            return Err((FORBIDDEN, "a WebSocket says from which page it comes"));
        }
        Ok(name)
    }
}
