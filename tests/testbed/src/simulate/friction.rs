//! Dry friction with exact rest.
//!
//! A joint with dry friction slides in either direction or rests. During sliding, the direction in the formula is that
//! of the mode, so that a step is smooth. If a step passes zero speed, the zero crossing is located (regula falsi on
//! the step size) and the speed set to exactly 0. The joint then rests if the force required is within the breakaway
//! level, and slides on otherwise.
//!
//! At rest, the force that keeps the acceleration at 0 is computed. The joint breaks away when a command drives that
//! force beyond the level, or at the end of a step that exceeds it.

use super::step::{FEW, SIZE, State, runge_kutta};
use super::world::Mode;
use super::world::World;
use crate::law::Spot;

impl World<'_> {
    /// Returns the sum of the breakaway levels of all effects at a joint, for a direction.
    fn hold(&self, j: usize, t: f64, x: &State, way: f64) -> f64 {
        let here = self.effects.iter().enumerate().filter(|(_, e)| e.spot == Spot::Place(j));
        here.filter_map(|(i, e)| e.law.dry.as_ref().map(|dry| dry(&self.at(i, t, x), way).hold)).sum()
    }

    /// Sets the initial modes.
    pub(super) fn begin(&mut self, t: f64, x: &State) {
        for j in 0..self.plant.places.len() {
            let speed = x[self.plant.places[j].equation()];
            if self.modes[j] != Mode::Free && speed != 0.0 {
                self.modes[j] = Mode::Slides(speed.signum());
            }
        }
        self.break_away(t, x);
    }

    /// Releases joints at rest whose force exceeds the level.
    pub(super) fn break_away(&mut self, t: f64, x: &State) {
        for j in 0..self.plant.places.len() {
            if self.modes[j] == Mode::Rests {
                let (mut dx, mut fixed) = ([0.0; SIZE], [0.0; FEW]);
                self.rates(t, x, &mut dx, &mut fixed);
                let way = -fixed[j].signum();
                if fixed[j].abs() > self.hold(j, t, x, way) {
                    self.modes[j] = Mode::Slides(way);
                }
            }
        }
    }

    fn step(&self, t: f64, x: &State, h: f64) -> State {
        runge_kutta(x, self.n, h, |c, x, dx| self.rates(t + c * h, x, dx, &mut [0.0; FEW]))
    }

    /// Advances by `h`, through the mode changes of joints with dry friction.
    pub(super) fn advance(&mut self, t: f64, x: State, h: f64) -> State {
        let (mut x, mut t, mut left) = (x, t, h);
        for _ in 0..12 {
            let y = self.step(t, &x, left);
            let turned = (0..self.plant.places.len()).filter_map(|j| match self.modes[j] {
                Mode::Slides(way) if way * y[self.plant.places[j].equation()] < 0.0 => {
                    Some((j, self.crossing(j, t, &x, left, &y)))
                }
                _ => None,
            });
            let first = turned.min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((j, length)) = first else {
                x = y;
                t += left;
                break;
            };
            if length > 0.0 {
                x = self.step(t, &x, length);
                x[self.plant.places[j].equation()] = 0.0;
            }
            self.modes[j] = Mode::Rests;
            if length <= 0.0 {
                continue; // The joint would reverse at once: it rests until the end of this step.
            }
            t += length;
            left -= length;
            self.break_away(t, &x);
            if left <= 1e-9 * h {
                break;
            }
        }
        self.break_away(t, &x);
        self.settle(t, &mut x);
        x
    }

    /// Returns the step size at whose end the speed of joint `j` is 0.
    fn crossing(&self, j: usize, t: f64, x: &State, h: f64, end: &State) -> f64 {
        let equation = self.plant.places[j].equation();
        let (mut low, mut high) = ((0.0, x[equation]), (h, end[equation]));
        if low.1 == 0.0 {
            return 0.0;
        }
        let mut last = 0;
        for _ in 0..30 {
            let middle = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let speed = self.step(t, x, middle)[equation];
            if speed.abs() < 1e-12 * (low.1.abs() + high.1.abs()) || high.0 - low.0 < 1e-12 * h {
                return middle;
            }
            // Illinois: an end kept twice is halved.
            if speed * low.1 > 0.0 {
                low = (middle, speed);
                if last == 1 {
                    high.1 *= 0.5;
                }
                last = 1;
            } else {
                high = (middle, speed);
                if last == -1 {
                    low.1 *= 0.5;
                }
                last = -1;
            }
        }
        high.0
    }
}
