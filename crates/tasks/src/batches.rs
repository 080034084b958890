//! Parallel processing of many items, with progress reports.

use mops_core::Watch;
use rayon::prelude::*;

/// Stage of a task: its name, and the shares of the whole task at its start and end.
#[derive(Clone, Copy)]
pub(super) struct Stage<'a> {
    pub what: &'a str,
    pub from: f64,
    pub to: f64,
}

/// Applies `work` to every item. Returns the results in the order of the items; after a stop request, only the first
/// ones. The results do not depend on the number of threads, bit for bit.
#[allow(clippy::cast_precision_loss)]
pub(super) fn each<T: Sync, R: Send>(
    items: &[T],
    stage: Stage<'_>,
    watch: &dyn Watch,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let mut done = Vec::with_capacity(items.len());
    for batch in items.chunks(4 * rayon::current_num_threads().max(1)) {
        if watch.wants_stop() {
            break;
        }
        let share = done.len() as f64 / items.len() as f64;
        watch.stage(
            &format!("{}, {} of {}", stage.what, done.len(), items.len()),
            stage.from + share * (stage.to - stage.from),
        );
        let results: Vec<R> = batch.par_iter().map(&work).collect();
        // Some results of an interrupted batch may be incomplete.
        if watch.wants_stop() {
            break;
        }
        done.extend(results);
    }
    done
}
