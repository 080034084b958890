//! Page of a benchmark: plots, then the tables of the terminal.

use maud::{PreEscaped, html};

/// Returns the page as HTML; `pictures` are SVG.
pub(super) fn page(title: &str, heading: &str, pictures: &[String], tables: &str, footer: &str) -> String {
    let body = html! {
        header { p class="task" { "benchmark" } h1 { (title) } }
        main {
            @if !pictures.is_empty() {
                section {
                    h2 { (heading) }
                    @for picture in pictures { figure { (PreEscaped(picture)) } }
                }
            }
            section { h2 { "Runs" } div class="wide" tabindex="0" { pre { (tables) } } }
        }
        footer { "Written by mops-bench " (env!("CARGO_PKG_VERSION")) ". The numbers are in " (footer) "." }
    };
    mops::report::page(title, &body.into_string())
}
