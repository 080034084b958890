//! Content of reports and of the terminal: sections of sentences, tables and plots, without a renderer.
//!
//! | module | content |
//! |---|---|
//! | [`section`] | headings, sentences, tables and plots in their order; verdicts |
//! | [`table`] | columns of text and numbers |
//! | [`text`] | pieces of a text with their emphasis and tone |
//! | [`plot`] | [`plot::Plot`]: curves, levels, bounds, bands and surfaces |
//! | [`figures`] | plots with captions, in groups |
//! | [`marks`] | marks of criteria on a signal |
//! | [`sampling`] | traces as points of a plot |
//! | [`contour`] | contour lines of a surface |
//! | [`numbers`] | numbers, units and file names for a reader |

pub mod contour;
pub mod figures;
pub mod marks;
pub mod numbers;
pub mod plot;
pub mod sampling;
pub mod section;
pub mod table;
pub mod text;

use std::io::Write;

use mops_data::as_text;
use mops_language::plain::plain;

/// Writes the header of a CSV file: names without control characters, and without formulas of spreadsheets.
///
/// # Errors
/// If it cannot be written.
pub fn write_header<W: Write>(
    writer: &mut csv::Writer<W>,
    names: impl IntoIterator<Item = String>,
) -> Result<(), csv::Error> {
    writer.write_record(names.into_iter().map(|name| plain(&as_text(&name)).into_owned()))
}
