//! End of a search: what is known of the point that it reports.

use schemars::JsonSchema;
use serde::Serialize;

use mops_core::{
    evaluation::Merit,
    solver::{Basins, Optimality, Stop},
};

/// What is known of the reported point at the end of a search.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct End {
    /// First-order classification of the reported point.
    pub point: Optimality,
    /// Ends of the local searches.
    #[serde(flatten)]
    pub basins: Basins,
    /// Reason to doubt that the reported point is the optimum, with the way out; null if there is none.
    pub doubt: Option<String>,
    /// What is known, as sentences.
    pub words: Vec<String>,
}

/// What the level of the residuals shows of other basins.
const NOISE: &str = "The residuals are noise of the stated level: no other point fits significantly better. Whether others fit \
                     as well was not searched.";

/// Doubt about a point beside a discontinuity.
const AT_JUMP: &str = "At a jump: a criterion is discontinuous beside the point, so that derivatives do not show an optimum; compare \
                       with another solver or seed.";

impl End {
    /// Returns what is known of a point with this merit and classification, after local searches that ended with the
    /// given merits. `is_noise`: the residuals are noise, see [`mops_core::Shape::is_noise`].
    #[must_use]
    pub fn new(point: Optimality, best: Merit, ends: &[Merit], stop: Stop, is_noise: bool) -> Self {
        let mut end = Self { point, basins: Basins::of(best, ends), doubt: None, words: Vec::new() };
        let of_searches = if is_noise { Some(NOISE.to_owned()) } else { end.words_of_searches() };
        end.words = end.words_of_point().into_iter().chain(of_searches).collect();
        end.doubt = end.doubt(best.is_feasible() && !is_noise, stop);
        end
    }

    /// Returns the end of a search with an equally good point elsewhere, described by a sentence: a reason to doubt the
    /// point. Searches that ended at the same value then did not all end here.
    #[must_use]
    pub fn with_twin(mut self, sentence: String) -> Self {
        self.words = self.words_of_point().into_iter().collect();
        self.doubt.get_or_insert(sentence);
        self
    }

    /// Returns the end where simulations contradict the derivatives, as a sentence states: what follows from
    /// derivatives is not shown.
    #[must_use]
    pub fn with_contradiction(mut self, sentence: String) -> Self {
        let of_point = self.words_of_point();
        self.words.retain(|words| Some(words) != of_point.as_ref());
        (self.point, self.doubt) = (Optimality::NotShown, Some(sentence));
        self
    }

    /// Returns the end of a search whose point lies beside a jump: first-order conditions show nothing there. A jump to
    /// a better value is a reason to doubt the point.
    #[must_use]
    pub fn beside_jump(mut self, to_better: bool) -> Self {
        let of_point = self.words_of_point();
        self.words.retain(|words| Some(words) != of_point.as_ref());
        if self.point.is_stationary() {
            self.point = Optimality::Jump;
        }
        self.words.splice(0..0, self.words_of_point());
        if to_better {
            self.doubt.get_or_insert_with(|| AT_JUMP.to_owned());
        }
        self
    }

    /// Returns the end of a search for less than the study states, as a sentence says: the first reason to doubt the
    /// point.
    #[must_use]
    pub fn with_first_doubt(mut self, sentence: &str) -> Self {
        self.doubt = Some(self.doubt.map_or_else(|| sentence.to_owned(), |doubt| format!("{sentence} {doubt}")));
        self
    }

    /// Returns the end with a jump near the point, as a sentence states: a reason to doubt the point.
    #[must_use]
    pub fn with_jump(mut self, sentence: String) -> Self {
        self.doubt = Some(match self.doubt {
            Some(doubt) if doubt != AT_JUMP => format!("{doubt} {sentence}"),
            _ => sentence,
        });
        self
    }

    fn words_of_point(&self) -> Option<String> {
        let words = match self.point {
            Optimality::Stationary => {
                "The point is stationary: to first order, no step of a thousandth of the box lowers the objective by more than 0.005 %."
            }
            Optimality::Kink => {
                "The point is stationary at a kink: by the derivatives around it, no step of a thousandth of the box lowers the \
                 objective by more than 0.005 %."
            }
            Optimality::Plateau => "The objective is constant around the point.",
            Optimality::Jump => "A criterion is discontinuous beside the point.",
            Optimality::Descent => "A step of a thousandth of the box lowers the objective.",
            Optimality::NotShown => return None,
        };
        Some(words.to_owned())
    }

    fn words_of_searches(&self) -> Option<String> {
        let Basins { searches, arrived, optima, unseen } = self.basins;
        match (searches, unseen) {
            (0, _) => None,
            (1, _) => Some("A single local search was completed: other basins are unexplored.".to_owned()),
            (_, unseen) => {
                let of_optima = of_optima(optima);
                let share = unseen.map(|unseen| {
                    format!(
                        "; the expected share of starting points that lead to another optimum is {:.0} %",
                        100.0 * unseen
                    )
                });
                Some(format!(
                    "Of {searches} local searches, {} ended here; together they found {of_optima}{}.",
                    none_or(arrived),
                    share.unwrap_or_default()
                ))
            }
        }
    }

    /// Returns the reason to doubt the point, with the way out.
    fn doubt(&self, may_be_elsewhere: bool, stop: Stop) -> Option<String> {
        let Basins { searches, arrived, optima, .. } = self.basins;
        let is_found_again = arrived > 1;
        match self.point {
            _ if stop == Stop::Interrupted => None,
            Optimality::Descent => Some(
                "Not an optimum, as a step of a thousandth of the box lowers the objective: raise --max-evaluations, or continue \
                 with another solver (--reuse)."
                    .to_owned(),
            ),
            Optimality::Plateau => Some(
                "On a plateau: the objective is constant around the point, so that no search sees where it falls; start \
                 elsewhere, or minimise a criterion that changes."
                    .to_owned(),
            ),
            _ if may_be_elsewhere && self.basins.is_doubtful() => {
                let here = if arrived == 1 { "only 1".to_owned() } else { none_or(arrived) };
                Some(format!(
                    "Another basin is likely, as {here} of {searches} local searches ended here, and all of them in {}: raise \
                     `starts` of the solver, or try another one.",
                    of_optima(optima)
                ))
            }
            Optimality::Jump if !is_found_again => Some(AT_JUMP.to_owned()),
            Optimality::NotShown if stop == Stop::Budget => Some(
                "The budget was spent before an optimum was shown: raise --max-evaluations, or continue with another solver \
                 (--reuse)."
                    .to_owned(),
            ),
            Optimality::NotShown if stop == Stop::TimeLimit => Some(
                "The time limit was reached before an optimum was shown: continue the run (--resume) with a larger --time-limit."
                    .to_owned(),
            ),
            _ => None,
        }
    }
}

fn of_optima(count: usize) -> String {
    if count == 1 { "1 optimum".to_owned() } else { format!("{count} optima") }
}

fn none_or(count: usize) -> String {
    if count == 0 { "none".to_owned() } else { count.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn merit(objective: f64) -> Merit {
        Merit { violation: 0.0, objective }
    }

    #[test]
    fn an_optimum_that_most_searches_reach_is_not_doubted() {
        let ends = [1.0, 1.0001, 1.0, 1.0, 1.2, 1.0].map(merit);
        let end = End::new(Optimality::Stationary, merit(1.0), &ends, Stop::Converged, false);
        let Basins { searches, arrived, optima, unseen } = end.basins;
        assert_eq!((searches, arrived, optima, &end.doubt), (6, 5, 2, &None));
        // w (w + 1)/(n (n - 1)) with w = 2, n = 6.
        assert!((unseen.unwrap() - 0.2).abs() < 1e-15);
    }

    #[test]
    fn an_optimum_that_a_single_search_of_several_reaches_is_doubted() {
        let ends = [1.0, 1.1, 1.1, 1.1].map(merit);
        let end = End::new(Optimality::Stationary, merit(1.0), &ends, Stop::Converged, false);
        assert!(end.doubt.unwrap().starts_with("Another basin is likely"));
    }

    #[test]
    fn as_many_optima_as_searches_are_not_all_of_them() {
        let ends = [1.0, 1.0, 1.3, 1.6, 2.0].map(merit);
        let end = End::new(Optimality::Stationary, merit(1.0), &ends, Stop::Converged, false);
        assert_eq!((end.basins.arrived, end.basins.optima, end.basins.unseen), (2, 4, None));
        assert!(end.doubt.is_some());
    }

    #[test]
    fn two_searches_that_agree_give_no_estimate_and_no_doubt() {
        let end = End::new(Optimality::Stationary, merit(1.0), &[merit(1.0); 2], Stop::Converged, false);
        assert_eq!((end.basins.unseen, end.doubt), (None, None));
        assert_eq!(end.words[1], "Of 2 local searches, 2 ended here; together they found 1 optimum.");
    }

    #[test]
    fn searches_of_which_none_ended_here_are_named_so() {
        let ends = [1.1, 1.2, 1.3, 1.4].map(merit);
        let end = End::new(Optimality::Stationary, merit(1.0), &ends, Stop::Converged, false);
        assert!(end.doubt.unwrap().contains("as none of 4 local searches ended here, and all of them in 4 optima"));
        let far = End::new(Optimality::Stationary, merit(1.0), &[merit(1.1); 4], Stop::Converged, false);
        assert!(
            far.doubt
                .unwrap()
                .ends_with("and all of them in 1 optimum: raise `starts` of the solver, or try another one.")
        );
    }

    #[test]
    fn a_descent_and_a_plateau_are_doubted_whatever_the_searches() {
        for point in [Optimality::Descent, Optimality::Plateau] {
            let end = End::new(point, merit(3.0), &[merit(3.0); 4], Stop::Converged, false);
            assert!(end.doubt.is_some() && !point.is_stationary());
        }
    }
}
