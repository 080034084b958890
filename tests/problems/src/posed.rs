//! Problem as seen by solvers: variables in the unit box, criteria as scaled values.

use mops_core::{
    Evaluation, Merit, Objective, Shape, Usage,
    problem::{Evaluator, Slopes},
};
use mops_math::stream;
use rand::Rng;

use crate::bounds::finite;
use crate::problem::{Problem, Sense};

/// Source of the gradients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slope {
    /// Dual numbers.
    Exact,
    /// Finite differences.
    Differences,
}

/// Problem over the unit box.
///
/// The scaled value of a minimised function is the function itself. The scaled value of a constraint is one more than
/// the constraint, so that its limit is 1.
pub struct Posed<'a> {
    problem: &'a Problem,
    shape: Shape,
    bounds: Vec<[f64; 2]>,
    slope: Slope,
    noise: f64,
    seed: u64,
}

impl<'a> Posed<'a> {
    /// Creates the problem over its box.
    ///
    /// # Panics
    /// If the functions are undefined at the initial guess or give fewer outputs than there are constraints: the
    /// problem definition is wrong.
    pub fn new(problem: &'a Problem, slope: Slope) -> Self {
        let outputs = problem.functions.values(&problem.start).len();
        let minimised = outputs
            .checked_sub(problem.inequalities + problem.equalities)
            .expect("there are at least as many outputs as constraints");
        let (objectives, residuals) = match problem.sense {
            Sense::Max | Sense::Each => (minimised, 0),
            Sense::MaxAbs => (2 * minimised, 0),
            Sense::Squares => (1, minimised),
        };
        let mut rows = vec![(Usage::Minimise, 1.0); objectives];
        rows.extend(vec![(Usage::Inequality, 1.0); problem.inequalities]);
        rows.extend(vec![(Usage::Equality, 1.0); problem.equalities]);
        let objective = match problem.sense {
            Sense::Max | Sense::MaxAbs => Objective::Max,
            Sense::Squares => Objective::Sum,
            Sense::Each => Objective::Each,
        };
        let shape = Shape { spacing: vec![0.0; problem.dimension()], rows, objective, residuals, ..Shape::default() };
        let bounds = finite(&problem.start, &problem.bounds, problem.reach);
        Self { problem, shape, bounds, slope, noise: 0.0, seed: 1 }
    }

    /// Multiplies every output by 1 + `noise` times a number between -1 and 1 that depends on the point.
    #[must_use]
    pub fn with_noise(self, noise: f64) -> Self {
        Self { noise, ..self }
    }

    /// Sets the seed of the random streams and of the noise.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// Returns the problem.
    pub fn problem(&self) -> &'a Problem {
        self.problem
    }

    /// Returns the finite box.
    pub fn bounds(&self) -> &[[f64; 2]] {
        &self.bounds
    }

    /// Returns the initial guess as a point of the unit box.
    pub fn start(&self) -> Vec<f64> {
        self.point_of(&self.problem.start)
    }

    /// Returns the point of the unit box for values of the variables; values beyond a bound are moved to it.
    pub fn point_of(&self, x: &[f64]) -> Vec<f64> {
        let position = |(x, [low, high]): (&f64, &[f64; 2])| {
            if high > low { ((x - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 }
        };
        x.iter().zip(&self.bounds).map(position).collect()
    }

    fn outputs(&self, x: &[f64]) -> Vec<f64> {
        let mut outputs = self.problem.functions.values(x);
        if self.noise > 0.0 {
            let bits = x.iter().fold(self.seed, |hash, x| (hash ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3));
            let mut random = stream(bits, "noise");
            outputs.iter_mut().for_each(|y| *y *= 1.0 + self.noise * random.random_range(-1.0..1.0));
        }
        outputs
    }

    /// Computes scaled values from outputs, or their gradients from gradients of outputs; `limit` is added to
    /// constraints.
    fn rows(&self, outputs: &[f64], squares: impl Fn(&[f64]) -> f64, limit: f64) -> Vec<f64> {
        let constraints = self.problem.inequalities + self.problem.equalities;
        let (minimised, constraints) = outputs.split_at(outputs.len() - constraints);
        let mut rows = Vec::with_capacity(self.shape.rows.len());
        match self.problem.sense {
            Sense::Max | Sense::Each => rows.extend_from_slice(minimised),
            Sense::MaxAbs => rows.extend(minimised.iter().flat_map(|&y| [y, -y])),
            Sense::Squares => rows.push(squares(minimised)),
        }
        rows.extend(constraints.iter().map(|c| c + limit));
        rows
    }
}

impl Evaluator for Posed<'_> {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn evaluate(&self, point: &[f64]) -> Evaluation {
        let tuners = self.tuners_at(point);
        let outputs = self.outputs(&tuners);
        let scaled = self.rows(&outputs, |r| r.iter().map(|r| r * r).sum(), 1.0);
        let scaled = Some(scaled).filter(|rows| rows.iter().all(|row| row.is_finite()));
        let merit = scaled.as_ref().map_or(Merit::FAILED, |scaled| self.shape.merit(scaled));
        let residuals = outputs[..self.shape.residuals].to_vec();
        let point = point.to_vec();
        Evaluation { point, tuners, readings: Vec::new(), scaled, residuals, failures: Vec::new(), merit }
    }

    fn tuners_at(&self, point: &[f64]) -> Vec<f64> {
        point.iter().zip(&self.bounds).map(|(u, [low, high])| (low + u * (high - low)).clamp(*low, *high)).collect()
    }

    fn slopes(&self, at: &Evaluation, _: f64) -> Option<Slopes> {
        if self.slope == Slope::Differences {
            return None;
        }
        let width = |j: usize| self.bounds[j][1] - self.bounds[j][0];
        let at_point = self.outputs(&at.tuners)[..self.shape.residuals].to_vec();
        let outputs = self.problem.functions.slopes(&at.tuners);
        let n = at.point.len();
        let mut rows = vec![Vec::with_capacity(n); self.shape.rows.len()];
        let mut residuals = Vec::with_capacity(n);
        for j in 0..n {
            let column: Vec<f64> = outputs.iter().map(|slope| slope[j] * width(j)).collect();
            let squares = |slopes: &[f64]| at_point.iter().zip(slopes).map(|(r, s)| 2.0 * r * s).sum();
            for (row, slope) in rows.iter_mut().zip(self.rows(&column, squares, 0.0)) {
                row.push(slope);
            }
            residuals.push(column[..self.shape.residuals].to_vec());
        }
        let finite = rows.iter().flatten().all(|slope| slope.is_finite());
        finite.then_some(Slopes { rows, residuals, at: at_point })
    }

    /// Returns the noise level: that of rounding, or the added noise.
    fn noise(&self) -> f64 {
        self.noise.max(1e-16)
    }

    fn seed(&self) -> u64 {
        self.seed
    }
}

#[cfg(test)]
mod tests {
    use mops_core::{Oracle, Run, run::Budget};
    use mops_language::Scalar;

    use super::*;
    use crate::Functions;

    fn rosenbrock<S: Scalar>(x: &[S]) -> Vec<S> {
        vec![(x[1] - x[0] * x[0]) * 10.0, -x[0] + 1.0, x[0] - 2.0, x[1] - 1.0]
    }

    fn problem() -> Problem {
        Problem {
            sense: Sense::Squares,
            inequalities: 1,
            equalities: 1,
            bounds: vec![[-3.0, 5.0], [f64::NEG_INFINITY, 4.0]],
            ..Problem::new("R", &[-1.2, 1.0], 0.0, Functions::of(rosenbrock, rosenbrock))
        }
    }

    #[test]
    fn rows_and_residuals_are_those_of_the_formula() {
        let problem = problem();
        let posed = Posed::new(&problem, Slope::Exact);
        let at = posed.evaluate(&posed.start());
        let scaled = at.scaled.unwrap();
        assert!((scaled[0] - 24.2).abs() < 1e-12 && (scaled[1] + 2.2).abs() < 1e-12, "{scaled:?}");
        assert!((at.merit.violation).abs() < 1e-12 && (at.residuals[1] - 2.2).abs() < 1e-12, "{:?}", at.residuals);
    }

    #[test]
    fn exact_slopes_agree_with_differences() {
        let problem = problem();
        let slopes = |slope| {
            let posed = Posed::new(&problem, slope);
            let mut run = Run::new(&posed, Budget { evaluations: 100 }, &());
            run.linearise(&posed.start(), 1e-4).unwrap().unwrap()
        };
        let (exact, differences) = (slopes(Slope::Exact), slopes(Slope::Differences));
        let all = |at: &mops_core::solver::Linearisation| [at.rows.concat(), at.residuals.concat()].concat();
        for (a, b) in all(&exact).into_iter().zip(all(&differences)) {
            assert!((a - b).abs() < 1e-6 * a.abs().max(1.0), "{a} {b}");
        }
    }

    #[test]
    fn noise_depends_on_the_point_and_the_seed_alone() {
        let problem = problem();
        let value = |seed, u: f64| {
            let posed = Posed::new(&problem, Slope::Exact).with_noise(1e-3).with_seed(seed);
            posed.evaluate(&[u, u]).scaled.unwrap()
        };
        assert_eq!(value(1, 0.4), value(1, 0.4));
        assert_ne!(value(1, 0.4), value(2, 0.4));
    }
}
