//! A browser that a test drives: Chromium, through the WebDriver protocol of ChromeDriver.

#![allow(dead_code, reason = "each test uses what it needs")]

use base64::Engine;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A failing test is better than one that waits for ever. A loaded machine may need minutes to start a
/// browser.
const PATIENCE: Duration = Duration::from_secs(300);
/// The name of an element in an answer of WebDriver.
const ELEMENT: &str = "element-6066-11e4-a52e-4f735466cecf";

/// The folder of a program in the search path.
fn found(names: &[&str]) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let places =
        std::env::split_paths(&path).flat_map(|folder| names.iter().map(move |name| folder.join(name)));
    places.into_iter().find(|place| place.is_file())
}

/// A browser with one page, ended when it is dropped.
pub(crate) struct Browser {
    driver: Child,
    port: u16,
    session: String,
    /// The profile of the browser.
    _profile: tempfile::TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.ask("DELETE", "", &Value::Null);
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

impl Browser {
    /// Starts a browser with a window of this size; or why there is none.
    pub(crate) fn start((width, height): (u32, u32), dark: bool) -> Result<Browser, String> {
        let driver = found(&["chromedriver"]).ok_or("chromedriver is not installed")?;
        let chromium =
            found(&["chromium", "chromium-browser", "google-chrome"]).ok_or("chromium is not installed")?;
        let mut command = Command::new(driver);
        let command =
            command.arg("--port=0").stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut driver = command.spawn().map_err(|why| format!("chromedriver does not start: {why}"))?;
        let mut lines = BufReader::new(driver.stdout.take().ok_or("no output")?).lines();
        let port = lines
            .by_ref()
            .map_while(Result::ok)
            .find_map(|line| line.split_once("successfully on port ")?.1.trim_end_matches('.').parse().ok());
        // It writes more, which nobody reads.
        std::thread::spawn(move || lines.for_each(drop));
        let profile = tempfile::tempdir().map_err(|why| why.to_string())?;
        let mut browser =
            Browser { driver, port: port.unwrap_or(0), session: String::new(), _profile: profile };
        if port.is_none() {
            return Err("chromedriver does not start".to_string());
        }
        let mut arguments = vec![
            "--headless=new".to_string(),
            "--no-sandbox".to_string(),
            "--disable-gpu".to_string(),
            "--disable-dev-shm-usage".to_string(),
            "--force-color-profile=srgb".to_string(),
            "--hide-scrollbars".to_string(),
            format!("--window-size={width},{height}"),
            format!("--user-data-dir={}", browser._profile.path().display()),
        ];
        if dark {
            arguments.push("--force-dark-mode".to_string());
        }
        let options = json!({ "args": arguments, "binary": chromium.display().to_string() });
        let always = json!({ "goog:chromeOptions": options, "goog:loggingPrefs": { "browser": "ALL" } });
        let answer = browser.ask("POST", "", &json!({ "capabilities": { "alwaysMatch": always } }))?;
        browser.session = answer["sessionId"].as_str().ok_or("chromium does not start")?.to_string();
        let milliseconds = PATIENCE.as_millis() as u64;
        browser.ask("POST", "/timeouts", &json!({ "script": milliseconds, "pageLoad": milliseconds }))?;
        let script = json!({ "script": "return [innerWidth, innerHeight]", "args": [] });
        let size = browser.ask("POST", "/execute/sync", &script)?;
        let (outer_width, outer_height) = (
            u64::from(width) * 2 - size[0].as_u64().unwrap_or(u64::from(width)),
            u64::from(height) * 2 - size[1].as_u64().unwrap_or(u64::from(height)),
        );
        browser.ask("POST", "/window/rect", &json!({ "width": outer_width, "height": outer_height }))?;
        Ok(browser)
    }

    /// The value of the answer to a command.
    fn ask(&self, method: &str, path: &str, body: &Value) -> Result<Value, String> {
        let session = if self.session.is_empty() { String::new() } else { format!("/{}", self.session) };
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let wrong = |why: std::io::Error| format!("{path}: {why}");
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).map_err(wrong)?;
        stream.set_read_timeout(Some(PATIENCE)).map_err(wrong)?;
        write!(
            stream,
            "{method} /session{session}{path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nConnection: close\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            self.port,
            body.len()
        )
        .map_err(wrong)?;
        let mut reader = BufReader::new(stream);
        let mut length = 0;
        loop {
            let mut line = String::new();
            reader.read_line(&mut line).map_err(wrong)?;
            let line = line.trim_end().to_ascii_lowercase();
            if line.is_empty() {
                break;
            }
            if let Some(text) = line.strip_prefix("content-length:") {
                length = text.trim().parse().unwrap_or(0);
            }
        }
        let mut text = vec![0; length];
        reader.read_exact(&mut text).map_err(wrong)?;
        let answer: Value = serde_json::from_slice(&text).map_err(|why| why.to_string())?;
        match answer["value"]["error"].as_str() {
            Some(error) => Err(format!("{path}: {error}: {}", answer["value"]["message"])),
            None => Ok(answer["value"].clone()),
        }
    }

    fn command(&self, path: &str, body: &Value) -> Value {
        self.ask("POST", path, body).unwrap()
    }

    /// Opens an address.
    pub(crate) fn open(&self, url: &str) {
        self.command("/url", &json!({ "url": url }));
    }

    /// Loads the page again.
    pub(crate) fn reload(&self) {
        self.command("/refresh", &json!({}));
    }

    /// Runs a function body in the page.
    pub(crate) fn run(&self, script: &str) -> Value {
        self.command("/execute/sync", &json!({ "script": script, "args": [] }))
    }

    /// Runs a function body in the page, whose last argument is called with the result.
    pub(crate) fn run_until(&self, script: &str) -> Value {
        self.command("/execute/async", &json!({ "script": script, "args": [] }))
    }

    /// Waits until an expression is true.
    pub(crate) fn wait(&self, condition: &str) {
        let started = Instant::now();
        while self.run(&format!("return Boolean({condition})")) != true {
            assert!(
                started.elapsed() < PATIENCE,
                "{condition}: {}",
                self.run("return document.body.innerText")
            );
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Moves the mouse over an element, from its middle; with `drag`, by this way with the button down.
    pub(crate) fn mouse(&self, selector: &str, (x, y): (i64, i64), drag: Option<(i64, i64)>) {
        let found = self.command("/element", &json!({ "using": "css selector", "value": selector }));
        let origin = json!({ ELEMENT: found[ELEMENT] });
        let mut actions =
            vec![json!({ "type": "pointerMove", "duration": 0, "origin": origin, "x": x, "y": y })];
        if let Some((right, down)) = drag {
            actions.push(json!({ "type": "pointerDown", "button": 0 }));
            actions.push(
                json!({ "type": "pointerMove", "duration": 500, "origin": "pointer", "x": right, "y": down }),
            );
            actions.push(json!({ "type": "pointerUp", "button": 0 }));
        }
        let mouse = json!({ "type": "pointer", "id": "mouse", "parameters": { "pointerType": "mouse" }, "actions": actions });
        self.command("/actions", &json!({ "actions": [mouse] }));
    }

    /// Turns the wheel at a place of the window.
    pub(crate) fn wheel(&self, (x, y): (i64, i64), down: i64) {
        let actions =
            json!([{ "type": "scroll", "duration": 0, "x": x, "y": y, "deltaX": 0, "deltaY": down }]);
        self.command(
            "/actions",
            &json!({ "actions": [{ "type": "wheel", "id": "wheel", "actions": actions }] }),
        );
    }

    /// Two fingers on an element, to the left and to the right of its middle, move from one distance to
    /// another.
    pub(crate) fn pinch(&self, selector: &str, from: i64, to: i64) {
        let found = self.command("/element", &json!({ "using": "css selector", "value": selector }));
        let origin = json!({ ELEMENT: found[ELEMENT] });
        let finger = |name: &str, side: i64| {
            let place = |x: i64, duration: u64| json!({ "type": "pointerMove", "duration": duration, "origin": origin, "x": x * side, "y": 0 });
            let actions = json!([
                place(from, 0),
                { "type": "pointerDown", "button": 0 },
                place(to, 300),
                { "type": "pointerUp", "button": 0 }
            ]);
            json!({ "type": "pointer", "id": name, "parameters": { "pointerType": "touch" }, "actions": actions })
        };
        self.command("/actions", &json!({ "actions": [finger("left", -1), finger("right", 1)] }));
    }

    /// Presses a key in the element that has the focus. WebDriver has a code point for each key.
    pub(crate) fn key(&self, key: char) {
        let actions = json!([{ "type": "keyDown", "value": key.to_string() }, { "type": "keyUp", "value": key.to_string() }]);
        self.command(
            "/actions",
            &json!({ "actions": [{ "type": "key", "id": "keys", "actions": actions }] }),
        );
    }

    /// What the page complained about.
    pub(crate) fn complaints(&self) -> Vec<String> {
        let log = self.command("/se/log", &json!({ "type": "browser" }));
        let entries = log.as_array().unwrap().iter();
        entries.filter(|entry| entry["level"] == "SEVERE").map(|entry| entry["message"].to_string()).collect()
    }

    /// Writes a picture of the window.
    pub(crate) fn screenshot(&self, path: &Path) {
        let text = self.ask("GET", "/screenshot", &Value::Null).unwrap();
        let bytes = base64::engine::general_purpose::STANDARD.decode(text.as_str().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}
