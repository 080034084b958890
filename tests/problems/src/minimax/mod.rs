//! Min-max problems: `min over x of max over i of f_i(x)` or of `|f_i(x)|`, without and with linear constraints.

mod curves;
mod dembo;
mod linear;
mod penalties;
mod small;

use crate::Suite;
use crate::problem::Problem;

pub(crate) const SUITE: Suite = Suite {
    name: "minimax",
    about: "25 min-max problems, and 15 with linear constraints",
    source: "L. Luksan, J. Vlcek, Test problems for nonsmooth unconstrained and linearly constrained optimization, \
             report V-798, ICS AS CR, Prague (2000)",
    accuracy: 1e-7,
    budget: |n| 1000 * (n + 1),
    problems,
};

/// Returns the problems in the order of the report. Optima were recomputed with higher accuracy; those of GAMMA and
/// Watson in the report are not optimal.
fn problems() -> Vec<Problem> {
    let mut all: Vec<Problem> =
        small::problems().into_iter().chain(curves::problems()).chain(penalties::problems()).collect();
    const ORDER: [&str; 25] = [
        "CB2",
        "WF",
        "SPIRAL",
        "EVD52",
        "Rosen-Suzuki",
        "Polak6",
        "PBC3",
        "Bard",
        "Kowalik-Osborne",
        "Davidon2",
        "OET5",
        "OET6",
        "GAMMA",
        "EXP",
        "PBC1",
        "EVD61",
        "Transformer",
        "Filter",
        "Wong1",
        "Wong2",
        "Wong3",
        "Polak2",
        "Polak3",
        "Watson",
        "Osborne2",
    ];
    all.sort_by_key(|problem| ORDER.iter().position(|name| *name == problem.name));
    all.extend(linear::problems());
    all
}
