//! Plots of a linear system: Bode, Nyquist, root locus.

use mops_content::plot::{Color, Curve, CurveStyle, Level, Plot};
use mops_linear::{Complex, StateSpace, eigenvalues, zeros};
use mops_math as math;
use mops_math::complex;
use mops_report::{FrequencyCurve, bode, nyquist};

/// Draws the plots of a single-input, single-output system; returns the kind of each, and the plot or the reason why it
/// is missing.
pub(super) fn plots(system: &StateSpace, name: &str) -> Vec<(&'static str, Result<Plot, String>)> {
    let mut all = match of_frequencies(system, name) {
        Ok([magnitude, phase, nyquist]) => {
            vec![("bode-magnitude", Ok(magnitude)), ("bode-phase", Ok(phase)), ("nyquist", Ok(nyquist))]
        }
        Err(why) => ["bode-magnitude", "bode-phase", "nyquist"].map(|kind| (kind, Err(why.clone()))).into(),
    };
    all.push(("root-locus", root_locus(system, name)));
    all
}

fn of_frequencies(system: &StateSpace, name: &str) -> Result<[Plot; 3], String> {
    let response = FrequencyCurve::of(system)?;
    let [magnitude, phase] = bode(name, &[(Curve::default(), &response)]);
    Ok([magnitude, phase, nyquist(&response, None, name)])
}

/// Draws the poles of the closed loop `k G/(1 + k G)` for gains k from 0 upwards, with negative feedback; those of a
/// sampled system in z. A delay is ignored.
fn root_locus(system: &StateSpace, name: &str) -> Result<Plot, String> {
    let in_z = system.difference_equation();
    let is_sampled = in_z.is_some();
    let system = in_z.as_ref().unwrap_or(system);
    let (poles, zeros) = (eigenvalues(&system.a)?, zeros(system)?);
    let size = shown(poles.iter().chain(&zeros).map(|z| complex::norm(*z)).collect());
    let direct = system.d[(0, 0)];
    let closed = |k: f64| eigenvalues(&(&system.a - &system.b * &system.c * (k / (1.0 + k * direct))));
    let mut branches: Vec<Vec<Complex>> = poles.iter().map(|&pole| vec![pole]).collect();
    // The gain step is limited so that no pole moves by more than a small part of the picture.
    let (mut k, mut step) = (0.0, 1e-9);
    for _ in 0..6000 {
        let next = k + step;
        if next >= 1e15 || (1.0 + k * direct) * (1.0 + next * direct) <= 0.0 {
            break;
        }
        // Gains at which the eigenvalue iteration fails are skipped.
        let Ok(roots) = closed(next) else {
            k = next;
            continue;
        };
        let moved = matched(&branches, roots);
        let inside = |z: &Complex| complex::norm(*z) < 3.0 * size;
        let farthest = branches.iter().zip(&moved).map(|(b, z)| (b, complex::norm(z - b[b.len() - 1])));
        let farthest = farthest.filter(|(b, _)| inside(&b[b.len() - 1])).map(|(_, d)| d).fold(0.0, f64::max);
        if farthest > 0.02 * size && step > 1e-12 * (k + 1e-9) {
            step *= 0.5;
            continue;
        }
        branches.iter_mut().zip(&moved).for_each(|(branch, z)| branch.push(*z));
        k = next;
        if farthest < 0.005 * size {
            step *= 2.0;
        }
    }
    let limit = 2.0 * size;
    // The picture is wider than high: distant real parts are included.
    let width = if poles.iter().chain(&zeros).any(|z| complex::norm(*z) > size) { 3.0 * limit } else { limit };
    let point =
        |z: &Complex| if z.re.abs() <= width && z.im.abs() <= limit { (z.re, z.im) } else { (f64::NAN, f64::NAN) };
    let marks = |name: &str, of: &[Complex], style, color| Curve {
        name: match of.iter().filter(|z| !point(z).0.is_finite()).count() {
            _ if of.is_empty() => String::new(),
            0 => name.into(),
            far => format!("{name} ({far} outside the plot)"),
        },
        points: of.iter().map(point).collect(),
        style,
        color,
        ..Curve::default()
    };
    let lines = branches.iter().enumerate().map(|(i, branch)| Curve {
        name: if i == 0 { "closed loop".into() } else { String::new() },
        points: branch.iter().map(point).collect(),
        ..Curve::default()
    });
    let angles = (0..=200).map(|i| math::sin_cos(std::f64::consts::TAU * f64::from(i) / 200.0));
    let circle = is_sampled.then(|| Curve {
        name: "unit circle".into(),
        points: angles.map(|(sin, cos)| (cos, sin)).collect(),
        color: Color::Grid,
        ..Curve::default()
    });
    let unit = if is_sampled { "of z" } else { "(1/s)" };
    Ok(Plot {
        title: format!("root locus of {name}, negative feedback"),
        x_label: format!("real part {unit}"),
        y_label: format!("imaginary part {unit}"),
        curves: circle
            .into_iter()
            .chain(lines)
            .chain([
                marks("poles", &poles, CurveStyle::Crosses, Color::Demand),
                marks("zeros", &zeros, CurveStyle::Dots, Color::Measured),
            ])
            .collect(),
        equal: true,
        x_range: Some([0.0, 0.0]),
        verticals: vec![Level::default()],
        ..Plot::default()
    })
}

/// Returns half the height of the picture for poles and zeros at these distances from 0. If some lie ten times as far
/// out as at least two others, the picture covers the neighbourhood of the others.
fn shown(mut distances: Vec<f64>) -> f64 {
    distances.retain(|size| *size > 0.0);
    distances.sort_by(f64::total_cmp);
    let largest = distances.last().copied().unwrap_or(1.0);
    let near = distances
        .windows(2)
        .enumerate()
        .find(|(i, pair)| *i > 0 && pair[1] > 10.0 * pair[0] && pair[0] > 1e-6 * largest);
    near.map_or(largest, |(_, pair)| (pair[0] * largest).sqrt().min(5.0 * pair[0]))
}

/// Returns the roots in the order of the branches that they continue; the nearest pairs are matched first.
fn matched(branches: &[Vec<Complex>], roots: Vec<Complex>) -> Vec<Complex> {
    let n = branches.len();
    let end = |i: usize| branches[i][branches[i].len() - 1];
    let mut pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).collect();
    pairs.sort_by(|a, b| complex::norm(end(a.0) - roots[a.1]).total_cmp(&complex::norm(end(b.0) - roots[b.1])));
    let (mut of_branch, mut used) = (vec![None; n], vec![false; n]);
    for (i, j) in pairs {
        if of_branch[i].is_none() && !used[j] {
            of_branch[i] = Some(roots[j]);
            used[j] = true;
        }
    }
    of_branch.into_iter().map(|root| root.expect("as many roots as branches")).collect()
}
