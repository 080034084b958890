//! Early stop of a run: signals such as Ctrl-C, and the time limit.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use mops_core::{Cancellation, Halt};
use mops_language::{Quantity, Unit};

use super::eprint::eprint_line;

/// Time limit of a command.
#[derive(Args, Clone, Copy)]
pub(crate) struct Limit {
    /// Stop after this time, in seconds or with a unit ("10 min"), and keep the results so far.
    ///
    /// An unfinished simulation is discarded. `mops run --resume` continues the run.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub time_limit: Option<Duration>,
}

/// Time that a run may take to conclude after a stop request: the run time so far divided by this number, within
/// bounds.
const CONCLUDING_SHARE: u32 = 20;
const MIN_CONCLUDING: Duration = Duration::from_secs(1);
const MAX_CONCLUDING: Duration = Duration::from_secs(10);

/// Returns a cancellation that is requested by a signal (INT, TERM, HUP) or by the time limit. The first signal prints
/// `notice`, the second one ends the program.
pub(crate) fn cancel_on_signal(limit: Limit, notice: &'static str) -> Cancellation {
    let (started, cancellation) = (Instant::now(), Cancellation::default());
    let (on_signal, first) = (cancellation.clone(), AtomicBool::new(true));
    // Without a handler, a signal ends the program as usual.
    let _ = ctrlc::set_handler(move || {
        if !first.swap(false, Ordering::Relaxed) {
            std::process::exit(130);
        }
        on_signal.request(Halt::Interrupted);
        eprint_line(notice);
        let after_signal = on_signal.clone();
        let _ = thread::Builder::new().spawn(move || insist(&after_signal, started.elapsed()));
    });
    wait(limit, &cancellation);
    cancellation
}

/// Returns a cancellation that is requested by the time limit only; a signal ends the program as usual.
pub(crate) fn cancel_after(limit: Limit) -> Cancellation {
    let cancellation = Cancellation::default();
    wait(limit, &cancellation);
    cancellation
}

/// Ends the program with an error at the time limit, for commands without intermediate results that write files
/// atomically.
pub(crate) fn exit_after(limit: Limit) {
    let Some(limit) = limit.time_limit else { return };
    let _ = thread::Builder::new().spawn(move || {
        thread::sleep(limit);
        eprint_line(&format!("error: not finished within the time limit of {} s", limit.as_secs_f64()));
        std::process::exit(3);
    });
}

fn wait(limit: Limit, cancellation: &Cancellation) {
    let Some(limit) = limit.time_limit else { return };
    let on_timeout = cancellation.clone();
    let _ = thread::Builder::new().spawn(move || {
        thread::sleep(limit);
        on_timeout.request(Halt::TimeLimit);
        insist(&on_timeout, limit);
    });
}

/// Gives a run of this age time to conclude, and then cancels its concluding simulations.
fn insist(cancellation: &Cancellation, age: Duration) {
    thread::sleep((age / CONCLUDING_SHARE).clamp(MIN_CONCLUDING, MAX_CONCLUDING));
    cancellation.insist();
}

fn duration(text: &str) -> Result<Duration, String> {
    let seconds = Quantity::parse(text)?.to(&Unit::known("s"))?;
    Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|limit| !limit.is_zero())
        .ok_or_else(|| format!("expected a positive time such as `10 min`, found `{text}`"))
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
