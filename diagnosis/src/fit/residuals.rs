//! Least squares over pieces of experiments: residuals in units of the noise, with exact slopes, bounds and start
//! values of each piece.

use std::sync::Arc;

use mops_core::{Case, Job, Model};
use rayon::prelude::*;

use super::meter::Meter;
use crate::records::{Local, Series, Subject};

/// An unknown of all pieces.
#[derive(Debug, Clone, Copy)]
pub struct Global {
    /// What it sets.
    pub sets: Sets,
    /// Smallest and largest value.
    pub bounds: [f64; 2],
    /// Whether it is looked for in its logarithm.
    pub log: bool,
    /// Typical size of a change.
    pub scale: f64,
    /// True if it has no derivative: a size of steps, the width of a gap, a force at which something breaks away.
    pub steps: bool,
}

impl Global {
    /// Whether it is looked for by a search of its own, and not by slopes.
    pub fn is_stepped(&self) -> bool {
        self.steps && !self.is_pinned()
    }

    /// Whether it has one value only.
    pub fn is_pinned(&self) -> bool {
        self.bounds[0] == self.bounds[1]
    }
}

/// What an unknown of all pieces sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sets {
    /// One of [`Subject::globals`].
    Tuner(usize),
    /// A parameter of the model.
    Parameter(usize),
}

/// A part of an experiment that is simulated by itself.
#[derive(Debug, Clone)]
pub struct Piece {
    /// The experiment, by index.
    pub measurement: usize,
    /// Inputs, at times from the start of the piece: below 0 what was before.
    pub case: Case,
    /// Samples, from the start of the piece.
    pub series: Vec<Series>,
    /// Its length, s.
    pub horizon: f64,
    /// Its unknowns.
    pub locals: Vec<Local>,
    /// Parameters of the model that are fixed in it, by index.
    pub fixed: Vec<(usize, f64)>,
}

impl Piece {
    /// The measured signals, by index, each once.
    pub fn signals(&self) -> Vec<usize> {
        let mut signals: Vec<usize> = self.series.iter().map(|s| s.signal).collect();
        signals.sort_unstable();
        signals.dedup();
        signals
    }
}

/// Unknowns and their values.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Of all pieces.
    pub globals: Vec<f64>,
    /// Of each piece.
    pub locals: Vec<Vec<f64>>,
}

/// A least-squares problem.
#[derive(Clone)]
pub struct Fit<'a> {
    /// What is diagnosed.
    pub subject: &'a Subject,
    /// The model, with effects or without.
    pub model: Arc<dyn Model>,
    /// Unknowns of all pieces.
    pub globals: Vec<Global>,
    /// The pieces.
    pub pieces: Vec<Piece>,
    /// Counts simulations, and ends them.
    pub simulations: &'a Meter<'a>,
}

/// Residuals of a piece, channel by channel, and their slopes.
#[derive(Debug, Clone)]
pub struct Residuals {
    /// `(model - measured)/noise`.
    pub r: Vec<f64>,
    /// Slopes: one column per global, then per local of the piece; no columns where none were asked for.
    pub j: Vec<Vec<f64>>,
}

impl Fit<'_> {
    /// Values of the tuners of the study.
    fn tuners(&self, point: &Point) -> Vec<f64> {
        let mut tuners = self.subject.start();
        for (global, &value) in self.globals.iter().zip(&point.globals) {
            if let Sets::Tuner(k) = global.sets {
                tuners[k] = value;
            }
        }
        tuners
    }

    /// Values of the model's parameters in a piece.
    pub fn parameters(&self, piece: usize, point: &Point) -> Vec<f64> {
        let p = &self.pieces[piece];
        let tuners = self.tuners(point);
        let mut values = self.subject.parameters(p.measurement, &tuners);
        let declared = &self.model.interface().parameters;
        let further = declared[values.len()..].iter().map(|p| p.default.unwrap_or(1.0));
        values.extend(further);
        for (global, &value) in self.globals.iter().zip(&point.globals) {
            if let Sets::Parameter(k) = global.sets {
                values[k] = value;
            }
        }
        p.fixed.iter().for_each(|&(k, value)| values[k] = value);
        p.locals.iter().zip(&point.locals[piece]).for_each(|(local, &value)| values[local.parameter] = value);
        values
    }

    /// The unknowns as directions of the model's parameters.
    fn seeds(&self, piece: usize, point: &Point, count: usize) -> Vec<Vec<f64>> {
        let p = &self.pieces[piece];
        let tuners = self.tuners(point);
        let overridden = |k: usize| p.fixed.iter().any(|f| f.0 == k) || p.locals.iter().any(|l| l.parameter == k);
        let global = |global: &Global| {
            let mut seed = match global.sets {
                Sets::Tuner(k) => self.subject.slopes(p.measurement, &tuners, k),
                Sets::Parameter(_) => Vec::new(),
            };
            seed.resize(count, 0.0);
            if let Sets::Parameter(k) = global.sets {
                seed[k] = 1.0;
            }
            if global.is_pinned() {
                seed.fill(0.0);
            }
            (0..count).filter(|&k| overridden(k)).for_each(|k| seed[k] = 0.0);
            seed
        };
        let local = |local: &Local| {
            let mut seed = vec![0.0; count];
            seed[local.parameter] = 1.0;
            seed
        };
        self.globals.iter().map(global).chain(p.locals.iter().map(local)).collect()
    }

    /// Residuals of a piece; `None` where the simulation fails.
    pub fn residuals(&self, piece: usize, point: &Point) -> Option<Vec<f64>> {
        self.look(piece, point, false).map(|found| found.r)
    }

    /// Residuals of a piece, with their slopes if these are wanted; that by a pinned global is 0.
    fn look(&self, piece: usize, point: &Point, with_slopes: bool) -> Option<Residuals> {
        let p = &self.pieces[piece];
        let parameters = self.parameters(piece, point);
        let signals = p.signals();
        let job = Job { case: &p.case, parameters: &parameters, signals: &signals, horizon: p.horizon };
        if !self.simulations.admits() {
            return None;
        }
        let all = if with_slopes { self.seeds(piece, point, parameters.len()) } else { Vec::new() };
        // What does nothing here needs no simulation.
        let (columns, seeds): (Vec<usize>, Vec<Vec<f64>>) =
            all.iter().cloned().enumerate().filter(|(_, seed)| seed.iter().any(|&s| s != 0.0)).unzip();
        let (analysis, tangents) = if seeds.is_empty() {
            (self.model.analyse(&job).ok()?, Vec::new())
        } else {
            self.model.tangents(&job, &seeds)?.ok()?
        };
        let count = p.series.iter().map(|s| s.times.len()).sum();
        let (mut r, mut j) = (Vec::with_capacity(count), vec![Vec::with_capacity(count); all.len()]);
        for s in &p.series {
            let name = &self.model.interface().signals[s.signal].name;
            let predicted = analysis.trace(name).sample(&s.times);
            r.extend(predicted.iter().zip(&s.values).map(|(p, y)| (p - y) / s.noise));
            for (&column, tangent) in columns.iter().zip(&tangents) {
                j[column].extend(tangent.trace(name).sample(&s.times).iter().map(|t| t / s.noise));
            }
        }
        j.iter_mut().for_each(|column: &mut Vec<f64>| column.resize(count, 0.0));
        let finite = |v: &Vec<f64>| v.iter().all(|x| x.is_finite());
        (finite(&r) && j.iter().all(finite)).then_some(Residuals { r, j })
    }

    /// Residuals of all pieces.
    pub fn all(&self, point: &Point) -> Option<Vec<Vec<f64>>> {
        (0..self.pieces.len()).into_par_iter().map(|piece| self.residuals(piece, point)).collect()
    }

    /// Residuals of all pieces with their slopes.
    pub fn slopes(&self, point: &Point) -> Option<Vec<Residuals>> {
        (0..self.pieces.len()).into_par_iter().map(|piece| self.look(piece, point, true)).collect()
    }
}

/// Scalar product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
