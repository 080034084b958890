//! Dual active-set method for strictly convex quadratic programs.
//!
//! ```text
//! min over x   1/2 x'Hx + c'x    subject to   a_i x >= b_i
//! ```
//! Every iterate is the minimiser over its active constraints, with non-negative multipliers. One violated constraint
//! is added at a time; constraints whose multiplier reaches 0 during the step are dropped.
//!
//! With `H = L L'` and the normals `N` of the active constraints, `L^-1 N = Q [R; 0]` and `J = L^-T Q`. Plane rotations
//! update `J` and the upper triangular `R`. The last iterate is recomputed from its active set to remove accumulated
//! rounding errors.
//!
//! Source: D. Goldfarb, A. Idnani, A numerically stable dual method for solving strictly convex quadratic programs,
//! Mathematical Programming 27 (1983) 1-33.

/// Linear constraints `a_i x >= b_i`.
#[derive(Debug, Default)]
pub struct Constraints {
    /// Normals `a_i`, concatenated.
    pub normals: Vec<f64>,
    /// Right-hand sides `b_i`.
    pub bounds: Vec<f64>,
}

impl Constraints {
    /// Removes all constraints.
    pub fn clear(&mut self) {
        self.normals.clear();
        self.bounds.clear();
    }
}

/// Solver for quadratic programs; reuses its memory from one program to the next.
#[derive(Debug, Default)]
pub struct ActiveSet {
    /// Number of variables.
    n: usize,
    /// Matrix `J`, column-major.
    j: Vec<f64>,
    /// Matrix `R`, column-major.
    r: Vec<f64>,
    /// Indices of the active constraints.
    active: Vec<usize>,
    /// Indices of the constraints active in the previous program (warm start).
    previous_active: Vec<usize>,
    /// Multipliers of the active constraints.
    multipliers: Vec<f64>,
    /// Iterate.
    x: Vec<f64>,
    /// Projection `J'a` of the constraint to be added.
    projected_normal: Vec<f64>,
    /// Step of the iterate.
    step: Vec<f64>,
    /// Step of the multipliers.
    multiplier_step: Vec<f64>,
    /// Last entry of every column of `L` that is not 0.
    last: Vec<usize>,
}

/// Relative norm of the projected normal below which the normal is linearly dependent on the active ones.
const DEPENDENT: f64 = 1e-13;

impl ActiveSet {
    /// Solves a program whose Hessian has the Cholesky factor `l` (column-major).
    ///
    /// `first` lists constraints that are active with positive multipliers at the minimum over them; it may be empty.
    /// Constraints active in the previous program are tested for violation before all others. Returns false if the
    /// constraints are inconsistent, if rounding errors prevent convergence, or as soon as `goes_on` does, which is
    /// asked before every step.
    pub fn solve(
        &mut self,
        goes_on: &dyn Fn() -> bool,
        l: &[f64],
        c: &[f64],
        constraints: &Constraints,
        first: &[usize],
    ) -> bool {
        self.previous_active.clone_from(&self.active);
        self.previous_active.retain(|p| *p < constraints.bounds.len());
        self.reset(l, c.len());
        for &p in first {
            self.project_normal(row(constraints, p, self.n));
            if !self.add(p) {
                return false;
            }
        }
        self.minimise_over_active_set(c, constraints);
        let max_steps = 50 + 20 * (self.n + constraints.bounds.len());
        let mut steps = 0;
        while let Some((p, mut slack)) = self.most_violated(constraints) {
            let mut multiplier = 0.0;
            loop {
                steps += 1;
                if steps > max_steps || !goes_on() {
                    return false;
                }
                let normal = row(constraints, p, self.n);
                self.project_normal(normal);
                let curvature = self.step_directions();
                let (length, drop) = self.ratio_test();
                let full = if curvature > 0.0 { -slack / curvature } else { f64::INFINITY };
                let step_length = length.min(full);
                if step_length.is_infinite() {
                    return false;
                }
                for (u, multiplier_step) in self.multipliers.iter_mut().zip(&self.multiplier_step) {
                    *u -= step_length * multiplier_step;
                }
                multiplier += step_length;
                if full.is_finite() {
                    for (x, step) in self.x.iter_mut().zip(&self.step) {
                        *x += step_length * step;
                    }
                    slack = dot(normal, &self.x) - constraints.bounds[p];
                }
                if full <= length {
                    if !self.add(p) {
                        return false;
                    }
                    *self.multipliers.last_mut().expect("one was added") = multiplier;
                    break;
                }
                self.drop(drop);
            }
        }
        self.minimise_over_active_set(c, constraints);
        self.x.iter().all(|x| x.is_finite())
    }

    /// Returns the solution.
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Iterates over the indices and multipliers of the active constraints.
    pub fn active(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.active.iter().copied().zip(self.multipliers.iter().copied())
    }

    /// Resets the method to `J = L^-T` and an empty active set.
    fn reset(&mut self, l: &[f64], n: usize) {
        self.n = n;
        self.active.clear();
        self.multipliers.clear();
        self.j.clear();
        self.j.resize(n * n, 0.0);
        for buffer in [&mut self.x, &mut self.projected_normal, &mut self.step] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
        self.multiplier_step.clear();
        self.r.clear();
        self.r.resize(n * n, 0.0);
        // Last entry of every column of L that is not 0.
        self.last.clear();
        self.last.extend((0..n).map(|i| (i..n).rev().find(|&m| l[i * n + m] != 0.0).unwrap_or(i)));
        // Column k of L^-T by back substitution: L' J = I.
        for k in 0..n {
            for i in (0..=k).rev() {
                // A diagonal factor has nothing below the diagonal.
                let known: f64 = (i + 1..=k.min(self.last[i])).map(|m| l[i * n + m] * self.j[k * n + m]).sum();
                self.j[k * n + i] = (if i == k { 1.0 } else { 0.0 } - known) / l[i * n + i];
            }
        }
    }

    /// Computes the projected normal `J'a`.
    fn project_normal(&mut self, normal: &[f64]) {
        for (projected_normal, column) in self.projected_normal.iter_mut().zip(self.j.chunks_exact(self.n)) {
            *projected_normal = dot(column, normal);
        }
    }

    /// Computes the steps of the iterate and of the multipliers per unit of the new multiplier. Returns the curvature
    /// along the step of the iterate: 0 if the normal is linearly dependent on the active ones.
    fn step_directions(&mut self) -> f64 {
        let (n, q) = (self.n, self.active.len());
        self.multiplier_step.clear();
        self.multiplier_step.extend_from_slice(&self.projected_normal[..q]);
        for i in (0..q).rev() {
            self.multiplier_step[i] /= self.r[i * n + i];
            let known = self.multiplier_step[i];
            for k in 0..i {
                self.multiplier_step[k] -= known * self.r[i * n + k];
            }
        }
        let free: f64 = self.projected_normal[q..].iter().map(|d| d * d).sum();
        let all: f64 = self.projected_normal.iter().map(|d| d * d).sum();
        if free <= DEPENDENT * DEPENDENT * all {
            return 0.0;
        }
        self.step.fill(0.0);
        for (d, column) in self.projected_normal[q..].iter().zip(self.j.chunks_exact(n).skip(q)) {
            for (step, j) in self.step.iter_mut().zip(column) {
                *step += d * j;
            }
        }
        free
    }

    /// Returns the largest step that keeps all multipliers non-negative, and the position of the blocking constraint.
    fn ratio_test(&self) -> (f64, usize) {
        let ratios = self.multipliers.iter().zip(&self.multiplier_step).enumerate();
        let ratios = ratios
            .filter(|(_, (_, multiplier_step))| **multiplier_step > 0.0)
            .map(|(i, (u, multiplier_step))| (u.max(0.0) / multiplier_step, i));
        ratios.fold((f64::INFINITY, 0), |best, next| if next.0 < best.0 { next } else { best })
    }

    /// Adds the projected constraint; returns false if rounding errors cancel its normal.
    fn add(&mut self, p: usize) -> bool {
        let (n, q) = (self.n, self.active.len());
        if q == n {
            return false;
        }
        for k in (q + 1..n).rev() {
            let (cos, sin, length) = rotation(self.projected_normal[k - 1], self.projected_normal[k]);
            if sin != 0.0 {
                (self.projected_normal[k - 1], self.projected_normal[k]) = (length, 0.0);
                self.rotate(k - 1, cos, sin);
            }
        }
        self.r[q * n..q * n + q + 1].copy_from_slice(&self.projected_normal[..=q]);
        self.active.push(p);
        self.multipliers.push(0.0);
        self.projected_normal[q] != 0.0
    }

    /// Drops the active constraint at `position`.
    fn drop(&mut self, position: usize) {
        let n = self.n;
        self.active.remove(position);
        self.multipliers.remove(position);
        let q = self.active.len();
        for column in position..q {
            self.r.copy_within((column + 1) * n..(column + 1) * n + column + 2, column * n);
        }
        for k in position..q {
            let (cos, sin, length) = rotation(self.r[k * n + k], self.r[k * n + k + 1]);
            (self.r[k * n + k], self.r[k * n + k + 1]) = (length, 0.0);
            for column in k + 1..q {
                let (a, b) = (self.r[column * n + k], self.r[column * n + k + 1]);
                (self.r[column * n + k], self.r[column * n + k + 1]) = (cos * a + sin * b, cos * b - sin * a);
            }
            self.rotate(k, cos, sin);
        }
    }

    /// Rotates the columns `k` and `k + 1` of `J`.
    fn rotate(&mut self, k: usize, cos: f64, sin: f64) {
        let (left, right) = self.j[k * self.n..(k + 2) * self.n].split_at_mut(self.n);
        for (a, b) in left.iter_mut().zip(right) {
            (*a, *b) = (cos * *a + sin * *b, cos * *b - sin * *a);
        }
    }

    /// Computes the minimiser over the active constraints and their multipliers: `x = J y`, `R'y_1 = b`, `y_2 =
    /// -J_2'c`, `R u = y_1 + J_1'c`.
    fn minimise_over_active_set(&mut self, c: &[f64], constraints: &Constraints) {
        let (n, q) = (self.n, self.active.len());
        self.x.fill(0.0);
        for k in 0..n {
            let gradient = dot(&self.j[k * n..(k + 1) * n], c);
            let y = if k < q {
                let known: f64 = (0..k).map(|i| self.r[k * n + i] * self.projected_normal[i]).sum();
                (constraints.bounds[self.active[k]] - known) / self.r[k * n + k]
            } else {
                -gradient
            };
            self.projected_normal[k] = y;
            if k < q {
                self.multipliers[k] = y + gradient;
            }
            for (x, j) in self.x.iter_mut().zip(&self.j[k * n..(k + 1) * n]) {
                *x += y * j;
            }
        }
        for i in (0..q).rev() {
            self.multipliers[i] /= self.r[i * n + i];
            let known = self.multipliers[i];
            for k in 0..i {
                self.multipliers[k] -= known * self.r[i * n + k];
            }
        }
    }

    /// Returns the most violated constraint and its slack: among those active in the previous program, otherwise among
    /// all.
    fn most_violated(&self, constraints: &Constraints) -> Option<(usize, f64)> {
        let largest = self.x.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
        let worst = |candidates: &mut dyn Iterator<Item = usize>| {
            let (mut worst, mut max_steps) = (None, -ROUNDING);
            for p in candidates {
                let normal = row(constraints, p, self.n);
                let slack = dot(normal, &self.x) - constraints.bounds[p];
                if slack >= 0.0 {
                    continue;
                }
                let size = normal.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
                let relative = slack / (size * (1.0 + largest) + constraints.bounds[p].abs());
                if relative < max_steps && !self.active.contains(&p) {
                    (worst, max_steps) = (Some((p, slack)), relative);
                }
            }
            worst
        };
        worst(&mut self.previous_active.iter().copied()).or_else(|| worst(&mut (0..constraints.bounds.len())))
    }
}

/// Violation regarded as zero, relative to the terms of a constraint.
const ROUNDING: f64 = 1e-12;

fn row(constraints: &Constraints, p: usize, n: usize) -> &[f64] {
    &constraints.normals[p * n..(p + 1) * n]
}

/// Inner product with four independent partial sums, which the processor can compute in parallel.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 4];
    for (a, b) in a4.zip(b4) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Cosine and sine of the rotation that maps `(a, b)` to `(length, 0)`, and the length.
fn rotation(a: f64, b: f64) -> (f64, f64, f64) {
    if b == 0.0 {
        return (1.0, 0.0, a);
    }
    let length = (a * a + b * b).sqrt();
    (a / length, b / length, length)
}

#[cfg(test)]
mod tests;
