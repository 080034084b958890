//! Page of the diagnosis benchmark: tables, and reliability plots of the stated probabilities.

use mops::report::{Color, Curve, CurveStyle, Draw, Plot};

use super::statistics::{Bin, reliability};

/// Returns the page from the tables as text, and from pairs of stated probability and outcome by subject.
pub(crate) fn page(tables: &str, stated: &[(&str, Vec<(f64, bool)>)]) -> String {
    let stated = stated.iter().filter(|(_, pairs)| !pairs.is_empty());
    let pictures: Vec<String> = stated.map(|(of, pairs)| plot(of, &reliability(pairs)).svg()).collect();
    crate::page::page("Benchmark of the diagnosis", "Stated probabilities", &pictures, tables, "cases.csv")
}

/// Plots the observed frequency, with its interval, over the stated probability; calibrated probabilities are on the
/// diagonal.
fn plot(of: &str, bins: &[Bin]) -> Plot {
    let points: Vec<(f64, f64)> = bins.iter().map(|bin| (bin.stated, bin.observed.share())).collect();
    let dots =
        Curve { name: "observed".into(), points, style: CurveStyle::Dots, color: Color::Measured, ..Curve::default() };
    let diagonal = Curve {
        name: "calibrated".into(),
        points: vec![(0.0, 0.0), (1.0, 1.0)],
        color: Color::Demand,
        ..Curve::default()
    };
    let interval = |bin: &Bin| {
        let points = bin.observed.interval95().map(|share| (bin.stated, share)).to_vec();
        Curve { name: String::new(), points, color: Color::Measured, ..Curve::default() }
    };
    Plot {
        title: format!("Reliability of {of}"),
        x_label: "stated".into(),
        y_label: "observed".into(),
        curves: [diagonal, dots].into_iter().chain(bins.iter().map(interval)).collect(),
        x_range: Some([0.0, 1.0]),
        ..Plot::default()
    }
}
