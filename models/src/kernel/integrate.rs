//! Integration over all steps, with breaks and events.

use mops_core::{Failure, Plant, model::Work};
use mops_language::Scalar;

use super::attempt::Attempt;
use super::dormand_prince::DormandPrince;
use super::esdirk::Esdirk;
use super::events::{Crossing, Events};
use super::instants::common;
use super::integrable::Integrable;
use super::method::Method;
use super::sink::{Integrated, Sink};
use super::step::Step;
use super::step_size::{StepSizes, first_step};
use super::weights::Weights;
use super::{Driven, IntegrationMethod, Tolerance};

/// Growth of the longest stable step over a step that does not show it.
const RELAXED: f64 = 1.5;

/// What limits the steps of an integration.
#[derive(Debug, Default)]
struct Limits {
    /// Number of steps that end at a break.
    breaks: usize,
    /// Number of steps as long as the plant, its inputs or the tolerance allow.
    longest: usize,
}

impl Limits {
    fn count(&mut self, ends_at_break: bool, is_longest: bool) {
        self.breaks += usize::from(ends_at_break);
        self.longest += usize::from(is_longest && !ends_at_break);
    }

    /// Returns what limits most of the steps, with a remedy.
    fn cause(&self, steps: usize) -> &'static str {
        if 2 * self.breaks > steps {
            "most steps end at an instant of a clock, at a sample of an input, or where a jump arrives after a delay; raise \
             `max-steps` of `tolerance`, or shorten the horizon"
        } else if 2 * self.longest > steps {
            "most steps are as long as `max-step`, a delay (half of it) or the sine of an input (a sixteenth of its period) allows; \
             raise `max-steps` of `tolerance`, or shorten the horizon"
        } else {
            "the equations are stiff or the tolerance is too tight; try `method = \"stiff\"` of `tolerance`, or raise its `max-steps`"
        }
    }
}

/// Integrates from `t` to `end` and reports every step and event to `sink`. The loop is compiled once for all plants.
///
/// # Errors
/// The state becomes infinite, the step limit is reached, or the step size underflows.
pub fn integrate<S: Scalar, P: Plant<S>>(
    system: &mut Driven<'_, S, P>,
    t: f64,
    end: f64,
    x: &[S],
    tolerance: &Tolerance,
    sink: &mut impl for<'p> Sink<S, dyn Integrable<S> + 'p>,
) -> Integrated<S> {
    let system: &mut Driven<'_, S, dyn Integrable<S> + '_> = system;
    integrate_for(system, (t, end), x, tolerance, sink)
}

/// Integrates for a sink that looks into the plant; otherwise as [`integrate`].
pub(crate) fn integrate_for<S: Scalar, P: Integrable<S> + ?Sized>(
    system: &mut Driven<'_, S, P>,
    span: (f64, f64),
    x: &[S],
    tolerance: &Tolerance,
    sink: &mut impl Sink<S, P>,
) -> Integrated<S> {
    match tolerance.method {
        IntegrationMethod::Explicit => run::<S, P, DormandPrince<S>>(system, span, x, tolerance, sink),
        IntegrationMethod::Stiff => run::<S, P, Esdirk<S>>(system, span, x, tolerance, sink),
    }
}

fn run<S: Scalar, P: Integrable<S> + ?Sized, M: Method<S>>(
    system: &mut Driven<'_, S, P>,
    (mut t, end): (f64, f64),
    start: &[S],
    tolerance: &Tolerance,
    sink: &mut impl Sink<S, P>,
) -> Integrated<S> {
    let span = end - t;
    let mut x = start.to_vec();
    let mut work = Work::default();
    let mut method = M::new(system, &x);
    let mut weights = Weights::new(|state| system.plant.scale(state), &x, span, tolerance);
    let mut events = Events::new(span, &x);
    let mut next = x.clone();
    let mut spare = x.clone();
    let mut step = Step::new(&x);

    system.pass_break(t, &mut x);
    events.settle(system, (t, &[]), (&mut x, &mut spare), sink)?;
    method.restart(system, t, &x, &mut work);
    let mut proposed = first_step(system, (t, end), &x, method.slope(), M::ERROR_ORDER);
    work.derivatives += 1;
    let mut sizes = StepSizes::new(M::ERROR_ORDER);
    // Rejected attempts at the current step.
    let mut rejected = 0;
    let damped = if M::IS_EXPLICIT { system.plant.damped_step() } else { f64::INFINITY };
    // Longest step that damps all modes, as far as the accepted steps show it. The error alone does not limit a step at
    // rest: there the tangents would grow while the state does not.
    let mut stable = f64::INFINITY;
    let longest = system.longest_step().min(damped).min(tolerance.max_step.unwrap_or(f64::INFINITY));

    let mut limits = Limits::default();
    let remembers = system.remembers();
    // The next break changes only at an event or at the break itself, unless accepted steps move it.
    let mut stop = system.next_break(t).min(end);

    while t < end {
        if work.steps + work.rejected >= tolerance.max_steps {
            return Err(Failure::StepLimit(t, limits.cause(work.steps + work.rejected).to_owned()));
        }
        if let Some(failure) = sink.ends(t) {
            return Err(failure);
        }
        if remembers {
            stop = system.next_break(t).min(end);
        }
        proposed = proposed.min(longest).min(stable);
        // A step that would leave a sliver before the stop is lengthened to reach it. Cutting a step does not change
        // the proposed step size.
        let reaches = t + 1.01 * proposed >= stop;
        let h = if reaches { stop - t } else { proposed };
        limits.count(reaches && stop < end, proposed >= longest);
        if !reaches && h <= 16.0 * f64::EPSILON * t.abs() {
            return Err(Failure::StepTooSmall(t));
        }
        work.derivatives += weights.feel(|t, x, dx| system.derivative(t, x, dx), (t, h, &x), rejected);
        let error = method.attempt(system, Attempt { t, h, x: &x, weights: &weights }, &mut next, &mut work);
        if !error.is_finite() || error > 1.0 {
            if !error.is_finite() && (h < 1e-12 * span || !all_finite(&x)) {
                return Err(Failure::Diverged(t));
            }
            proposed = h * sizes.after_rejection(error);
            work.rejected += 1;
            rejected += 1;
            continue;
        }
        work.steps += 1;
        work.rough += usize::from(weights.is_rough(h, &x));
        step.begin(t, h);
        if sink.reads_steps() || events.are_watched() || remembers {
            method.dense(h, &x, &next, &mut step.dense);
        }
        let arrival = if reaches { stop } else { t + h };
        let event = events.first(system, &mut step, (arrival, &next), &mut spare);
        sink.step(&step, system);
        if remembers {
            system.remember(&step);
        }
        stable = method.stable_step(&next, &weights).unwrap_or(RELAXED * stable);
        let factor = sizes.after_acceptance(error, rejected > 0);
        proposed = if reaches { proposed.max(h * factor) } else { h * factor };
        rejected = 0;
        let Some(first) = event else {
            std::mem::swap(&mut x, &mut next);
            t = arrival;
            weights.follow(&x);
            if !reaches {
                method.advance();
                continue;
            }
            let moves = pass_break(system, (t, end), &mut x, sink);
            sink.restart(t, moves);
            events.settle(system, (t, &[]), (&mut x, &mut spare), sink)?;
            if t < end {
                stop = system.next_break(t).min(end);
                method.restart(system, t, &x, &mut work);
            }
            continue;
        };
        let crossings = Crossing::all(system, first, &step, &mut spare);
        let here = step.time(step.share);
        let at_stop = reaches && stop - here <= events.resolution(stop);
        if at_stop {
            t = stop;
            std::mem::swap(&mut x, &mut next);
        } else {
            t = here;
            step.at(step.share, &mut x);
        }
        let mut moves = Crossing::common(&crossings);
        if at_stop {
            let mut values =
                |system: &Driven<'_, S, P>, x: &[S]| (S::DIRECTIONS > 0).then(|| values(system, t, x, &mut spare));
            let before = values(system, &x);
            let of_break = pass_break(system, (t, end), &mut x, sink);
            // A break at which nothing jumps leaves the time of the event alone.
            if before != values(system, &x) {
                moves = common(moves, of_break);
            }
        }
        sink.restart(t, moves);
        events.settle(system, (t, &crossings), (&mut x, &mut spare), sink)?;
        weights.follow(&x);
        stop = system.next_break(t).min(end);
        method.restart(system, t, &x, &mut work);
    }
    if all_finite(&x) { Ok((x, work)) } else { Err(Failure::Diverged(t)) }
}

/// Returns the values of the state and of its rates.
fn values<S: Scalar, P: Integrable<S> + ?Sized>(f: &Driven<'_, S, P>, t: f64, x: &[S], dx: &mut [S]) -> Vec<f64> {
    f.derivative(t, x, dx);
    x.iter().chain(&*dx).map(|value| value.value()).collect()
}

/// Sets the inputs to their values at the break. At the end of the simulation, reports them to the sink. Returns the
/// derivatives of the time of the break.
fn pass_break<S: Scalar, P: Integrable<S> + ?Sized>(
    system: &mut Driven<'_, S, P>,
    (t, end): (f64, f64),
    x: &mut [S],
    sink: &mut impl Sink<S, P>,
) -> S {
    let moves = system.pass_break(t, x);
    if t >= end {
        sink.end(t, x, system);
    }
    moves
}

fn all_finite<S: Scalar>(x: &[S]) -> bool {
    x.iter().all(|x| x.value().is_finite())
}
