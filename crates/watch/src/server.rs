//! Server of the live page: one thread per connection, a time limit for requests and answers, and a limit on
//! connections.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddrV4, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::request::{Answer, LONGEST, answer};
use super::state::Live;

/// Largest number of simultaneous viewers: connections that have requested the URL.
const CONNECTIONS: usize = 32;

/// Largest number of connections without a request. The oldest of more is closed, so that idle connections block
/// nobody: a browser sends its request at once.
const PENDING: usize = 32;

/// Time limit for a request, and for the viewer to receive a part of the answer.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Shortest time between two states, as drawing in the browser takes time from the run.
const PACE: Duration = Duration::from_millis(500);

/// Longest time between two messages of a stream; a failed write shows that the viewer has left.
const HEARTBEAT: Duration = Duration::from_secs(2);

/// Longest time for viewers to receive the last state and responses.
const FAREWELL: Duration = Duration::from_secs(1);

const PAGE: &str = include_str!("page.html");
const SCRIPT: &str = include_str!("page.js");
const OWN_STYLE: &str = include_str!("page.css");

/// Server of the live page.
pub(super) struct Server {
    port: u16,
    token: String,
    shared: Arc<Shared>,
}

struct Shared {
    live: Arc<Live>,
    /// Connections without a request, in the order of arrival.
    pending: Mutex<VecDeque<(u64, TcpStream)>>,
    connections: AtomicUsize,
    /// Number of streams of states that have not ended.
    streams: AtomicUsize,
    closed: AtomicBool,
}

impl Server {
    /// Starts to listen.
    pub fn open(live: Arc<Live>) -> io::Result<Self> {
        let listener = TcpListener::bind(SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0))?;
        let port = listener.local_addr()?.port();
        let mut random = [0; 16];
        getrandom::fill(&mut random).map_err(io::Error::other)?;
        let token: String = random.iter().map(|byte| format!("{byte:02x}")).collect();
        let shared = Arc::new(Shared {
            live,
            pending: Mutex::default(),
            connections: AtomicUsize::new(0),
            streams: AtomicUsize::new(0),
            closed: AtomicBool::new(false),
        });
        let (of_thread, token_of_thread) = (Arc::clone(&shared), token.clone());
        thread::Builder::new()
            .name("watch".into())
            .spawn(move || listen(&listener, port, &token_of_thread, &of_thread))?;
        Ok(Self { port, token, shared })
    }

    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// Stops the server. Streams receive the last state and responses within [`FAREWELL`]; other connections are not
    /// awaited.
    pub fn close(self) {
        let until = Instant::now() + FAREWELL;
        while self.shared.streams.load(Ordering::Relaxed) > 0 && Instant::now() < until {
            thread::sleep(Duration::from_millis(2));
        }
        self.shared.closed.store(true, Ordering::Relaxed);
        // Wakes the listening thread.
        let _ = TcpStream::connect(SocketAddrV4::new(Ipv4Addr::LOCALHOST, self.port));
    }
}

fn listen(listener: &TcpListener, port: u16, token: &str, shared: &Arc<Shared>) {
    for (number, stream) in (0..).zip(listener.incoming()) {
        if shared.closed.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else {
            // For example too many open files, which may be temporary.
            thread::sleep(Duration::from_millis(100));
            continue;
        };
        let Ok(waiting) = stream.try_clone() else { continue };
        shared.add_pending((number, waiting));
        let (token, shared) = (token.to_owned(), Arc::clone(shared));
        // N.B.: without a thread the connection is dropped, and the viewer reconnects.
        let _ = thread::Builder::new().name("viewer".into()).spawn(move || {
            let _ = serve(stream, (port, &token), number, &shared);
        });
    }
}

impl Shared {
    /// Adds a connection without a request.
    fn add_pending(&self, connection: (u64, TcpStream)) {
        let mut pending = self.pending.lock().unwrap_or_else(PoisonError::into_inner);
        pending.push_back(connection);
        if pending.len() > PENDING
            && let Some((_, oldest)) = pending.pop_front()
        {
            let _ = oldest.shutdown(Shutdown::Both);
        }
    }

    /// Removes a connection that has sent its request or was closed.
    fn remove_pending(&self, number: u64) {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner).retain(|(of, _)| *of != number);
    }
}

/// Slot for one viewer.
struct Slot(Arc<Shared>);

impl Slot {
    fn take(shared: &Arc<Shared>) -> Option<Self> {
        if shared.connections.fetch_add(1, Ordering::Relaxed) >= CONNECTIONS {
            shared.connections.fetch_sub(1, Ordering::Relaxed);
            return None;
        }
        Some(Self(Arc::clone(shared)))
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        self.0.connections.fetch_sub(1, Ordering::Relaxed);
    }
}

fn serve(mut stream: TcpStream, (port, token): (u16, &str), number: u64, shared: &Arc<Shared>) -> io::Result<()> {
    stream.set_write_timeout(Some(TIMEOUT))?;
    stream.set_nodelay(true)?;
    let request = read(&mut stream, port, token);
    shared.remove_pending(number);
    let request = request?;
    // A viewer with the right URL takes a slot; without a free slot the connection is dropped, and the viewer
    // reconnects.
    let authorised = !matches!(request, Answer::Refused(..) | Answer::More);
    let _slot = match authorised.then(|| Slot::take(shared)) {
        Some(None) => return Ok(()),
        slot => slot.flatten(),
    };
    let style = || [mops_report::STYLE, mops_report::CHART_STYLE, OWN_STYLE].concat();
    match request {
        Answer::Page => whole(&mut stream, "200 OK", "text/html; charset=utf-8", &page(shared)),
        Answer::Style => whole(&mut stream, "200 OK", "text/css; charset=utf-8", &style()),
        Answer::Script => whole(&mut stream, "200 OK", "text/javascript; charset=utf-8", SCRIPT),
        Answer::Charts => {
            whole(&mut stream, "200 OK", "text/javascript; charset=utf-8", &mops_report::CHART_SCRIPTS.join("\n"))
        }
        Answer::Events => events(&mut stream, shared),
        Answer::Refused(status, reason) => {
            whole(&mut stream, &format!("{status} {reason}"), "text/plain; charset=utf-8", reason)
        }
        Answer::More => Ok(()),
    }
}

/// Returns the page with the current state embedded.
fn page(shared: &Shared) -> String {
    let (_, _, state) = shared.live.after(0, Duration::ZERO);
    // `<` could close the script element that contains the state.
    PAGE.replace("{{state}}", &state.replace('<', "\\u003c"))
}

/// Reads the head of a request within [`TIMEOUT`] in total.
fn read(stream: &mut TcpStream, port: u16, token: &str) -> io::Result<Answer> {
    let until = Instant::now() + TIMEOUT;
    let mut head = Vec::new();
    let mut part = [0; 1024];
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(Answer::Refused(408, "Request Timeout"));
        }
        stream.set_read_timeout(Some(left))?;
        let count = match stream.read(&mut part) {
            Ok(0) => return Ok(Answer::More),
            Ok(count) => count,
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => continue,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        head.extend(&part[..count.min(LONGEST - head.len().min(LONGEST))]);
        match answer(&head, port, token) {
            Answer::More => {}
            other => return Ok(other),
        }
    }
}

/// Headers of every answer: no caching, and no content from other origins.
const HEADERS: &str = "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
    Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; \
    img-src data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\nConnection: close\r\n";

fn whole(stream: &mut TcpStream, status: &str, kind: &str, body: &str) -> io::Result<()> {
    let length = body.len();
    let head = format!("HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{HEADERS}\r\n");
    stream.write_all([head.as_bytes(), body.as_bytes()].concat().as_slice())
}

/// Writes server-sent events: states, and the responses of each new best point. Source: HTML Living Standard, section
/// 9.2.
fn events(stream: &mut TcpStream, shared: &Shared) -> io::Result<()> {
    let _open = Open::start(&shared.streams);
    let head = format!("HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n{HEADERS}\r\n");
    stream.write_all(head.as_bytes())?;
    let (mut seen, mut drawn, mut pace) = (0, 0, Duration::ZERO);
    loop {
        shared.live.pause(pace);
        let (version, over, state) = shared.live.after(seen, HEARTBEAT);
        stream.write_all(format!("data: {state}\n\n").as_bytes())?;
        if let Some((of, responses)) = shared.live.responses(drawn) {
            stream.write_all(format!("event: responses\ndata: {responses}\n\n").as_bytes())?;
            drawn = of;
        }
        if over || shared.closed.load(Ordering::Relaxed) {
            return Ok(());
        }
        (seen, pace) = (version, PACE);
    }
}

/// Guard that counts an open stream.
struct Open<'a>(&'a AtomicUsize);

impl<'a> Open<'a> {
    fn start(count: &'a AtomicUsize) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(count)
    }
}

impl Drop for Open<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
