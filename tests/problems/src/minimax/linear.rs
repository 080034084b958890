//! Min-max problems with linear constraints.

use mops_language::Scalar;
use mops_math as math;

use super::penalties::{WONG2, WONG3};
use crate::arithmetic::{dot, penalised, sinh, sq, sum};
use crate::formula::Functions;
use crate::hock_schittkowski::common::{hs113, wong2_constraints, wong3};
use crate::problem::{Problem, Sense};

const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

pub(super) fn problems() -> Vec<Problem> {
    let mut all = small();
    all.push(Problem {
        bounds: vec![[1e-8, f64::INFINITY]; 8],
        reach: 1.0,
        equalities: 1,
        ..Problem::new("EQUIL", &[0.125; 8], 0.0, Functions::of(equil, equil))
    });
    all.extend(wide());
    all.extend(super::dembo::problems());
    all
}

fn small() -> Vec<Problem> {
    let above = [0.01, f64::INFINITY];
    vec![
        Problem { inequalities: 1, ..Problem::new("MAD1", &[1.0, 2.0], -0.38965952, Functions::of(mad1, mad1)) },
        Problem { inequalities: 1, ..Problem::new("MAD2", &[-2.0, -1.0], -0.33035714, Functions::of(mad2, mad2)) },
        Problem {
            inequalities: 1,
            bounds: vec![FREE, above],
            ..Problem::new("MAD4", &[-1.0, 0.01], -0.44891079, Functions::of(mad4, mad4))
        },
        Problem {
            inequalities: 1,
            bounds: vec![FREE, above],
            ..Problem::new("MAD5", &[-1.0, 3.0], -0.42928061, Functions::of(mad5, mad5))
        },
        Problem {
            inequalities: 15,
            ..Problem::new("PENTAGON", &PENTAGON, -1.8596187, Functions::of(pentagon, pentagon))
        },
        Problem {
            sense: Sense::MaxAbs,
            bounds: vec![[0.4, f64::INFINITY], FREE, FREE, FREE, FREE, FREE, [3.5, 3.5]],
            inequalities: 6,
            equalities: 1,
            ..Problem::new("MAD6", &[0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5], 0.10183089, Functions::of(mad6, mad6))
        },
    ]
}

fn wide() -> Vec<Problem> {
    let positive = |lower: f64, count: usize| vec![[lower, f64::INFINITY]; count];
    vec![
        Problem { inequalities: 3, ..Problem::new("Wong2L", &WONG2, 24.30620907, Functions::of(wong2, wong2)) },
        Problem {
            inequalities: 4,
            ..Problem::new("Wong3L", &WONG3, 133.7282762, Functions::of(linear_wong3, linear_wong3))
        },
        Problem {
            sense: Sense::MaxAbs,
            bounds: [positive(0.5, 10), vec![FREE; 10]].concat(),
            ..Problem::new("MAD8", &[100.0; 20], 0.50694799, Functions::of(mad8, mad8))
        },
        Problem {
            bounds: [positive(0.0, 8), vec![FREE]].concat(),
            reach: 0.2,
            inequalities: 4,
            ..Problem::new("BPfilter", &BPFILTER, 2.760772369e-4, Functions::of(bpfilter, bpfilter))
        },
    ]
}

fn bowl<S: Scalar>(x: &[S]) -> [S; 3] {
    [sq(x[0]) + sq(x[1]) + x[0] * x[1] - 1.0, x[0].sin(), -x[1].cos()]
}

fn mad1<S: Scalar>(x: &[S]) -> Vec<S> {
    [bowl(x).to_vec(), vec![-x[0] - x[1] + 0.5]].concat()
}

fn mad2<S: Scalar>(x: &[S]) -> Vec<S> {
    [bowl(x).to_vec(), vec![x[0] * 3.0 + x[1] + 2.5]].concat()
}

fn slope<S: Scalar>(x: &[S]) -> [S; 3] {
    [-(x[0] - x[1]).exp(), sinh(x[0] - 1.0) - 1.0, -x[1].ln() - 1.0]
}

fn mad4<S: Scalar>(x: &[S]) -> Vec<S> {
    [slope(x).to_vec(), vec![x[0] * -0.05 + x[1] - 0.5]].concat()
}

fn mad5<S: Scalar>(x: &[S]) -> Vec<S> {
    [slope(x).to_vec(), vec![x[0] * 0.9 - x[1] + 1.0]].concat()
}

/// N.B.: the initial guess of the report's program is infeasible; the last coordinate is 0 here instead of 1.
const PENTAGON: [f64; 6] = [-1.0, 0.0, 0.0, -1.0, 1.0, 0.0];

/// Three points in a pentagon, as far apart as possible.
fn pentagon<S: Scalar>(x: &[S]) -> Vec<S> {
    let distance = |i: usize, j: usize| -(sq(x[i] - x[j]) + sq(x[i + 1] - x[j + 1])).sqrt();
    let mut rows = vec![distance(0, 2), distance(2, 4), distance(4, 0)];
    for point in [0, 2, 4] {
        for side in 0..5 {
            let (sin, cos) = math::sin_cos(std::f64::consts::TAU * f64::from(side) / 5.0);
            rows.push(x[point] * sin + x[point + 1] * cos - 1.0);
        }
    }
    rows
}

/// Side lobes of an antenna of 15 elements at the positions x.
fn mad6<S: Scalar>(x: &[S]) -> Vec<S> {
    let lobe = |i: u32| {
        let angle = std::f64::consts::TAU * math::sin((8.5 + 0.5 * f64::from(i)).to_radians());
        (sum(x.iter().map(|&x| (x * angle).cos())) * 2.0 + 1.0) / 15.0
    };
    let mut rows: Vec<S> = (1..=163).map(lobe).collect();
    rows.extend(x.windows(2).map(|pair| pair[0] - pair[1] + 0.4));
    rows.push(x[5] - x[3] - 1.0);
    rows
}

/// Excess demand for eight goods in an exchange economy of five traders with constant elasticity of substitution.
fn equil<S: Scalar>(x: &[S]) -> Vec<S> {
    const TASTE: [[f64; 8]; 5] = [
        [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
        [2.0, 0.8, 1.0, 0.5, 1.0, 1.0, 1.0, 1.0],
        [1.0, 1.2, 0.8, 1.2, 1.6, 2.0, 0.6, 0.1],
        [2.0, 0.1, 0.6, 2.0, 1.0, 1.0, 1.0, 2.0],
        [1.2, 1.2, 0.8, 1.0, 1.2, 0.1, 3.0, 4.0],
    ];
    const OWNED: [[f64; 8]; 5] = [
        [3.0, 1.0, 0.1, 0.1, 5.0, 0.1, 0.1, 6.0],
        [0.1, 10.0, 0.1, 0.1, 5.0, 0.1, 0.1, 0.1],
        [0.1, 9.0, 10.0, 0.1, 4.0, 0.1, 7.0, 0.1],
        [0.1, 0.1, 0.1, 10.0, 0.1, 3.0, 0.1, 0.1],
        [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 11.0],
    ];
    const ELASTICITY: [f64; 5] = [0.5, 1.2, 0.8, 2.0, 1.5];
    let mut excess = vec![S::from(0.0); 8];
    for ((taste, owned), b) in TASTE.iter().zip(&OWNED).zip(ELASTICITY) {
        let wealth = dot(owned, x);
        let price = sum(x.iter().zip(taste).map(|(&x, &a)| x.powf(1.0 - b) * a));
        for i in 0..8 {
            excess[i] += wealth * taste[i] / (x[i].powf(b) * price) - owned[i];
        }
    }
    excess.push(sum(x.iter().copied()) - 1.0);
    excess
}

fn wong2<S: Scalar>(x: &[S]) -> Vec<S> {
    let [curved, linear] = wong2_constraints(x);
    [penalised(10.0, &[vec![hs113(x)[0]], curved].concat()), linear].concat()
}

fn linear_wong3<S: Scalar>(x: &[S]) -> Vec<S> {
    let (f, [curved, linear]) = wong3(x);
    [penalised(10.0, &[vec![f], curved].concat()), linear].concat()
}

fn mad8<S: Scalar>(x: &[S]) -> Vec<S> {
    let total = sum(x.iter().copied()) - 1.0;
    let (first, last) = (x[0], x[19]);
    let mut rows = vec![total + first * (first * 2.0 - 1.0)];
    for &x in &x[1..19] {
        rows.extend([total + x * (x - 1.0), total + x * (x * 2.0 - 1.0)]);
    }
    rows.push(total + last * (last - 1.0));
    rows
}

const BPFILTER: [f64; 9] = [0.0398, 9.68e-5, 1.03e-4, 0.0389, 1.01, 0.968, 1.03, 0.988, -11.6];

/// Attenuation of a band-pass filter of four resonators: flat in the pass band, high at two neighbouring frequencies.
#[allow(clippy::cast_precision_loss)]
fn bpfilter<S: Scalar>(x: &[S]) -> Vec<S> {
    let attenuation = |frequency: f64| {
        let w = frequency * frequency;
        let section = |i: usize| (sq(sq(x[i + 4]) - w) + sq(x[i]) * w).ln();
        (sum((0..4).map(section)) - 8.0 * math::ln(frequency)) * 0.5 - x[8]
    };
    let band: Vec<S> = (0..61).map(|i| attenuation(0.987423 + 0.025154 * f64::from(i) / 60.0)).collect();
    let mut rows = vec![attenuation(0.96732) + 3.0164, attenuation(1.03268) + 3.0164];
    rows.extend(band.iter().flat_map(|&y| [y, -y]));
    rows.extend((0..4).map(|i| x[i] * -1e4 + x[i + 4]));
    rows
}
