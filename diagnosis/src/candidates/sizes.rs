//! Typical sizes at a place, and the values of an effect's parameters that are tried and allowed.

use mops_core::{
    Effect,
    effect::{Dimension, EffectParameter, InitialGrid, ParameterKind},
};
use mops_math as math;

use crate::records::{Gap, quantum};
use crate::settings::Coverage;

/// Shortest time constant, samples. Basis: after ten of them, at the next sample, 5e-5 of the change is left.
const FASTEST: f64 = 0.1;

/// Multiple of the largest value tried that a shape may have, and widths beyond a range. Basis: an assumption.
const FARTHEST: f64 = 10.0;

/// Frequencies tried from one number of periods in the record to the next. Basis: each frequency is at most a third of
/// a period from one of them, where `sinc(1/3)^2`, 68 % of the power, is left.
const PER_PERIOD: f64 = 1.5;

/// Most periods in a record. Basis: an assumption.
const MOST_PERIODS: f64 = 160.0;

/// Steps of a quantised sensor up to the largest value of which all sizes are tried. Basis: an assumption.
const MOST_STEPS: u32 = 24;

/// Finest steps that samples show, noises. Basis: the mean cosine is `exp(-2 pi^2 / 5^2)`, 0.45, the least from which
/// values are multiples of a quantum.
const NOISES_PER_STEP: f64 = 5.0;

/// Sizes tried from one number of steps to the next.
const PER_STEP: u32 = 4;

/// What the trajectories show at a place: typical sizes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Of what an effect adds.
    pub output: f64,
    /// Rate of the state per unit of the added term, at the parameters for which the sizes were determined; 1 at inputs
    /// and sensors.
    pub mobility: f64,
    /// Of the position about its middle.
    pub position: f64,
    /// Of the speed.
    pub speed: f64,
    /// Of the value that passes.
    pub value: f64,
    /// Of the time in which it moves, s.
    pub time: f64,
    /// Smallest and largest position (at actuators and sensors: value).
    pub range: [f64; 2],
    /// Length of the longest record, s.
    pub record: f64,
    /// Time between samples, s.
    pub sample: f64,
    /// Size of the steps in which samples come, finer than those that are tried; `None` where they do not, or nobody
    /// looked.
    pub quantum: Option<f64>,
    /// A gap that samples show; `None` where they do not, or nobody looked.
    pub gap: Option<Gap>,
    /// Largest slew rate of a command; `None` elsewhere than at an actuator.
    pub slew: Option<f64>,
    /// Stiffness of the declared model at a joint, force by position; `None` elsewhere.
    pub stiffness: Option<f64>,
    /// Absolute temperature at the zero of the scale in which the state of a process is declared, in its unit; `None`
    /// on no scale.
    pub zero: Option<f64>,
    /// What the records must show.
    pub coverage: Coverage,
}

impl Sizes {
    /// Sizes of which nothing is known.
    pub const UNKNOWN: Self = Self {
        output: 1.0,
        mobility: 1.0,
        position: 1.0,
        speed: 1.0,
        value: 1.0,
        time: 1.0,
        range: [0.0; 2],
        record: 1.0,
        sample: 1.0,
        quantum: None,
        gap: None,
        slew: None,
        stiffness: None,
        zero: None,
        coverage: Coverage::DEFAULT,
    };

    /// The typical size of a strength.
    pub fn of(&self, dimension: Dimension) -> f64 {
        let power = |size: f64, n: i8| math::powi(size, n.into());
        power(self.output, dimension.output)
            * power(self.position, dimension.position)
            * power(self.speed, dimension.speed)
            * power(self.value, dimension.value)
            * power(self.time, dimension.time)
    }

    /// Smallest and largest value of a strength in a fit: those that physics allows. A shape that is tried at multiples
    /// of its typical size is besides no more than `farthest` times the largest of them, and one that is tried within a
    /// range is no more than so many widths beyond it: farther off it does nothing, or stands for something else, as a
    /// force stands for a constant one that would yield after a path much longer than the motion.
    pub fn bounds(&self, strength: &EffectParameter) -> [f64; 2] {
        let [low, high] = strength.bounds;
        let [least, most] = match (strength.null_value, strength.grid) {
            (None, InitialGrid::Scaled(multiples)) => {
                let largest = multiples.iter().copied().fold(0.0, f64::max) * self.of(strength.dimension);
                [f64::NEG_INFINITY, FARTHEST * largest]
            }
            (None, InitialGrid::Within(_)) => {
                let beyond = FARTHEST * (self.range[1] - self.range[0]);
                [self.range[0] - beyond, self.range[1] + beyond]
            }
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        };
        // Whether an edge is left again is seen in the motion that it bounds, not in the one without it.
        let is_edge = strength.kind.is_edge();
        let [covered_low, covered_high] =
            if is_edge { [f64::NEG_INFINITY, f64::INFINITY] } else { self.covered(strength) };
        let (least, most) = (least.max(covered_low), most.min(covered_high));
        if least.max(low) < most.min(high) { [least.max(low), most.min(high)] } else { strength.bounds }
    }

    /// Smallest and largest value that the records can show: enough periods of what repeats, an event of some samples
    /// that is not most of the record, a time constant that is not much less than a sample, a stop that is left again,
    /// a force that builds up within the motion: beyond, it is a spring.
    #[allow(clippy::cast_precision_loss)]
    fn covered(&self, parameter: &EffectParameter) -> [f64; 2] {
        let periods = |length: f64| std::f64::consts::TAU * self.coverage.periods / length.max(f64::MIN_POSITIVE);
        let within = |share: f64| self.range[0] + share * (self.range[1] - self.range[0]);
        match parameter.kind {
            ParameterKind::LowerEdge => [f64::NEG_INFINITY, within(1.0 - self.coverage.free)],
            ParameterKind::UpperEdge => [within(self.coverage.free), f64::INFINITY],
            ParameterKind::Damping => [f64::NEG_INFINITY, self.time],
            ParameterKind::WaveNumber => [periods(self.range[1] - self.range[0]), f64::INFINITY],
            ParameterKind::Frequency => [periods(self.record), f64::INFINITY],
            ParameterKind::Duration => [self.coverage.samples as f64 * self.sample, self.coverage.event * self.record],
            ParameterKind::BuildUp => {
                let is_displacement = parameter.dimension == Dimension::POSITION;
                let range = self.range[1] - self.range[0];
                let most = if is_displacement { self.coverage.build_up * range } else { f64::INFINITY };
                [FASTEST * self.sample / self.time * self.of(parameter.dimension), most]
            }
            // Of a store: at a joint a stop yields by its stiffness, however fast.
            ParameterKind::Steepness if self.stiffness.is_none() => {
                [f64::NEG_INFINITY, 1.0 / (FASTEST * self.sample * self.mobility)]
            }
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// Returns true if the records show a value of a parameter: it is not at an end of what they cover, beyond which
    /// the effect would be another one. A time that is shorter or longer than they show is still a time.
    pub fn shows(&self, parameter: &EffectParameter, value: f64) -> bool {
        let [low, high] = self.covered(parameter);
        let is_time = matches!(parameter.kind, ParameterKind::Steepness | ParameterKind::Duration);
        is_time || (value > low || parameter.kind == ParameterKind::BuildUp) && value < high
    }

    /// The values of a strength that are tried.
    #[allow(clippy::cast_precision_loss)]
    pub fn values(&self, dimension: Dimension, trials: InitialGrid, bounds: [f64; 2]) -> Vec<f64> {
        let scaled = |multiples: &'static [f64]| multiples.iter().map(|m| m * self.of(dimension));
        let values: Vec<f64> = match trials {
            InitialGrid::Linear => vec![self.of(dimension).clamp(bounds[0], bounds[1])],
            InitialGrid::Scaled(multiples) => scaled(multiples).collect(),
            InitialGrid::PlainAndScaled(values, multiples) => values.iter().copied().chain(scaled(multiples)).collect(),
            InitialGrid::Within(shares) => {
                shares.iter().map(|s| self.range[0] + s * (self.range[1] - self.range[0])).collect()
            }
            InitialGrid::WithinAndGap(shares) => {
                let within = self.values(dimension, InitialGrid::Within(shares), bounds);
                within.into_iter().chain(self.gap.map(|gap| gap.middle)).collect()
            }
            InitialGrid::ScaledAndGap(multiples) => {
                scaled(multiples).chain(self.gap.map(|gap| gap.half_width)).collect()
            }
            InitialGrid::SlewAndScaled(shares, multiples) => {
                let slew = self.slew;
                shares.iter().filter_map(|s| Some(s * slew?)).chain(scaled(multiples)).collect()
            }
            InitialGrid::WithinSize(shares) => {
                let crosses = self.range[0] < 0.0 && self.range[1] > 0.0;
                let least = if crosses { 0.0 } else { self.range[0].abs().min(self.range[1].abs()) };
                shares.iter().map(|s| least + s * (self.largest() - least)).collect()
            }
            InitialGrid::Plain(values) | InitialGrid::Jumps(values) => values.to_vec(),
            InitialGrid::Zeros(values) => self.zero.map_or_else(|| values.to_vec(), |zero| vec![zero]),
            InitialGrid::Frequencies(share) => {
                let step = std::f64::consts::TAU / (PER_PERIOD * self.record);
                let highest = self.highest_frequency();
                let next = |w: &f64| Some(w + step.max(share * w));
                std::iter::successors(Some(step), next).take_while(|&w| w <= highest).collect()
            }
            InitialGrid::Steps => {
                let numbers = 1..=PER_STEP * (MOST_STEPS - 1);
                let sizes = numbers.map(|n| self.largest() / (1.0 + f64::from(n - 1) / f64::from(PER_STEP)));
                sizes.chain(self.quantum).collect()
            }
            InitialGrid::Moments(shares) => shares.iter().map(|s| s * self.record).collect(),
        };
        let inside = |v: &f64| v.is_finite() && *v >= bounds[0] && *v <= bounds[1];
        values.into_iter().filter(inside).collect()
    }

    /// The highest frequency that is tried: four samples or a share of the record in a period, rad/s.
    pub fn highest_frequency(&self) -> f64 {
        (0.5 * std::f64::consts::PI / self.sample).min(std::f64::consts::TAU * MOST_PERIODS / self.record)
    }

    /// The typical size of a lag or delay: a tenth of the time in which the place moves, or ten samples if that is
    /// more, s.
    pub fn lag(&self) -> f64 {
        (0.1 * self.time).max(10.0 * self.sample)
    }

    /// Returns the size of finer steps, if samples show them.
    pub fn quantum_of(&self, samples: &[f64], noise: f64) -> Option<f64> {
        quantum(samples, NOISES_PER_STEP * noise, self.largest() / f64::from(MOST_STEPS))
    }

    fn largest(&self) -> f64 {
        self.range[0].abs().max(self.range[1].abs())
    }

    /// How far the next smaller size of steps that is tried is from one.
    pub fn gap_to_next_size(&self, size: f64) -> f64 {
        size * size / (f64::from(PER_STEP) * self.largest())
    }

    /// All combinations of the values tried of an effect's strengths.
    pub fn combinations(&self, effect: &dyn Effect) -> Vec<Vec<f64>> {
        effect.parameters().iter().fold(vec![Vec::new()], |all, strength| {
            let values = self.values(strength.dimension, strength.grid, self.bounds(strength));
            all.iter().flat_map(|start| values.iter().map(move |&v| [start.as_slice(), &[v]].concat())).collect()
        })
    }
}
