//! Cache of criterion values and derivatives, independent of demands, usages and weights. A resumed run, or a study
//! with other demands, need not simulate cached points again.

use crate::cancellation::Cancellation;
use crate::criterion::Value;
use crate::evaluation::Evaluation;
use crate::failure::Failure;

/// Value of a row, by index, or the reason why there is none.
pub type RowValue = (usize, Result<Value, String>);

/// Result of one job: the values of the rows that read it, or the failure.
pub type JobValues = Result<Vec<RowValue>, Failure>;

/// Cache entry of a point, by jobs. Rows and residuals may be absent: a problem that needs them simulates again.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Known {
    /// Index of the job, and its result.
    pub jobs: Vec<(usize, JobValues)>,
}

impl Known {
    /// Adds entries of `before` that this entry lacks.
    pub fn complete(&mut self, before: &Self) {
        for (job, then) in &before.jobs {
            match (place(&self.jobs, *job).map(|k| &mut self.jobs[k].1), then) {
                (None, _) => self.jobs.push((*job, then.clone())),
                (Some(Ok(now)), Ok(then)) => {
                    let missing = then.iter().filter(|(row, _)| !now.iter().any(|(known, _)| known == row));
                    let missing: Vec<RowValue> = missing.cloned().collect();
                    now.extend(missing);
                }
                _ => {}
            }
        }
    }

    /// Returns the cached result of a job.
    pub fn job(&self, job: usize) -> Option<&JobValues> {
        entry(&self.jobs, job)
    }
}

/// Returns the entry with an index. Entries are mostly complete and in order, so that the index itself is tried first.
pub fn entry<T>(entries: &[(usize, T)], index: usize) -> Option<&T> {
    place(entries, index).map(|k| &entries[k].1)
}

fn place<T>(entries: &[(usize, T)], index: usize) -> Option<usize> {
    let is_here = |(found, _): &(usize, T)| *found == index;
    if entries.get(index).is_some_and(is_here) { Some(index) } else { entries.iter().position(is_here) }
}

/// Derivatives of rows, by index, along every coordinate of the unit box, in the units of the criteria.
pub type RowSlopes = Vec<(usize, Vec<Value>)>;

/// An evaluation, and the new cache entry.
pub struct CachedPoint {
    /// The evaluation.
    pub evaluation: Evaluation,
    /// New results, valid under every demand, usage and weight; `None` if there are none.
    pub learned: Option<Known>,
}

/// Derivatives, and the new cache entry.
pub struct CachedGradients<S> {
    /// Derivatives; `None` if there are no exact ones.
    pub slopes: Option<S>,
    /// New results; `None` if the derivatives were cached, or if the problem has no cache.
    pub learned: Option<Option<RowSlopes>>,
}

/// Cache of a run: stores and returns results of points. Points are identified by the bits of all tuner values.
///
/// A search reads from many threads and writes from one, in the order of its points. Sampling and worst-case searches
/// write from many threads. Results must equal those that the problem itself would compute; the cache then changes no
/// bit of a run.
pub trait Store: Send + Sync {
    /// Returns the cache entry of a point.
    fn known(&self, tuners: &[f64]) -> Option<Known>;

    /// Returns true if there is a cache entry of a point.
    fn is_known(&self, tuners: &[f64]) -> bool {
        self.known(tuners).is_some()
    }

    /// Returns the cancellation to request at a point without cache entry, for a read-only store. `None`: such points
    /// are simulated.
    fn closed(&self) -> Option<&Cancellation> {
        None
    }

    /// Stores the answer of a point; `learned` contains the newly simulated results, `None` if there are none.
    fn answered(&self, tuners: &[f64], learned: Option<Known>);

    /// Returns the cached derivatives at a point that describe it within `reach`; `Some(None)` if there are no exact
    /// ones.
    fn known_slopes(&self, tuners: &[f64], reach: f64) -> Option<Option<RowSlopes>>;

    /// Stores derivatives.
    fn learned_slopes(&self, tuners: &[f64], reach: f64, slopes: Option<RowSlopes>);
}
