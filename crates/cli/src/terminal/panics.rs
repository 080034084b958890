//! Panics of models and criteria, which are failures of single points of a run.

use std::collections::HashSet;
use std::panic::{set_hook, take_hook};
use std::sync::Mutex;

/// Reports a panic on standard error once for each line of code, as a model may panic at every point of a run.
pub(crate) fn show_each_panic_once() {
    let (show, shown) = (take_hook(), Mutex::new(HashSet::new()));
    set_hook(Box::new(move |panic| {
        let line = panic.location().map(ToString::to_string);
        if shown.lock().is_ok_and(|mut shown| shown.insert(line)) {
            show(panic);
        }
    }));
}
