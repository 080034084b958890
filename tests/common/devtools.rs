//! Remote control of a page in a headless browser: the DevTools protocol over two pipes.
//!
//! Source: the Chrome DevTools Protocol (domains Target, Runtime, Log, Input); messages are JSON that ends with a zero
//! byte.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use serde_json::{Value, json};

use super::headless::FLAGS;

/// Open page; dropping it closes the browser.
pub struct Page {
    browser: Child,
    to: File,
    from: BufReader<File>,
    session: Option<String>,
    asked: u64,
    problems: Vec<String>,
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.browser.kill();
        let _ = self.browser.wait();
    }
}

impl Page {
    /// Opens an address; profile and pipes are in the folder.
    pub fn open(browser: &Path, folder: &Path, address: &str) -> Self {
        let pipes = ["to", "from"].map(|name| folder.join(name));
        assert!(Command::new("mkfifo").args(&pipes).status().unwrap().success());
        // The browser reads questions from its file 3 and writes answers to its file 4.
        let browser = Command::new("sh")
            .args(["-c", "exec \"$@\" 3<\"$TO\" 4>\"$FROM\"", "sh"])
            .arg(browser)
            .args(FLAGS)
            .args(["--remote-debugging-pipe", "about:blank"])
            .arg(format!("--user-data-dir={}", folder.join("profile").display()))
            .env("TO", &pipes[0])
            .env("FROM", &pipes[1])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let to = File::options().write(true).open(&pipes[0]).unwrap();
        let from = BufReader::new(File::open(&pipes[1]).unwrap());
        let mut page = Self { browser, to, from, session: None, asked: 0, problems: Vec::new() };
        let target = page.ask("Target.createTarget", &json!({ "url": "about:blank" }))["targetId"].clone();
        let attached = page.ask("Target.attachToTarget", &json!({ "targetId": target, "flatten": true }));
        page.session = attached["sessionId"].as_str().map(str::to_owned);
        for domain in ["Runtime.enable", "Log.enable", "Page.enable"] {
            page.ask(domain, &json!({}));
        }
        page.ask("Page.navigate", &json!({ "url": address }));
        page
    }

    /// Returns the value of an expression, or of its promise.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let question = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.ask("Runtime.evaluate", &question);
        assert!(answer["exceptionDetails"].is_null(), "{answer}");
        answer["result"]["value"].clone()
    }

    /// Returns the value of an expression once it is not null.
    pub fn once(&mut self, expression: &str) -> Value {
        let value = self.evaluate(&format!(
            "new Promise((done) => {{ const end = Date.now() + 60000; const look = () => {{ const found = {expression}; \
             if (found === null && Date.now() < end) setTimeout(look, 50); else done(found); }}; look(); }})"
        ));
        assert!(!value.is_null(), "{expression} stayed null");
        value
    }

    /// Presses a key.
    pub fn press(&mut self, key: &str) {
        for kind in ["rawKeyDown", "keyUp"] {
            let code = if key == "Tab" { 9 } else { 0 };
            self.ask(
                "Input.dispatchKeyEvent",
                &json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code }),
            );
        }
    }

    /// Presses the left button at the first place, moves to the second, and releases the button; places are `[x, y]` in
    /// the viewport.
    #[allow(dead_code)]
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2], clicks: u32) {
        let middle = [0, 1].map(|i| 0.5 * (from[i] + to[i]));
        let steps = [("mouseMoved", from), ("mousePressed", from), ("mouseMoved", middle), ("mouseMoved", to)];
        for (kind, [x, y]) in steps.into_iter().chain([("mouseReleased", to)]) {
            let button = if kind == "mouseMoved" { "none" } else { "left" };
            let event = json!({ "type": kind, "x": x, "y": y, "button": button, "clickCount": clicks });
            self.ask("Input.dispatchMouseEvent", &event);
        }
    }

    /// Sets the size of the viewport and the colour scheme.
    #[allow(dead_code)]
    pub fn view(&mut self, width: u32, height: u32, scheme: &str) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.ask("Emulation.setDeviceMetricsOverride", &size);
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.ask("Emulation.setEmulatedMedia", &json!({ "features": features }));
    }

    /// Returns the errors on the console so far.
    pub fn problems(&mut self) -> Vec<String> {
        self.evaluate("0");
        std::mem::take(&mut self.problems)
    }

    /// Sends a request to the browser, and reads messages until the response.
    fn ask(&mut self, method: &str, parameters: &Value) -> Value {
        self.asked += 1;
        let mut question = json!({ "id": self.asked, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            question["sessionId"] = json!(session);
        }
        self.to.write_all(format!("{question}\0").as_bytes()).unwrap();
        loop {
            let mut message = Vec::new();
            self.from.read_until(0, &mut message).unwrap();
            assert!(message.pop() == Some(0), "the browser has ended");
            let message: Value = serde_json::from_slice(&message).unwrap();
            if message["id"] == self.asked {
                assert!(message["error"].is_null(), "{method}: {message}");
                return message["result"].clone();
            }
            let bad = match message["method"].as_str() {
                Some("Runtime.exceptionThrown") => true,
                Some("Runtime.consoleAPICalled") => message["params"]["type"] == "error",
                Some("Log.entryAdded") => message["params"]["entry"]["level"] == "error",
                _ => false,
            };
            if bad {
                self.problems.push(message["params"].to_string());
            }
        }
    }
}
