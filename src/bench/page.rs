//! The frame of a benchmark's page: pictures, then what the terminal says.

use maud::{DOCTYPE, PreEscaped, html};

/// The page; pictures as SVG.
pub(super) fn page(title: &str, heading: &str, pictures: &[String], tables: &str, footer: &str) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(crate::report::STYLE)) }
            }
            body {
                header { p class="task" { "benchmark" } h1 { (title) } }
                main {
                    section {
                        h2 { (heading) }
                        @for picture in pictures { figure { (PreEscaped(picture)) } }
                    }
                    section { h2 { "Runs" } div class="wide" tabindex="0" { pre { (tables) } } }
                }
                footer { "Written by mops " (env!("CARGO_PKG_VERSION")) ". The numbers are in " (footer) "." }
            }
        }
    };
    page.into_string()
}
