//! Requests of a browser: files and a stream of states, by GET, with the host name of this machine.

/// Answer to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Answer {
    /// The page.
    Page,
    /// The style sheet.
    Style,
    /// The script.
    Script,
    /// The scripts of interactive plots.
    Charts,
    /// The stream of states and responses.
    Events,
    /// Refusal, with status and reason.
    Refused(u16, &'static str),
    /// No answer yet, as the head is incomplete.
    More,
}

/// Largest size of the head of a request, in bytes.
pub(super) const LONGEST: usize = 8192;

/// Returns the answer to the head of a request, for the port and the token of the page.
pub(super) fn answer(head: &[u8], port: u16, token: &str) -> Answer {
    let mut headers = [httparse::EMPTY_HEADER; 64];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(head) {
        Ok(httparse::Status::Partial) if head.len() >= LONGEST => {
            return Answer::Refused(431, "Request Header Fields Too Large");
        }
        Ok(httparse::Status::Partial) => return Answer::More,
        Err(_) => return Answer::Refused(400, "Bad Request"),
        Ok(httparse::Status::Complete(_)) => {}
    }
    let mut hosts = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case("host"));
    // A foreign page that was redirected here (DNS rebinding) sends its own host name.
    let ours = ["127.0.0.1", "localhost"].map(|host| format!("{host}:{port}"));
    let is_ours = |host: &httparse::Header<'_>| ours.iter().any(|our| host.value.eq_ignore_ascii_case(our.as_bytes()));
    if !(hosts.next().is_some_and(is_ours) && hosts.next().is_none()) {
        return Answer::Refused(403, "Forbidden");
    }
    if request.method != Some("GET") {
        return Answer::Refused(405, "Method Not Allowed");
    }
    let path = request.path.unwrap_or_default();
    let below = path.strip_prefix('/').and_then(|path| path.split_once('/')).filter(|(first, _)| same(first, token));
    match below.map(|(_, rest)| rest) {
        Some("") => Answer::Page,
        Some("style.css") => Answer::Style,
        Some("page.js") => Answer::Script,
        Some("charts.js") => Answer::Charts,
        Some("events") => Answer::Events,
        _ => Answer::Refused(404, "Not Found"),
    }
}

/// Compares two texts in constant time, so that the time does not reveal a common prefix.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(head: &str) -> Answer {
        answer(head.as_bytes(), 4711, "secret")
    }

    #[test]
    fn only_the_token_at_this_machine_by_get_is_answered() {
        let get = |path: &str, host: &str| asked(&format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n"));
        assert_eq!(get("/secret/", "127.0.0.1:4711"), Answer::Page);
        assert_eq!(get("/secret/events", "localhost:4711"), Answer::Events);
        for path in ["/", "/secret", "/secret/x", "/secreT/", "/secret/../secret/", "//secret/", "/wrong_/"] {
            assert_eq!(get(path, "127.0.0.1:4711"), Answer::Refused(404, "Not Found"), "{path}");
        }
        for host in ["example.org", "example.org:4711", "127.0.0.1", "127.0.0.1:80", "localhost.example.org:4711", ""] {
            assert_eq!(get("/secret/", host), Answer::Refused(403, "Forbidden"), "{host}");
        }
        let two = "GET /secret/ HTTP/1.1\r\nHost: localhost:4711\r\nHost: example.org\r\n\r\n";
        assert_eq!(asked(two), Answer::Refused(403, "Forbidden"));
        for method in ["POST", "PUT", "DELETE", "HEAD", "OPTIONS"] {
            let refused = asked(&format!("{method} /secret/ HTTP/1.1\r\nHost: localhost:4711\r\n\r\n"));
            assert_eq!(refused, Answer::Refused(405, "Method Not Allowed"), "{method}");
        }
    }

    #[test]
    fn an_invalid_request_is_refused_and_an_incomplete_one_is_awaited() {
        assert_eq!(asked("GET /secret/ HTTP/1.1\r\nHo"), Answer::More);
        assert_eq!(asked("\u{1}\u{2}\u{3}\r\n\r\n"), Answer::Refused(400, "Bad Request"));
        let long = format!("GET /secret/ HTTP/1.1\r\nX: {}", "x".repeat(LONGEST));
        assert!(matches!(asked(&long), Answer::Refused(431, _)));
    }
}
