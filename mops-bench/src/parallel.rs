//! Parallel execution of tasks, with results in the order of the tasks.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use mops::Watch;

/// Runs every task on one of `jobs` threads, until `watch` requests a stop. Returns the results so far, in the order of
/// the tasks. A task that panics has no result.
pub(crate) fn each<T: Sync, R: Send>(
    tasks: &[T],
    jobs: usize,
    watch: &dyn Watch,
    work: impl Fn(&T) -> Option<R> + Sync,
) -> Vec<R> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let worker = || {
        while !watch.wants_stop() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(task) = tasks.get(index) else { break };
            let result = catch_unwind(AssertUnwindSafe(|| work(task))).unwrap_or(None);
            // The result of an interrupted task may be incomplete.
            if watch.wants_stop() {
                break;
            }
            let mut done = done.lock().expect("no thread panics while it locks the list");
            done.push((index, result));
            #[allow(clippy::cast_precision_loss)]
            watch.stage(&format!("{} of {} cases", done.len(), tasks.len()), done.len() as f64 / tasks.len() as f64);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, tasks.len().max(1)) {
            scope.spawn(worker);
        }
    });
    let mut done = done.into_inner().expect("all threads have ended");
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().filter_map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;

    struct Until(AtomicUsize, AtomicBool);

    impl Watch for Until {
        fn wants_stop(&self) -> bool {
            self.1.load(Ordering::Relaxed)
        }

        fn stage(&self, _: &str, _: f64) {
            if self.0.fetch_sub(1, Ordering::Relaxed) == 1 {
                self.1.store(true, Ordering::Relaxed);
            }
        }
    }

    #[test]
    fn results_are_in_the_order_of_the_tasks_without_those_that_panic() {
        let tasks: Vec<usize> = (0..40).collect();
        let squares = each(&tasks, 4, &(), |&i| {
            assert!(i != 7, "broken");
            (i != 9).then_some(i * i)
        });
        let expected: Vec<usize> = tasks.iter().filter(|&&i| i != 7 && i != 9).map(|i| i * i).collect();
        assert_eq!(squares, expected);
    }

    #[test]
    fn results_before_an_interruption_are_kept() {
        let tasks: Vec<usize> = (0..40).collect();
        let done = each(&tasks, 1, &Until(AtomicUsize::new(5), AtomicBool::new(false)), |&i| Some(i));
        assert_eq!(done, [0, 1, 2, 3, 4]);
    }
}
