//! The task `tolerances`.

use mops::content::numbers::{number, with_unit};
use mops::content::table::{numbers, text};
use mops::tasks::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How far each tuner can move from its value, alone and in each direction, until a demand is missed.
///
/// Each limit is found by halving the distance to the bound of the tuner. A demand that is missed and met again farther
/// away is not noticed.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct TolerancesTask {
    /// Design: `optimum` (default: the study is solved first) or `start`.
    pub at: Place,
    /// Number of halvings; default 20, a millionth of the distance.
    pub halvings: Option<u32>,
}

/// Largest number of halvings: the digits of a number.
const MOST: u32 = 53;

impl TaskOptions for TolerancesTask {
    const NAME: &'static str = "tolerances";
    const ABOUT: &'static str = "Report how far each tuner can move until a demand is missed.";

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl TaskSpec for TolerancesTask {
    fn at(&self) -> Option<Place> {
        Some(self.at)
    }

    fn check(&self, _study: &Study, _is_performed: bool) -> Result<(), StudyError> {
        match self.halvings {
            Some(n) if !(1..=MOST).contains(&n) => {
                Err(StudyError::new("halvings", format!("expected 1 to {MOST} halvings, found {n}"))
                    .with_help("omit it for the default of 20")
                    .within(Self::TABLE))
            }
            _ => Ok(()),
        }
    }
}

/// Tolerances of the tuners of a design.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct TolerancesReport {
    /// The active tuners.
    pub tuners: Vec<Tolerance>,
}

/// Tolerance of a tuner.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Tolerance {
    /// Name.
    pub tuner: String,
    /// Unit of the values.
    pub unit: String,
    /// Value of the design.
    pub value: f64,
    /// Smallest and largest value at which all demands are met; null if one is missed at the design.
    pub range: Option<[f64; 2]>,
}

finding!(TolerancesReport, "tolerances", "How far each tuner can move until a demand is missed.");

/// `task = "tolerances"`.
pub struct Tolerances;

impl Room for Tolerances {
    fn title(&self) -> &'static str {
        "Tolerances"
    }

    fn perform(&self, study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
        let task = study.options::<TolerancesTask>().cloned().unwrap_or_default();
        let mut solved = solve_at(task.at, study, options, watch)?;
        let problem = &solved.problem;
        let study = problem.study();
        let are_met = |at: &Evaluation| {
            study
                .rows()
                .iter()
                .zip(&at.readings)
                .all(|(row, reading)| reading.is_some_and(|reading| row.is_met(reading.scaled) != Some(false)))
        };
        let is_good = are_met(&solved.best);
        let mut simulations = 0;
        let mut limit = |tuner: usize, bound: f64| {
            let [mut inside, mut outside] = [solved.best.tuners[tuner], bound];
            let mut is_met = |value: f64| {
                let mut tuners = solved.best.tuners.clone();
                tuners[tuner] = value;
                simulations += problem.simulations();
                are_met(&problem.evaluate_at(&tuners))
            };
            if is_met(bound) {
                return bound;
            }
            for _ in 0..task.halvings.unwrap_or(20) {
                let middle = 0.5 * (inside + outside);
                if is_met(middle) { inside = middle } else { outside = middle }
            }
            inside
        };
        let active = study.tuners().iter().enumerate().filter(|(_, tuner)| tuner.active);
        let tuners = active.map(|(i, tuner)| Tolerance {
            tuner: tuner.name.clone(),
            unit: tuner.unit.to_string(),
            value: solved.best.tuners[i],
            range: is_good.then(|| tuner.bounds.map(|bound| limit(i, bound))),
        });
        let report = TolerancesReport { tuners: tuners.collect() };
        solved.outcome.simulations += simulations;
        solved.outcome.found.add(report);
        Ok(solved)
    }

    fn command(&self) -> Option<TaskCommand> {
        Some(TaskCommand {
            name: "tolerances",
            about: "Compute how far each tuner of a study can move until a demand is missed",
            after_help: "",
            has_solver: true,
            options: &[],
        })
    }

    fn blocks(&self) -> Vec<BlockKind> {
        vec![BlockKind::of::<TolerancesReport>()]
    }

    fn verdict(&self, of: &Solution<'_>) -> Judgement {
        let found = of.outcome.found.get::<TolerancesReport>();
        let tuners = found.into_iter().flat_map(|found| &found.tuners);
        let ends = tuners.flat_map(|one| {
            let share = move |end: f64| (one, (end - one.value).abs() / one.value.abs());
            one.range.into_iter().flatten().map(share)
        });
        Judgement::OfPoint(match ends.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((one, share)) => Verdict::new(
                Tone::Good,
                format!(
                    "All demands hold; the tightest tolerance is that of `{}`, {} %.",
                    one.tuner,
                    number(100.0 * share)
                ),
            ),
            None => Verdict::new(Tone::Bad, "A demand is missed at the design, so that it has no tolerances."),
        })
    }

    fn findings(&self, of: &Solution<'_>) -> Vec<Section> {
        let found = of.outcome.found.get::<TolerancesReport>();
        found.map(|found| Section::new("Tolerances", [Block::Table(table(found))])).into_iter().collect()
    }

    fn lines(&self, outcome: &Outcome) -> Vec<Block> {
        outcome.found.get::<TolerancesReport>().map(|found| Block::Table(table(found))).into_iter().collect()
    }
}

fn table(found: &TolerancesReport) -> Table {
    let columns = [text("tuner"), numbers("from"), numbers("design"), numbers("to")];
    let rows = found.tuners.iter().map(|one| -> Vec<Cell> {
        let [from, to] = one.range.map_or([f64::NAN; 2], |range| range).map(|end| with_unit(end, &one.unit));
        vec![one.tuner.clone().into(), from.into(), with_unit(one.value, &one.unit).into(), to.into()]
    });
    Table::new("Tolerances", columns).rows(rows)
}
