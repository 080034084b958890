//! Display of an error in a file or on the command line, with its source line.

use std::borrow::Cow;
use std::io::{IsTerminal, Write};
use std::ops::Range;

use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, NamedSource, Report};
use mops_language::Diagnostic;

use mops_language::plain::plain;

/// Number of characters of a line shown on either side of an error.
const AROUND: usize = 200;

/// Returns a text for display and the position in it: control characters are escaped, long lines are cut around the
/// position, line numbers are preserved.
fn shown(text: &str, place: Range<usize>) -> (String, Range<usize>) {
    let (mut shown, mut start, mut end) = (String::new(), None, None);
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let after = offset + line.len();
        let body = line.trim_end_matches('\n').trim_end_matches('\r');
        let is_last = after == text.len() && body.len() == line.len();
        // Other lines are shown from their start.
        let is_here = (offset..after).contains(&place.start) || is_last && place.start == after;
        let here = if is_here { (place.start - offset).min(body.len()) } else { 0 };
        let from = body[..here].char_indices().rev().nth(AROUND - 1).map_or(0, |(i, _)| i);
        let to = body[here..].char_indices().nth(AROUND).map_or(body.len(), |(i, _)| here + i);
        shown.push_str(if from > 0 { "... " } else { "" });
        for (i, c) in body[from..to].char_indices() {
            let i = offset + from + i;
            start = start.or((i >= place.start).then_some(shown.len()));
            end = end.or((i >= place.end).then_some(shown.len()));
            shown.push_str(&plain(c.encode_utf8(&mut [0; 4])));
        }
        start = start.or(is_here.then_some(shown.len()));
        end = end.or((after > place.end || is_last).then_some(shown.len()));
        shown.push_str(if to < body.len() { " ..." } else { "" });
        shown.push_str(if is_last { "" } else { "\n" });
        offset = after;
    }
    let start = start.unwrap_or(shown.len());
    (shown, start..end.unwrap_or(start).max(start))
}

/// Prints an error to standard error: file, line and column, message, source line, help.
pub(super) fn show(diagnostic: &Diagnostic) {
    let mut shown = MietteDiagnostic::new(plain(&diagnostic.message));
    shown.help = diagnostic.help.as_deref().map(plain).map(Cow::into_owned);
    let report = match &diagnostic.place {
        Some((source, span)) if !source.text.is_empty() && *span != (0..0) => {
            let label =
                diagnostic.label.as_deref().map_or_else(|| "here".to_owned(), |label| plain(label).into_owned());
            let (start, end) = (span.start.min(source.text.len()), span.end.min(source.text.len()));
            let (start, end) = (source.text.floor_char_boundary(start), source.text.floor_char_boundary(end));
            // An error over several lines is marked on the first one.
            let end = source.text[start..end].find('\n').map_or(end, |first| start + first);
            let (text, span) = self::shown(&source.text, start..end);
            shown.labels = Some(vec![LabeledSpan::at(span, label)]);
            // N.B.: the line and the column are ours, since miette counts columns in bytes.
            let (line, column) = diagnostic.line_column().expect("it has a place");
            let place = format!("{}:{line}:{column}", plain(&source.name));
            Report::new(shown).with_source_code(NamedSource::new(place, text))
        }
        Some((source, _)) => {
            shown.message = format!("{}: {}", plain(&source.name), shown.message);
            Report::new(shown)
        }
        None => Report::new(shown),
    };
    let stderr = std::io::stderr();
    let theme = if stderr.is_terminal() { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let mut text = String::new();
    let handler = GraphicalReportHandler::new_themed(theme).without_primary_span_start().with_wrap_lines(false);
    if handler.render_report(&mut text, report.as_ref()).is_err() {
        text = plain(&diagnostic.to_string()).into_owned();
    }
    let _ = writeln!(stderr.lock(), "{text}");
}
