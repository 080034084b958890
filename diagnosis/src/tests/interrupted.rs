//! Impatience: a diagnosis that the user ends says nothing, whatever it was at, and is over at once.

use std::sync::atomic::{AtomicUsize, Ordering};

use mops_core::Watch;

use super::pairs::swings;
use crate::testing::catalogue;
use crate::{Options, diagnose};

/// Wants an end after so many simulations; counts how often it was asked.
struct After {
    most: usize,
    asked: AtomicUsize,
}

impl Watch for After {
    fn wants_stop(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) >= self.most
    }
}

#[test]
#[ignore = "full tier"]
fn an_end_is_heard_within_any_part_of_the_search() {
    let effects = catalogue(&["coulomb-friction", "quadratic-drag", "sensor-bias"]);
    let options = Options { max_effects: 3, level: 0.01, ..Options::default() };
    let run = |most: usize| {
        let watch = After { most, asked: AtomicUsize::new(0) };
        let done = diagnose(&swings(), &effects, &options, &watch);
        (done, watch.asked.load(Ordering::Relaxed))
    };
    let (whole, all) = run(usize::MAX);
    assert!(whole.is_ok() && all > 1000, "{all}");
    for most in [0, 1, 2, 5, 10, 20, 50, all / 16, all / 8, all / 4, all / 2, all * 3 / 4] {
        let (done, asked) = run(most);
        match done {
            // Once the declared model is fitted there is a diagnosis.
            Ok(diagnosis) => assert!(diagnosis.is_stopped && diagnosis.before[0].normalised.is_finite()),
            Err(why) => {
                assert_eq!(why.message, "the diagnosis was interrupted before the declared model was fitted");
            }
        }
        // What was about to simulate is refused, and asks for little more.
        assert!(
            asked < most + all / 20,
            "asked {asked} times, of {all} in a whole search, although {most} were to be the last"
        );
    }
}
