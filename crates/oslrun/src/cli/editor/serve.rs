//! The loop of the server: reads messages, answers requests, and reports diagnostics when nothing waits.

use super::session::{Session, Stop};
use super::settings::Settings;
use gen_lsp_types::PublishDiagnosticsParams;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use osl_job::Failure;
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;

/// The error code for a request that is valid, but cannot be fulfilled.
const REQUEST_FAILED: i32 = -32803;

/// Serves an editor until it sends `exit` or closes the connection.
pub(super) fn serve(connection: &Connection, settings: Settings) -> Result<(), Failure> {
    let broken =
        |why: &dyn std::fmt::Display| Failure::new(format!("the editor does not start the session: {why}"));
    let (id, params) = connection.initialize_start().map_err(|why| broken(&why))?;
    let mut session = Session::new(settings);
    let told = session.configure(params.get("initializationOptions").unwrap_or(&Value::Null));
    session.refreshes =
        params.pointer("/capabilities/workspace/inlayHint/refreshSupport") == Some(&Value::Bool(true));
    let answer = json!({
        "capabilities": super::session::capabilities(),
        "serverInfo": { "name": "oslrun", "version": env!("CARGO_PKG_VERSION") },
    });
    connection.initialize_finish(id, answer).map_err(|why| broken(&why))?;
    // The connection hands over one message at a time, and reads no other before. The queue must be known as
    // a whole, so that outdated requests can be left out.
    let (to, messages) = mpsc::channel();
    let receiver = connection.receiver.clone();
    std::thread::spawn(move || receiver.iter().try_for_each(|message| to.send(message)));
    let mut server = Server { connection, messages, session, queue: VecDeque::new(), shut: false, asked: 0 };
    server.tell(told);
    while let Some(message) = server.next() {
        if !server.take(message) {
            return if server.shut {
                Ok(())
            } else {
                Err(Failure::new("the editor left without `shutdown`"))
            };
        }
    }
    Ok(())
}

struct Server<'a> {
    connection: &'a Connection,
    /// What the editor sends.
    messages: mpsc::Receiver<Message>,
    session: Session,
    /// Messages that wait.
    queue: VecDeque<Message>,
    /// Whether the editor asked to shut down.
    shut: bool,
    /// Number of requests that were sent.
    asked: i32,
}

impl Server<'_> {
    /// The next message; while none waits, changed texts are checked. `None` if the connection is closed.
    fn next(&mut self) -> Option<Message> {
        loop {
            self.queue.extend(self.messages.try_iter());
            self.cancel();
            if let Some(message) = self.queue.pop_front() {
                return Some(message);
            }
            let session = &mut self.session;
            match catch_unwind(AssertUnwindSafe(|| session.check_one())) {
                Ok(None) => return self.messages.recv().ok(),
                Ok(Some(list)) => list.into_iter().for_each(|params| self.publish(&params)),
                Err(_) => self.tell(Err("a text could not be checked: an internal error".to_string())),
            }
        }
    }

    /// Handles a message; false for the last one.
    fn take(&mut self, message: Message) -> bool {
        match message {
            Message::Request(request) => self.answer(request),
            Message::Notification(note) if note.method == "exit" => return false,
            Message::Notification(note) => self.note(note),
            // Answers to refreshes.
            Message::Response(_) => {}
        }
        true
    }

    /// Takes cancelled requests out of the queue, before anything else is done.
    fn cancel(&mut self) {
        let is_cancel = |message: &Message| matches!(message, Message::Notification(note) if note.method == "$/cancelRequest");
        while let Some(Message::Notification(note)) =
            self.queue.iter().position(is_cancel).and_then(|at| self.queue.remove(at))
        {
            let is_meant = |message: &Message| matches!(message, Message::Request(request) if note.params.get("id") == Some(&json!(request.id)));
            let meant = self.queue.iter().position(is_meant).and_then(|at| self.queue.remove(at));
            if let Some(Message::Request(request)) = meant {
                let code = ErrorCode::RequestCanceled as i32;
                self.send(Response::new_err(request.id, code, "cancelled".to_string()).into());
            }
        }
    }

    fn note(&mut self, note: Notification) {
        let session = &mut self.session;
        let taken = guarded(|| session.note(&note.method, note.params));
        match taken {
            Ok(list) => list.iter().for_each(|params| self.publish(params)),
            Err(Stop::Failed(why) | Stop::Params(why) | Stop::Internal(why)) => self.tell(Err(why)),
            Err(Stop::Unknown) => {}
        }
        if std::mem::take(&mut self.session.stale_hints) && self.session.refreshes {
            self.asked += 1;
            let id = RequestId::from(format!("oslrun-{}", self.asked));
            self.send(Request::new(id, "workspace/inlayHint/refresh".to_string(), Value::Null).into());
        }
    }

    fn answer(&mut self, request: Request) {
        let Request { id, method, params } = request;
        if method == "shutdown" && !self.shut {
            self.shut = true;
            return self.send(Response::new_ok(id, Value::Null).into());
        }
        let session = &mut self.session;
        let result = if self.shut {
            Err(Stop::Params("the server is shut down".to_string()))
        } else {
            guarded(|| session.answer(&method, params))
        };
        let response = match result {
            Ok(value) => Response::new_ok(id, value),
            Err(Stop::Failed(why)) => Response::new_err(id, REQUEST_FAILED, why),
            Err(Stop::Params(why)) => Response::new_err(id, ErrorCode::InvalidParams as i32, why),
            Err(Stop::Internal(why)) => Response::new_err(id, ErrorCode::InternalError as i32, why),
            Err(Stop::Unknown) => {
                Response::new_err(id, ErrorCode::MethodNotFound as i32, format!("there is no {method}"))
            }
        };
        self.send(response.into());
    }

    fn publish(&self, params: &PublishDiagnosticsParams) {
        self.send(Notification::new("textDocument/publishDiagnostics".to_string(), params).into());
    }

    /// Shows an error to the user.
    fn tell(&self, result: Result<(), String>) {
        if let Err(message) = result {
            let params = json!({ "type": 1, "message": message });
            self.send(Notification::new("window/showMessage".to_string(), params).into());
        }
    }

    /// Sends a message. If the connection is closed, the loop ends with the next message.
    fn send(&self, message: Message) {
        let _ = self.connection.sender.send(message);
    }
}

/// Runs some work. A panic becomes an error, so that the server lives.
fn guarded<T>(work: impl FnOnce() -> Result<T, Stop>) -> Result<T, Stop> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let why = panic.downcast_ref::<String>().map(String::as_str);
        let why = why.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("unknown");
        Err(Stop::Internal(format!("an internal error: {why}")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error() {
        let result = guarded(|| -> Result<(), Stop> { panic!("at {}", 7) });
        assert!(matches!(result, Err(Stop::Internal(why)) if why == "an internal error: at 7"));
    }
}
