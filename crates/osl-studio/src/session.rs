//! One open page: reads its requests, decides which work is next and which is outdated, and sends the
//! answers.
//!
//! Two threads share an [`Inbox`]. The reader puts the newest request there, lets the subject cancel the work
//! that it makes outdated, and looks at the files. The worker takes requests, asks the subject, and sends.
//! Only the newest request of each kind is kept, so a fast page and a slow shader need no queue. A page that
//! does not read its answers stops only its own worker.

use crate::http::is_waiting;
use crate::protocol::{self, Edit, MAX_MESSAGE, Picture, Request, State};
use crate::subject::{Files, First, Outdate, Stop, Subject};
use osl_limits::Cancel;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

/// The interval between looks at the files.
const EVERY: Duration = Duration::from_millis(150);
/// The pause between two looks at many files is so many times longer than a look.
const REST: u32 = 40;
/// How long a client may take to receive a message.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);
/// How long a small picture may wait for a page that does not read.
const SOON: Duration = Duration::from_millis(20);
/// A small picture comes first if the whole one takes longer than the first of these times; after each
/// further one its pixels are twice as wide.
const SMALL_ABOVE: [Duration; 3] =
    [Duration::from_millis(25), Duration::from_millis(600), Duration::from_millis(2400)];

/// What the worker has to do.
#[derive(Default)]
struct Inbox {
    /// Cancels the work on the present state, and begins another one.
    outdate: Option<Outdate>,
    /// The work on the present state.
    present: Cancel,
    state: Option<(u64, State)>,
    point: Option<(u64, [usize; 2])>,
    line: Option<(u64, u32)>,
    pin: Option<(u64, bool)>,
    group: Option<u64>,
    save: Option<(u64, Edit)>,
    /// The payload of a ping.
    ping: Option<tungstenite::Bytes>,
    /// A file has changed.
    changed: bool,
    closed: bool,
    /// The work that is being done.
    running: Option<Running>,
    /// The files of the shader, and those of its last picture.
    files: [Files; 2],
}

/// Indices of the two lists of files.
const OF_SHADER: usize = 0;
const OF_PICTURE: usize = 1;

struct Running {
    cancel: Cancel,
    kind: Work,
}

/// What a newer request of the same kind makes outdated.
#[derive(Clone, Copy, PartialEq)]
enum Work {
    Picture,
    Point,
    Line,
    /// Nothing: the values that the page pins, and the text that it copies, are those of the state at that
    /// time.
    Pin,
    /// Nothing: a text is saved whole.
    Save,
}

/// Work that was taken from the inbox.
enum Task {
    Picture {
        state: Option<(u64, State)>,
        changed: bool,
    },
    Point(u64, [usize; 2]),
    Line(u64, u32),
    Pin(u64, bool),
    Group(u64),
    /// A text for the file of the newest state, if that is not shown yet.
    Save {
        id: u64,
        edit: Edit,
        newest: Option<State>,
    },
    Pong(tungstenite::Bytes),
}

#[derive(Default)]
struct Shared {
    inbox: Mutex<Inbox>,
    wake: Condvar,
}

impl Shared {
    /// The inbox. It is valid also if a thread failed while it held it.
    fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the inbox, and wakes the worker.
    fn put(&self, change: impl FnOnce(&mut Inbox)) {
        change(&mut self.inbox());
        self.wake.notify_all();
    }

    /// Waits for work. `None` when the page is closed.
    fn take(&self) -> Option<(Task, Cancel)> {
        let mut inbox = self.inbox();
        loop {
            inbox.running = None;
            if inbox.closed {
                return None;
            }
            let task = if let Some(payload) = inbox.ping.take() {
                Some(Task::Pong(payload))
            } else if let Some((id, edit)) = inbox.save.take() {
                let newest = inbox.state.as_ref().map(|(_, state)| state.clone());
                Some(Task::Save { id, edit, newest })
            } else if inbox.state.is_some() || inbox.changed {
                let changed = std::mem::take(&mut inbox.changed);
                Some(Task::Picture { state: inbox.state.take(), changed })
            } else if let Some((id, pinned)) = inbox.pin.take() {
                Some(Task::Pin(id, pinned))
            } else if let Some(id) = inbox.group.take() {
                Some(Task::Group(id))
            } else if let Some((id, at)) = inbox.point.take() {
                Some(Task::Point(id, at))
            } else {
                inbox.line.take().map(|(id, line)| Task::Line(id, line))
            };
            if let Some(task) = task {
                let kind = match task {
                    Task::Point(..) => Work::Point,
                    Task::Line(..) => Work::Line,
                    Task::Pin(..) | Task::Group(_) => Work::Pin,
                    Task::Save { .. } => Work::Save,
                    Task::Picture { .. } | Task::Pong(_) => Work::Picture,
                };
                // What a newer state does not outdate ends only with the page.
                let cancel = match kind {
                    Work::Pin | Work::Save => Cancel::new(),
                    Work::Picture | Work::Point | Work::Line => inbox.present.part(),
                };
                inbox.running = Some(Running { cancel: cancel.clone(), kind });
                return Some((task, cancel));
            }
            inbox = self.wake.wait(inbox).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Inbox {
    /// Cancels the work that is being done, if it is of this kind.
    fn cancel(&self, kind: Work) {
        if self.running.as_ref().is_some_and(|running| running.kind == kind) {
            self.cancel_all();
        }
    }

    /// Cancels the work for a state that is outdated.
    fn cancel_outdated(&mut self) {
        self.present = self.outdate.as_ref().map(|outdate| outdate(None)).unwrap_or_default();
    }

    /// Cancels the work that is being done.
    fn cancel_all(&self) {
        self.running.iter().for_each(|running| running.cancel.cancel());
    }

    /// Watches these files in place of the former ones of this list. A file that was watched keeps its stamp,
    /// so that no change is missed.
    fn watch(&mut self, list: usize, mut files: Files) {
        for (path, stamp) in &mut files {
            if let Some(known) = self.files.iter().find_map(|list| list.get(path)) {
                stamp.clone_from(known);
            }
        }
        if let Some(list) = self.files.get_mut(list) {
            *list = files;
        }
    }

    fn request(&mut self, request: Request) {
        match request {
            Request::State { id, state } => {
                self.cancel_outdated();
                self.state = Some((id, state));
            }
            Request::Point { id, at } => {
                self.cancel(Work::Point);
                self.point = Some((id, at));
            }
            Request::Line { id, line } => {
                self.cancel(Work::Line);
                self.line = Some((id, line));
            }
            Request::Pin { id, pinned } => self.pin = Some((id, pinned)),
            Request::Group { id } => self.group = Some(id),
            Request::Unsaved(text) => {
                self.present = self.outdate.as_ref().map(|outdate| outdate(Some(&text))).unwrap_or_default();
                self.changed = true;
            }
            Request::Save { id, edit } => {
                // The picture of the old text is not waited for; afterwards the file is shown again.
                self.cancel_outdated();
                self.save = Some((id, edit));
                self.changed = true;
            }
        }
    }
}

/// The half of a connection that is read. Answers of the protocol itself, such as that to a ping, are the
/// worker's, so nothing is written here.
struct ReadHalf(TcpStream);

impl Read for ReadHalf {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        self.0.read(bytes)
    }
}

impl Write for ReadHalf {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Serves a page until it is closed. `rest` was sent after the request; `turn` is held while a picture is
/// made, so that many pages do not need the memory of as many pictures.
pub(crate) fn run(stream: TcpStream, rest: Vec<u8>, subject: Box<dyn Subject>, turn: Arc<Mutex<()>>) {
    let Ok(writing) = stream.try_clone() else { return };
    let shared = Arc::new(Shared::default());
    shared.put(|inbox| {
        inbox.outdate = Some(subject.outdate());
        inbox.cancel_outdated();
    });
    let worker = {
        let shared = shared.clone();
        let socket = WebSocket::from_raw_socket(writing, Role::Server, None);
        let work = move || {
            let mut worker = Worker { subject, socket, turn, shared, state: None, whole: None };
            worker.work();
            // Ends the reader too.
            let _ = worker.socket.get_ref().shutdown(Shutdown::Both);
        };
        std::thread::Builder::new().name("studio work".to_string()).spawn(work)
    };
    if worker.is_ok() {
        read(stream, rest, &shared);
    }
    shared.put(|inbox| {
        inbox.cancel_all();
        inbox.closed = true;
    });
    if let Ok(worker) = worker {
        let _ = worker.join();
    }
}

/// Reads requests until the page is closed or breaks a rule.
fn read(stream: TcpStream, rest: Vec<u8>, shared: &Shared) {
    if stream.set_read_timeout(Some(EVERY)).is_err() {
        return;
    }
    let config = WebSocketConfig::default()
        .read_buffer_size(8 << 10)
        .max_message_size(Some(MAX_MESSAGE))
        .max_frame_size(Some(MAX_MESSAGE));
    let mut socket = WebSocket::from_partially_read(ReadHalf(stream), rest, Role::Server, Some(config));
    let (mut looked, mut pause) = (Instant::now(), EVERY);
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => match serde_json::from_str(&text) {
                Ok(request) => shared.put(|inbox| inbox.request(request)),
                Err(_) => return,
            },
            Ok(Message::Ping(payload)) => shared.put(|inbox| inbox.ping = Some(payload)),
            Ok(Message::Pong(_)) => {}
            Ok(Message::Binary(_) | Message::Close(_) | Message::Frame(_)) => return,
            Err(tungstenite::Error::Io(error)) if is_waiting(error.kind()) => {}
            Err(_) => return,
        }
        if looked.elapsed() >= pause {
            looked = Instant::now();
            look(shared);
            pause = EVERY.max(looked.elapsed() * REST);
        }
        if shared.inbox().closed {
            return;
        }
    }
}

/// Looks at the files of the last answer. A file that is gone is mostly about to be replaced.
fn look(shared: &Shared) {
    let mut files = shared.inbox().files.clone();
    let mut changed = false;
    for (path, before) in files.iter_mut().flatten() {
        let now = osl_files::stamp(path);
        if now.is_some() && now != *before {
            *before = now;
            changed = true;
        }
    }
    if changed {
        shared.put(|inbox| {
            for (known, seen) in inbox.files.iter_mut().zip(files) {
                for (path, stamp) in seen {
                    known.entry(path).and_modify(|known| *known = stamp);
                }
            }
            inbox.cancel_outdated();
            inbox.changed = true;
        });
    }
}

/// The thread that computes and sends.
struct Worker {
    subject: Box<dyn Subject>,
    socket: WebSocket<TcpStream>,
    turn: Arc<Mutex<()>>,
    shared: Arc<Shared>,
    /// The state that is shown.
    state: Option<(u64, State)>,
    /// How long the last whole picture took.
    whole: Option<Duration>,
}

/// The page cannot be reached any more.
struct Gone;

/// How many columns and rows of the picture a pixel of a small one stands for; none if no small picture is
/// worth its time. `whole` is the time of the last whole picture.
fn step(whole: Option<Duration>) -> Option<usize> {
    let Some(whole) = whole else { return Some(4) };
    let times = SMALL_ABOVE.iter().filter(|time| whole > **time).count();
    (times > 0).then(|| 2 << times)
}

/// Sends a small picture. If the page does not read, the rest of it goes before the next message, so that a
/// page that is slow does not keep others waiting.
fn send_soon(socket: &mut WebSocket<TcpStream>, message: Message) -> Result<(), Gone> {
    let _ = socket.get_ref().set_write_timeout(Some(SOON));
    let sent = socket.send(message);
    let _ = socket.get_ref().set_write_timeout(Some(PATIENCE));
    match sent {
        Err(tungstenite::Error::Io(error)) if is_waiting(error.kind()) => Ok(()),
        sent => sent.map_err(|_| Gone),
    }
}

impl Worker {
    fn work(&mut self) {
        while let Some((task, cancel)) = self.shared.take() {
            let done = match task {
                Task::Pong(payload) => self.send(Message::Pong(payload)),
                Task::Point(id, at) => self.point(id, at, &cancel),
                Task::Line(id, line) => self.line(id, line, &cancel),
                Task::Pin(id, pinned) => self.pin(id, pinned, &cancel),
                Task::Group(id) => self.group(id, &cancel),
                Task::Save { id, edit, newest } => self.save(id, &edit, newest),
                Task::Picture { state, changed } => self.show(state, changed, &cancel),
            };
            if done.is_err() {
                break;
            }
        }
        self.shared.put(|inbox| inbox.closed = true);
    }

    fn send(&mut self, message: Message) -> Result<(), Gone> {
        self.socket.send(message).map_err(|_| Gone)
    }

    /// Shows a new state, or the old one after a change of its files.
    fn show(&mut self, state: Option<(u64, State)>, changed: bool, cancel: &Cancel) -> Result<(), Gone> {
        let before = self.state.take();
        let Some((id, state)) = state.or_else(|| before.clone()) else { return Ok(()) };
        let same_file = before.is_some_and(|(_, before)| before.file == state.file);
        self.state = Some((id, state.clone()));
        if changed || !same_file {
            let mut files = Files::new();
            let result = self.in_turn(|subject| subject.shader(&state, &mut files));
            self.shared.inbox().watch(OF_SHADER, files);
            match result {
                Ok(shader) => {
                    let is_broken = shader.layers.is_empty();
                    self.send(Message::text(protocol::shader(&shader)))?;
                    if is_broken {
                        return self.send(Message::text(protocol::failed(id, &[])));
                    }
                }
                Err(Stop::Cancelled) => return Ok(()),
                Err(Stop::Failed(messages)) => {
                    return self.send(Message::text(protocol::failed(id, &messages)));
                }
            }
        }
        self.picture(id, &state, cancel)
    }

    /// Makes and sends a picture, and a small one before it if it takes long.
    fn picture(&mut self, id: u64, state: &State, cancel: &Cancel) -> Result<(), Gone> {
        let Worker { subject, socket, turn, whole, .. } = self;
        let (mut files, mut sent) = (Files::new(), Ok(()));
        let started = Instant::now();
        let mut show = |picture: Picture| {
            if !cancel.is_cancelled() {
                let message = protocol::picture(id, true, started.elapsed().as_secs_f64(), &picture);
                sent = send_soon(socket, Message::binary(message));
            }
        };
        let first = step(*whole).map(|step| First { step, show: &mut show });
        let result = {
            let _turn = turn.lock().unwrap_or_else(PoisonError::into_inner);
            match cancel.is_cancelled() {
                true => Err(Stop::Cancelled),
                false => subject.picture(state, first, cancel, &mut files),
            }
        };
        sent?;
        // Work that was given up has read only some of its files.
        if !matches!(result, Err(Stop::Cancelled)) {
            self.shared.inbox().watch(OF_PICTURE, files);
        }
        match result {
            Ok(picture) => {
                let time = started.elapsed();
                self.whole = Some(time);
                let message = protocol::picture(id, false, time.as_secs_f64(), &picture);
                self.send(Message::binary(message))
            }
            Err(Stop::Cancelled) => Ok(()),
            Err(Stop::Failed(messages)) => self.send(Message::text(protocol::failed(id, &messages))),
        }
    }

    /// Explains a point of the state that is shown.
    fn point(&mut self, id: u64, at: [usize; 2], cancel: &Cancel) -> Result<(), Gone> {
        let Some((_, state)) = self.state.clone() else { return Ok(()) };
        let text = match self.in_turn(|subject| subject.explain(&state, at, cancel)) {
            Ok(text) => protocol::explanation(id, at, &text),
            // Every point has an answer, so that the page can ask for one after another.
            Err(Stop::Cancelled) => protocol::unexplained(id, at, &[]),
            Err(Stop::Failed(messages)) => protocol::unexplained(id, at, &messages),
        };
        self.send(Message::text(text))
    }

    /// Shows what a line of the present state does.
    fn line(&mut self, id: u64, line: u32, cancel: &Cancel) -> Result<(), Gone> {
        let Some((_, state)) = self.state.clone() else { return Ok(()) };
        let asked = self.in_turn(|subject| match cancel.is_cancelled() {
            true => Err(Stop::Cancelled),
            false => subject.line(&state, line, cancel),
        });
        let text = match asked {
            Ok(found) => protocol::line(id, line, &found),
            Err(Stop::Cancelled) => protocol::unshown(id, line, &[]),
            Err(Stop::Failed(messages)) => protocol::unshown(id, line, &messages),
        };
        self.send(Message::text(text))
    }

    /// Keeps the values of the present state, or forgets those that are kept.
    fn pin(&mut self, id: u64, pinned: bool, cancel: &Cancel) -> Result<(), Gone> {
        let state = self.state.as_ref().map(|(_, state)| state.clone()).filter(|_| pinned);
        let text = match self.in_turn(|subject| subject.pin(state.as_ref(), cancel)) {
            Ok(()) => protocol::pinned(id, pinned, &[]),
            Err(Stop::Cancelled) => protocol::pinned(id, false, &[]),
            Err(Stop::Failed(messages)) => protocol::pinned(id, false, &messages),
        };
        self.send(Message::text(text))
    }

    /// Writes the state that is shown as the text of a group.
    fn group(&mut self, id: u64, cancel: &Cancel) -> Result<(), Gone> {
        let result = match self.state.clone() {
            Some((_, state)) => self.in_turn(|subject| subject.group(&state, cancel)),
            None => Err(Stop::error("the page shows no file")),
        };
        self.send(Message::text(match result {
            Ok(text) => protocol::group(id, Some(&text), &[]),
            Err(Stop::Cancelled) => protocol::group(id, None, &[]),
            Err(Stop::Failed(messages)) => protocol::group(id, None, &messages),
        }))
    }

    /// Saves a text as the file of the state that is shown, or of a newer one. It does not wait for its turn,
    /// because it needs no memory for a picture.
    fn save(&mut self, id: u64, edit: &Edit, newest: Option<State>) -> Result<(), Gone> {
        let shown = self.state.as_ref().map(|(_, state)| state);
        let result = match newest.as_ref().or(shown) {
            Some(state) => self.subject.save(state, edit),
            None => Err(Stop::error("not saved: the page shows no file")),
        };
        self.send(Message::text(match result {
            Ok(saved) => protocol::saved(id, &saved),
            Err(Stop::Cancelled) => protocol::unsaved(id, &[]),
            Err(Stop::Failed(messages)) => protocol::unsaved(id, &messages),
        }))
    }

    /// Asks the subject, when no other page does.
    fn in_turn<T>(&mut self, ask: impl FnOnce(&mut dyn Subject) -> T) -> T {
        let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        ask(&mut *self.subject)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn a_page_watches_the_files_of_its_last_answers_only() {
        let mut inbox = Inbox::default();
        let files = |name: String| Files::from([(PathBuf::from(name), None)]);
        inbox.watch(OF_SHADER, files("a.osl".to_string()));
        for at in 0..2000 {
            inbox.watch(OF_PICTURE, files(format!("{at}.png")));
        }
        let watched: Vec<_> = inbox.files.iter().flat_map(|list| list.keys()).collect();
        assert_eq!(watched, [&PathBuf::from("a.osl"), &PathBuf::from("1999.png")]);
    }
}
