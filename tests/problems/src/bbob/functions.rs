//! The 24 functions, relative to their minimum.
//!
//! `z` is the transformed point, `R` and `Q` are rotations, `i` counts from 0 and `s_i = i / (n - 1)`.

use std::f64::consts::PI;

use mops_language::Scalar;
use mops_math as math;

use super::Instance;
use super::transform::{asymmetric, conditioned, oscillated, outside, rotated, rounded, share, shifted, sum, wavy};

#[allow(clippy::cast_precision_loss)]
fn size<S>(x: &[S]) -> f64 {
    x.len() as f64
}

/// `sum 10^(6 s_i) z_i^2`.
fn ellipsoid<S: Scalar>(z: &[S]) -> S {
    let n = z.len();
    sum(z.iter().enumerate().map(|(i, z)| *z * *z * math::powf(1e6_f64, share(i, n))))
}

/// `10 (n - sum cos(2 pi z_i)) + |z|^2`.
fn rastrigin<S: Scalar>(z: &[S]) -> S {
    sum(z.iter().map(|z| -(*z * (2.0 * PI)).cos() * 10.0 + *z * *z + 10.0))
}

/// `sum 100 (z_i^2 - z_(i+1))^2 + (z_i - 1)^2`.
fn rosenbrock_terms<S: Scalar>(z: &[S]) -> impl Iterator<Item = S> {
    z.windows(2).map(|z| {
        let (valley, slope) = (z[0] * z[0] - z[1], z[0] - 1.0);
        valley * valley * 100.0 + slope * slope
    })
}

/// `max(1, sqrt(n) / 8)`.
fn stretch<S>(x: &[S]) -> f64 {
    (size(x).sqrt() / 8.0).max(1.0)
}

impl Instance {
    /// `R Lambda^alpha Q (x - x_opt)`.
    fn turned_twice<S: Scalar>(&self, x: &[S], alpha: f64) -> Vec<S> {
        let z = rotated(&self.q, &shifted(x, &self.optimum));
        rotated(&self.r, &conditioned(&z, alpha))
    }

    /// `R (x - x_opt)`.
    fn turned<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        rotated(&self.r, &shifted(x, &self.optimum))
    }

    /// Returns the value of the function above its minimum.
    pub(crate) fn height<S: Scalar>(&self, x: &[S]) -> S {
        match self.function {
            1 => sum(shifted(x, &self.optimum).into_iter().map(|z| z * z)),
            2 => ellipsoid(&oscillated(&shifted(x, &self.optimum))),
            3 => rastrigin(&conditioned(&asymmetric(&oscillated(&shifted(x, &self.optimum)), 0.2), 10.0)),
            4 => self.bueche_rastrigin(x),
            5 => self.linear_slope(x),
            6 => self.attractive_sector(x),
            7 => self.step_ellipsoid(x),
            8 => {
                let near: Vec<f64> = self.optimum.iter().map(|o| 0.75 * o).collect();
                let z: Vec<S> = shifted(x, &near).into_iter().map(|z| z * stretch(x) + 1.0).collect();
                sum(rosenbrock_terms(&z))
            }
            9 => sum(rosenbrock_terms(&self.turned_about_half(x))),
            10 => ellipsoid(&oscillated(&self.turned(x))),
            11 => {
                let z = oscillated(&self.turned(x));
                z[0] * z[0] * 1e6 + sum(z[1..].iter().map(|z| *z * *z))
            }
            12 => {
                let z = rotated(&self.r, &asymmetric(&self.turned(x), 0.5));
                z[0] * z[0] + sum(z[1..].iter().map(|z| *z * *z)) * 1e6
            }
            13 => {
                let z = self.turned_twice(x, 10.0);
                let across = sum(z[1..].iter().map(|z| *z * *z));
                z[0] * z[0] + if across.value() > 0.0 { across.sqrt() * 100.0 } else { across }
            }
            14 => {
                let power = |(i, z): (usize, &S)| z.abs().powf(2.0 + 4.0 * share(i, x.len()));
                sum(self.turned(x).iter().enumerate().map(power)).powf(0.5)
            }
            15 => {
                let z = asymmetric(&oscillated(&self.turned(x)), 0.2);
                rastrigin(&rotated(&self.r, &conditioned(&rotated(&self.q, &z), 10.0)))
            }
            16 => self.weierstrass(x),
            17 => self.schaffer(x, 10.0),
            18 => self.schaffer(x, 1000.0),
            19 => {
                let terms =
                    rosenbrock_terms(&self.turned_about_half(x)).map(|t| t / 4000.0 - t.cos()).collect::<Vec<S>>();
                sum(terms.into_iter()) * (10.0 / (size(x) - 1.0)) + 10.0
            }
            20 => self.schwefel(x),
            21 | 22 => self.gallagher(x),
            23 => self.katsuura(x),
            _ => self.lunacek(x),
        }
    }

    /// `max(1, sqrt(n) / 8) Q x + 1/2`.
    fn turned_about_half<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        rotated(&self.q, x).into_iter().map(|z| z * stretch(x) + 0.5).collect()
    }

    fn bueche_rastrigin<S: Scalar>(&self, x: &[S]) -> S {
        let z = oscillated(&shifted(x, &self.optimum));
        let scale = |(i, z): (usize, &S)| {
            let steep = if z.value() > 0.0 && i % 2 == 0 { 10.0 } else { 1.0 };
            *z * (steep * math::powf(10.0, 0.5 * share(i, x.len())))
        };
        let z: Vec<S> = z.iter().enumerate().map(scale).collect();
        rastrigin(&z) + outside(x) * 100.0
    }

    fn linear_slope<S: Scalar>(&self, x: &[S]) -> S {
        let of = |(i, (x, o)): (usize, (&S, &f64))| {
            let slope = math::powf(10.0, share(i, self.optimum.len())).copysign(*o);
            -*x * slope + 5.0 * slope.abs()
        };
        sum(x.iter().zip(&self.optimum).enumerate().map(of))
    }

    fn attractive_sector<S: Scalar>(&self, x: &[S]) -> S {
        let z = self.turned_twice(x, 10.0);
        let steep = |(z, o): (&S, &f64)| if z.value() * o > 0.0 { *z * *z * 1e4 } else { *z * *z };
        wavy(sum(z.iter().zip(&self.optimum).map(steep))).powf(0.9)
    }

    fn step_ellipsoid<S: Scalar>(&self, x: &[S]) -> S {
        let z = conditioned(&rotated(&self.q, &shifted(x, &self.optimum)), 10.0);
        let step = |z: &S| if z.value().abs() > 0.5 { rounded(*z) } else { rounded(*z * 10.0) / 10.0 };
        let steps: Vec<S> = z.iter().map(step).collect();
        let turned = rotated(&self.r, &steps);
        let inner = sum(turned.iter().enumerate().map(|(i, z)| *z * *z * math::powf(100.0, share(i, x.len()))));
        let slope = z[0].abs() * 1e-4;
        (if slope.value() > inner.value() { slope } else { inner }) * 0.1 + outside(x)
    }

    fn weierstrass<S: Scalar>(&self, x: &[S]) -> S {
        let z = rotated(&self.q, &oscillated(&self.turned(x)));
        let z = rotated(&self.r, &conditioned(&z, 1e-2));
        let waves =
            |z: S| sum((0..12).map(|k| ((z + 0.5) * (2.0 * PI * math::powi(3.0, k))).cos() * math::powi(0.5, k)));
        let least: f64 = (0..12).map(|k| math::powi(0.5, k) * math::cos(PI * math::powi(3.0, k))).sum();
        let above = sum(z.into_iter().map(waves)) / size(x) - least;
        above * above * above * 10.0 + outside(x) * (10.0 / size(x))
    }

    fn schaffer<S: Scalar>(&self, x: &[S], alpha: f64) -> S {
        let z = conditioned(&rotated(&self.q, &asymmetric(&self.turned(x), 0.5)), alpha);
        let of = |z: &[S]| {
            let s = z[0] * z[0] + z[1] * z[1];
            if s.value() == 0.0 {
                return s;
            }
            let wave = (s.powf(0.1) * 50.0).sin();
            s.powf(0.25) * (wave * wave + 1.0)
        };
        let mean = sum(z.windows(2).map(of)) / (size(x) - 1.0);
        mean * mean + outside(x) * 10.0
    }

    fn schwefel<S: Scalar>(&self, x: &[S]) -> S {
        let twice: Vec<f64> = self.optimum.iter().map(|o| 2.0 * o.abs()).collect();
        let flipped: Vec<S> = x.iter().zip(&self.optimum).map(|(x, o)| *x * (2.0 * o.signum())).collect();
        let chained = |i: usize| if i == 0 { flipped[0] } else { flipped[i] + (flipped[i - 1] - twice[i - 1]) * 0.25 };
        let z: Vec<S> = (0..x.len()).map(|i| chained(i) - twice[i]).collect();
        let z = conditioned(&z, 10.0);
        let z: Vec<S> = z.iter().zip(&twice).map(|(z, t)| (*z + *t) * 100.0).collect();
        let wave = |z: &S| if z.value() == 0.0 { *z } else { *z * z.abs().sqrt().sin() };
        let beyond = sum(z.iter().map(|z| z.abs() - 500.0).filter(|d| d.value() > 0.0).map(|d| d * d));
        (beyond + 418.982_887_272_433_9 - sum(z.iter().map(wave)) / size(x)) * 0.01
    }

    fn gallagher<S: Scalar>(&self, x: &[S]) -> S {
        let z = rotated(&self.q, x);
        let height = |peak: &super::Peak| {
            let square = |((z, at), scale): ((&S, &f64), &f64)| (*z - *at) * (*z - *at) * *scale;
            (sum(z.iter().zip(&peak.at).zip(&peak.scales).map(square)) * (-0.5 / size(x))).exp() * peak.height
        };
        let highest = |a: S, b: S| if b.value() > a.value() { b } else { a };
        let below = -self.peaks.iter().map(height).fold(S::from(0.0), highest) + 10.0;
        let w = wavy(below);
        w * w + outside(x)
    }

    fn katsuura<S: Scalar>(&self, x: &[S]) -> S {
        let z = self.turned_twice(x, 100.0);
        let n = size(x);
        let rough = |z: S| {
            sum((1..33).map(|j| (z * math::powi(2.0, j) - rounded(z * math::powi(2.0, j))).abs() / math::powi(2.0, j)))
        };
        #[allow(clippy::cast_precision_loss)]
        let factor = |(i, z): (usize, &S)| rough(*z) * (i as f64 + 1.0) + 1.0;
        let product = z.iter().enumerate().map(factor).fold(S::from(1.0), |product, f| product * f);
        (product.powf(10.0 / math::powf(n, 1.2)) - 1.0) * (10.0 / (n * n)) + outside(x)
    }

    fn lunacek<S: Scalar>(&self, x: &[S]) -> S {
        let n = size(x);
        let (near, spread) = (2.5, 1.0 - 0.5 / ((n + 20.0).sqrt() - 4.1));
        let far = -((near * near - 1.0) / spread).sqrt();
        let y: Vec<S> = x.iter().zip(&self.optimum).map(|(x, o)| *x * (2.0 * o.signum())).collect();
        let to = |centre: f64| sum(y.iter().map(|y| (*y - centre) * (*y - centre)));
        let (one, other) = (to(near), to(far) * spread + n);
        let bowl = if other.value() < one.value() { other } else { one };
        let centred: Vec<S> = y.iter().map(|y| *y - near).collect();
        let z = rotated(&self.r, &conditioned(&rotated(&self.q, &centred), 100.0));
        let waves = sum(z.iter().map(|z| -(*z * (2.0 * PI)).cos() + 1.0));
        bowl + waves * 10.0 + outside(x) * 1e4
    }
}
