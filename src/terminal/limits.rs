//! What ends a run before its solver does: Ctrl-C and its like, and a limit of time.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use mops_core::{Cancellation, Halt, Quantity, Unit};

use super::write::say;

/// How long something may take.
#[derive(Args, Clone, Copy)]
pub(crate) struct Limit {
    /// End after this time with what is known by then, as after a spent budget: a number of seconds, or "10 min".
    ///
    /// A simulation that is cut off does not count. `mops run --resume` continues the run.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub time_limit: Option<Duration>,
}

/// The share of its time so far that a run may take to conclude, once it was asked to end, and bounds for that.
const CONCLUDES: u32 = 20;
const LEAST: Duration = Duration::from_secs(1);
const MOST: Duration = Duration::from_secs(10);

/// Begins to listen for signals (INT, TERM, HUP) and to wait for the limit, either of which asks a run to end; `heard` is said
/// at the first signal. The second one ends the program.
pub(crate) fn listen(limit: Limit, heard: &'static str) -> Cancellation {
    let (begun, cancellation) = (Instant::now(), Cancellation::default());
    let (of_signals, first) = (cancellation.clone(), AtomicBool::new(true));
    // Where a handler cannot be set, a signal ends the program as usual.
    let _ = ctrlc::set_handler(move || {
        if !first.swap(false, Ordering::Relaxed) {
            std::process::exit(130);
        }
        of_signals.request(Halt::Interrupted);
        say(heard);
        let insists = of_signals.clone();
        let _ = thread::Builder::new().spawn(move || insist(&insists, begun.elapsed()));
    });
    wait(limit, &cancellation);
    cancellation
}

/// Waits for the limit alone: a signal ends the program as usual.
pub(crate) fn within(limit: Limit) -> Cancellation {
    let cancellation = Cancellation::default();
    wait(limit, &cancellation);
    cancellation
}

/// Ends the program after the limit with an error: for what has nothing to tell before it is done, and writes whole files.
pub(crate) fn or_end(limit: Limit) {
    let Some(limit) = limit.time_limit else { return };
    let _ = thread::Builder::new().spawn(move || {
        thread::sleep(limit);
        say(&format!("error: the time limit of {} s came before it was done", limit.as_secs_f64()));
        std::process::exit(3);
    });
}

fn wait(limit: Limit, cancellation: &Cancellation) {
    let Some(limit) = limit.time_limit else { return };
    let of_clock = cancellation.clone();
    let _ = thread::Builder::new().spawn(move || {
        thread::sleep(limit);
        of_clock.request(Halt::Budget);
        insist(&of_clock, limit);
    });
}

/// Lets a run of this age conclude, and then ends that too.
fn insist(cancellation: &Cancellation, age: Duration) {
    thread::sleep((age / CONCLUDES).clamp(LEAST, MOST));
    cancellation.insist();
}

fn duration(text: &str) -> Result<Duration, String> {
    let seconds = Quantity::parse(text)?.to(&Unit::known("s"))?;
    Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|limit| !limit.is_zero())
        .ok_or_else(|| format!("`{text}` is no time a run can take"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_a_time_in_any_unit() {
        for (text, seconds) in
            [("90", 90.0), ("90 s", 90.0), ("2 min", 120.0), ("1.5 h", 5400.0), ("250 ms", 0.25), ("1e-3", 1e-3)]
        {
            assert_eq!(duration(text), Ok(Duration::from_secs_f64(seconds)), "{text}");
        }
        for wrong in ["0", "-1 s", "soon", "3 m", "nan", "inf", "1e300", ""] {
            assert!(duration(wrong).is_err(), "{wrong}");
        }
    }
}
