//! The live page of a run: access, content, and that no viewer delays the run.

#[path = "common/devtools.rs"]
mod devtools;
#[path = "common/headless.rs"]
mod headless;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

/// Run in progress and the address of its page; dropping it ends the run.
struct Watched {
    process: Child,
    port: u16,
    token: String,
}

impl Drop for Watched {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Starts a run with `--watch`.
fn watched(out: &Path, more: &[&str]) -> Watched {
    let mut process = Command::new(cargo_bin!("mops"))
        .args(["run", "pid-design", "--quiet", "--watch", "--out", out.to_str().unwrap()])
        .args(more)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut errors = BufReader::new(process.stderr.take().unwrap());
    let mut line = String::new();
    errors.read_line(&mut line).unwrap();
    // Further output must be read, so that the run does not block.
    std::thread::spawn(move || std::io::copy(&mut errors, &mut std::io::sink()));
    let address = line.trim().rsplit(' ').next().unwrap().to_owned();
    let rest = address.strip_prefix("http://127.0.0.1:").unwrap_or_else(|| panic!("{line}"));
    let (port, token) = rest.trim_end_matches('/').split_once('/').unwrap();
    Watched { process, port: port.parse().unwrap(), token: token.to_owned() }
}

/// A long search: each simulation takes a long time.
const LONG: [&str; 6] =
    ["--solver", "genetic", "--max-evaluations", "100000", "--set", "models.loop.pid-loop.horizon=\"20000 s\""];

impl Watched {
    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream
    }

    /// Returns the whole response to a request with this header.
    fn ask(&self, head: &str) -> String {
        let mut stream = self.connect();
        stream.write_all(head.as_bytes()).unwrap();
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        answer
    }

    /// Returns the states and responses that a viewer receives from now on.
    fn events(&self) -> impl Iterator<Item = Value> {
        let mut stream = self.connect();
        let head = format!("GET /{}/events HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", self.token, self.port);
        stream.write_all(head.as_bytes()).unwrap();
        let lines = BufReader::new(stream).lines().map_while(Result::ok);
        lines.filter_map(|line| serde_json::from_str(line.strip_prefix("data: ")?).ok())
    }

    /// Returns the first state that has a best point.
    fn first_state(&self) -> Value {
        self.events().find(|event| event["best"].is_object()).unwrap()
    }

    fn get(&self, path: &str, host: &str) -> String {
        self.ask(&format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n"))
    }
}

#[test]
fn the_page_requires_the_token_in_its_url() {
    let folder = tempfile::tempdir().unwrap();
    let run = watched(&folder.path().join("out"), &LONG);
    let (host, token) = (format!("127.0.0.1:{}", run.port), run.token.clone());
    assert!(token.len() >= 32 && token.chars().all(|c| c.is_ascii_hexdigit()), "{token}");

    let page = run.get(&format!("/{token}/"), &host);
    assert!(page.starts_with("HTTP/1.1 200 OK") && page.contains("<h1 id=\"study\">"), "{page}");
    assert!(page.contains("Content-Security-Policy: default-src 'none'"), "{page}");
    for file in ["style.css", "page.js"] {
        assert!(run.get(&format!("/{token}/{file}"), &host).starts_with("HTTP/1.1 200 OK"), "{file}");
    }
    let localhost = format!("localhost:{}", run.port);
    assert!(run.get(&format!("/{token}/"), &localhost).starts_with("HTTP/1.1 200 OK"));

    let status = |answer: String| answer.split(' ').nth(1).unwrap_or_default().to_owned();
    assert_eq!(status(run.get("/", &host)), "404");
    assert_eq!(status(run.get(&format!("/{}/", "0".repeat(32)), &host)), "404");
    assert_eq!(status(run.get(&format!("/{token}/../result.json"), &host)), "404");
    assert_eq!(status(run.get(&format!("/{token}/"), "rebound.example")), "403");
    assert_eq!(
        status(run.ask(&format!("POST /{token}/ HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\n\r\n"))),
        "405"
    );
    assert_eq!(status(run.ask("nonsense\r\n\r\n")), "400");
    assert_eq!(status(run.ask(&format!("GET /{token}/ HTTP/1.1\r\n\r\n"))), "403");
}

#[test]
fn events_count_only_committed_evaluations() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let run = watched(&out, &LONG);
    let state = run.first_state();
    assert_eq!((state["study"].as_str(), state["budget"].as_u64()), (Some("pid-design"), Some(100_000)));
    let reported = state["evaluations"].as_i64().unwrap();
    assert!(reported > 0 && !state["convergence"][0]["curves"].as_array().unwrap().is_empty(), "{state}");
    let criteria: Vec<&str> =
        state["criteria"].as_array().unwrap().iter().map(|criterion| criterion["name"].as_str().unwrap()).collect();
    assert_eq!(criteria, ["overshoot", "settling"]);
    let database = rusqlite::Connection::open(out.join("evaluations.sqlite")).unwrap();
    let written: i64 = database.query_row("SELECT count(*) FROM points", [], |row| row.get(0)).unwrap();
    assert!(written >= reported, "{reported} evaluations reported, {written} committed");
}

#[test]
fn the_stream_ends_with_the_last_state_and_the_responses_of_the_best_point() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = watched(&folder.path().join("out"), &["--solver", "genetic", "--max-evaluations", "20000"]);
    let events: Vec<Value> = run.events().collect();
    assert!(run.process.wait().unwrap().success());
    let last = events.iter().rfind(|event| event["study"].is_string()).unwrap();
    assert!(last["over"].is_string(), "{last}");
    let overshoot = last["criteria"].as_array().unwrap().iter().find(|row| row["name"] == "overshoot").unwrap();
    let responses = events.iter().rfind(|event| event["plots"].is_array()).unwrap();
    let curves = responses["plots"].as_array().unwrap().iter().flat_map(|plot| plot["curves"].as_array().unwrap());
    let highest = |curve: &Value| {
        let values = curve["y"].as_array().unwrap().iter().filter_map(Value::as_f64);
        values.fold(f64::NEG_INFINITY, f64::max)
    };
    // The setpoint is 1; the curve is rounded and has one value per pixel.
    let expected = 1.0 + overshoot["value"].as_f64().unwrap();
    let found: Vec<f64> = curves.map(highest).collect();
    assert!(found.iter().any(|found| (found - expected).abs() < 1e-4), "{found:?} {expected}");
}

#[test]
fn idle_and_faulty_viewers_do_not_affect_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let (alone, crowded) = (folder.path().join("alone"), folder.path().join("crowded"));
    let search = ["--solver", "genetic", "--max-evaluations", "20000"];
    let result = |out: &Path| {
        let mut result: Value = serde_json::from_slice(&std::fs::read(out.join("result.json")).unwrap()).unwrap();
        result.as_object_mut().unwrap().remove("seconds");
        result
    };
    let mut run = watched(&alone, &search);
    assert!(run.process.wait().unwrap().success());
    let mut run = watched(&crowded, &search);
    let head = format!("GET /{}/events HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", run.token, run.port);
    let mut viewers: Vec<TcpStream> = Vec::new();
    let elsewhere = head.replacen(&run.token, "nowhere", 1);
    let rebound = head.replacen("Host: 127.0.0.1", "Host: rebound.example", 1);
    for i in 0..60 {
        // Viewers send nothing or half a request, never read, disconnect at once, or request a wrong address. A
        // finished run accepts no connection: by then, viewers of each kind must have come.
        let Ok(mut viewer) = TcpStream::connect(("127.0.0.1", run.port)) else {
            assert!(i >= 12, "the run ended after {i} viewers");
            break;
        };
        let request = ["", &head[..head.len() / 2], &head, &head, &elsewhere, &rebound][i % 6];
        let _ = viewer.write_all(request.as_bytes());
        if i % 6 != 3 {
            viewers.push(viewer);
        }
    }
    assert!(run.process.wait().unwrap().success());
    assert_eq!(result(&crowded), result(&alone));
}

#[test]
fn idle_connections_do_not_block_other_viewers() {
    let folder = tempfile::tempdir().unwrap();
    let run = watched(&folder.path().join("out"), &LONG);
    let host = format!("127.0.0.1:{}", run.port);
    // Many more connections than the server accepts, all open at once; some have sent part of a request.
    let silent: Vec<TcpStream> = (0..200)
        .map(|i| {
            let mut stream = run.connect();
            if i % 2 == 0 {
                stream.write_all(b"GET /").unwrap();
            }
            stream
        })
        .collect();
    for _ in 0..3 {
        let page = run.get(&format!("/{}/", run.token), &host);
        assert!(page.starts_with("HTTP/1.1 200 OK"), "{page}");
    }
    assert_eq!(run.first_state()["study"], "pid-design");
    drop(silent);
}

#[test]
fn a_browser_shows_values_during_the_run_and_its_end() {
    let Some(browser) = headless::browser() else {
        eprintln!("{}", headless::SKIPPED);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut run = watched(&out, &LONG);
    run.first_state();
    let address = format!("http://127.0.0.1:{}/{}/", run.port, run.token);
    let mut page = devtools::Page::open(&browser, folder.path(), &address);
    let seen = page.once(
        "(() => { const shown = document.body?.dataset.shown; window.all ??= []; \
         if (shown && window.all.at(-1)?.[0] !== Number(shown)) window.all.push([Number(shown), document.querySelector('#share').value]); \
         return window.all.length >= 3 && document.querySelector('#tuners td') ? window.all : null; })()",
    );
    let seen: Vec<[f64; 2]> = serde_json::from_value(seen).unwrap();
    assert!(seen.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1]), "{seen:?}");
    let shown = page.evaluate(
        "({ study: document.querySelector('h1').textContent, page: document.body.textContent, \
            about: document.querySelector('#convergence .canvas')?.getAttribute('aria-label') })",
    );
    assert_eq!(shown["study"], "pid-design");
    let text = shown["page"].as_str().unwrap();
    for part in ["of 100000", "Best objective", "overshoot", "settling", "Td"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let about = shown["about"].as_str().unwrap();
    assert!(
        about.contains("worst scaled criterion over evaluations") && about.contains("best so far: from"),
        "{shown}"
    );
    // The curve grows with the run, as does its description.
    page.evaluate("document.querySelector('#convergence').scrollIntoView()");
    page.once("document.querySelector('#convergence .uplot canvas') ? 1 : null");
    let end = "Number(document.querySelector('#convergence .readout')?.textContent.match(/^evaluations 1 to ([0-9]+)/)?.[1] ?? 0) || null";
    let first = page.once(end).as_u64().unwrap();
    page.once(&format!("{end} > {first} ? 1 : null"));
    // Responses of the best point are drawn, and replaced by those of better points.
    let best = "document.querySelector('#responses .chart .uplot') ? Number(document.querySelector('#responses').dataset.shown) : null";
    assert!(page.once(best).as_u64().unwrap() > 0);
    page.once("document.querySelector('#responses .readout').textContent.startsWith('time 0 to') ? 1 : null");
    // By keyboard alone: the first focus is the table of criteria, which scrolls on a narrow screen.
    page.press("Tab");
    assert_eq!(page.evaluate("document.activeElement.getAttribute('aria-label')"), "Criteria");
    let pid = run.process.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    let verdict = page.once("(() => { const v = document.querySelector('#verdict').textContent; return v.includes('is over') ? v : null; })()");
    assert!(verdict.as_str().unwrap().contains(out.to_str().unwrap()), "{verdict}");
    assert!(run.process.wait().unwrap().code() == Some(4) && out.join("result.json").is_file());
    assert_eq!(page.problems(), Vec::<String>::new());
}
