//! `mops pareto`: computes the Pareto front of a design study, whatever the task of the study.

use std::process::ExitCode;

use clap::Args;
use mops_core::Catalogue;

use super::run::{CommonOptions, Search, SolverOptions, execute};
use crate::terminal::CommandError;

/// Options of `mops pareto`.
#[derive(Args)]
#[command(after_help = "\
Each criterion with usage minimise is an objective, with the value of its worst case, which has the largest weighted scaled
value (with --per-case: an objective in every case). The result is the Pareto front: 30 evenly spread non-dominated designs,
each the solution of an optimisation problem (default solver: weighted-chebyshev).

result.json lists the points as `front`, sorted by the first criterion, and `trade_offs`: the knee, the point nearest to the
demands, the exchange rates between criteria, and whether each point is certified as Pareto-optimal. report.html plots them;
select a point with the pointer or the arrow keys.

Examples:
  mops pareto pid-design                      Pareto front of overshoot and settling time
  mops pareto pid-design --points 60          with more points
  mops pick results/pid-design --demand settling=12
                                              afterwards: the point for other demands")]
pub(super) struct Arguments {
    #[command(flatten)]
    common: CommonOptions,
    #[command(flatten)]
    solver_options: SolverOptions,
    /// Number of points [default: [pareto] of the study, or 30].
    #[arg(long, value_parser = clap::value_parser!(u16).range(3..=200))]
    points: Option<u16>,
    /// Count every criterion as an objective in every case, instead of in its worst case.
    #[arg(long)]
    per_case: bool,
}

pub(super) fn pareto(catalogue: &Catalogue, arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let Arguments { common, solver_options, points, per_case } = arguments;
    execute(catalogue, common, &Search::Pareto { solver_options, points: *points, per_case: *per_case })
}
