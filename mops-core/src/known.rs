//! What is known of points before demands, usages and weights: what a run that was killed, or a study that asks for
//! something else, need not simulate again.

use crate::cancellation::Cancellation;
use crate::criterion::Value;
use crate::evaluation::Evaluation;
use crate::failure::Failure;

/// The value of a row, by index, or why it has none.
pub type RowValue = (usize, Result<Value, String>);

/// What one job gave: the values of the rows that read it, or why there are none.
pub type JobValues = Result<Vec<RowValue>, Failure>;

/// What is known of a point, by jobs. Rows and residuals may be absent: a problem that needs them simulates again.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Known {
    /// Index of the job, and what it gave.
    pub jobs: Vec<(usize, JobValues)>,
}

impl Known {
    /// Adds what is not known of what was known before.
    pub fn complete(&mut self, before: &Self) {
        for (job, then) in &before.jobs {
            match (self.jobs.iter_mut().find(|(index, _)| index == job), then) {
                (None, _) => self.jobs.push((*job, then.clone())),
                (Some((_, Ok(now))), Ok(then)) => {
                    let missing = then.iter().filter(|(row, _)| !now.iter().any(|(known, _)| known == row));
                    let missing: Vec<RowValue> = missing.cloned().collect();
                    now.extend(missing);
                }
                _ => {}
            }
        }
    }

    /// What a job gave, if it is known.
    pub fn job(&self, job: usize) -> Option<&JobValues> {
        self.jobs.iter().find(|(index, _)| *index == job).map(|(_, values)| values)
    }
}

/// The derivatives of rows, by index, along every coordinate of the unit box, in the units of the criteria.
pub type RowSlopes = Vec<(usize, Vec<Value>)>;

/// An evaluation, and what of it can be kept.
pub struct Kept {
    /// The evaluation.
    pub evaluation: Evaluation,
    /// What holds under every demand, usage and weight; `None` where nothing new was learned.
    pub learned: Option<Known>,
}

/// Slopes, and what of them can be kept.
pub struct KeptSlopes<S> {
    /// The slopes; `None` where there are no exact ones.
    pub slopes: Option<S>,
    /// What was learned; `None` where it was known, or the problem keeps nothing.
    pub learned: Option<Option<RowSlopes>>,
}

/// Where a run keeps what it learns, and finds what is known already. Points go by the values of all tuners, bit by bit.
///
/// A search asks it from many threads and tells it from one, in the order of its points; samples and searches for worst cases
/// tell it from many. Answers must be what the problem
/// would give itself: then they change no bit of the run, whatever is known.
pub trait Store: Send + Sync {
    /// What is known of a point.
    fn known(&self, tuners: &[f64]) -> Option<Known>;

    /// Whether anything is known of a point.
    fn is_known(&self, tuners: &[f64]) -> bool {
        self.known(tuners).is_some()
    }

    /// Of a store that only looks back: who is asked to end at a point that is not known. `None`: such a point is simulated.
    fn closed(&self) -> Option<&Cancellation> {
        None
    }

    /// A point of the run was answered; `learned` is what was simulated for it, `None` where nothing was.
    fn answered(&self, tuners: &[f64], learned: Option<Known>);

    /// The derivatives at a point that describe it within `reach`; `Some(None)` where it is known that there are none.
    fn known_slopes(&self, tuners: &[f64], reach: f64) -> Option<Option<RowSlopes>>;

    /// Derivatives were taken.
    fn learned_slopes(&self, tuners: &[f64], reach: f64, slopes: Option<RowSlopes>);
}
