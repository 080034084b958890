//! Many pieces of work in parallel, while somebody looks on.

use mops_core::Watch;
use rayon::prelude::*;

/// A part of what a task does: its name, and the shares of the whole at which it begins and ends.
#[derive(Clone, Copy)]
pub(super) struct Stage<'a> {
    pub what: &'a str,
    pub from: f64,
    pub to: f64,
}

/// Does the work for every item; answers in the order of the items, fewer of them where the user ends it. The number of
/// threads changes no bit.
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
        // Some of them may have been cut off.
        if watch.wants_stop() {
            break;
        }
        done.extend(results);
    }
    done
}
