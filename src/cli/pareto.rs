//! `mops pareto`: the front of a design study, whatever the study is for.

use std::process::ExitCode;

use clap::Args;
use mops_core::Catalogue;

use super::run::{Common, Effort, Search, go};
use crate::terminal::CommandError;

/// What can be said to the search for a front.
#[derive(Args)]
#[command(after_help = "\
Every criterion that is minimised counts for itself: the result is the set of designs that no other is better than in all
of them, about 30 points spread evenly, each solved for (solver weighted-chebyshev, by default, for up to three criteria).

result.json has the points as `front`, in the order of their first criterion, and beside them `trade_offs`: the knee, the
point nearest to the demands, what a unit of one criterion costs of another, and whether each point is Pareto-optimal.
report.html shows them; hover over a point, or move from point to point with the arrow keys.

Examples:
  mops pareto pid-design                      the front of overshoot and settling time
  mops pareto pid-design --points 60          more points
  mops pick results/pid-design --demand settling=12
                                              then: the point for other demands")]
pub(super) struct Arguments {
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    effort: Effort,
    /// Number of points, about; [pareto] of the study, or 30, where absent.
    #[arg(long, value_parser = clap::value_parser!(u16).range(3..=200))]
    points: Option<u16>,
}

pub(super) fn pareto(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let Arguments { common, effort, points } = arguments;
    go(catalogue, common, &Search::Pareto { effort, points: *points })
}
