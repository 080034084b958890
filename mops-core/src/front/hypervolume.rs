//! Hypervolume of a front.

use super::sort::{compare, non_dominated};

/// Returns the hypervolume between the points and `reference`. Points that are not better than `reference` in every
/// objective do not count.
///
/// Two objectives: a sweep. Three: a sweep along the third with the staircase of the other two. More: the exclusive
/// volumes of one point after the other (WFG).
///
/// Source: C. M. Fonseca, L. Paquete, M. Lopez-Ibanez, IEEE CEC (2006) 1157-1163 (dimension sweep); L. While, L.
/// Bradstreet, L. Barone, IEEE Transactions on Evolutionary Computation 16 (2012) 86-95 (WFG).
pub fn hypervolume(objectives: &[f64], reference: &[f64]) -> f64 {
    let m = reference.len();
    let inside = objectives.chunks_exact(m.max(1)).filter(|point| point.iter().zip(reference).all(|(f, r)| f < r));
    let mut points: Vec<Vec<f64>> = inside.map(<[f64]>::to_vec).collect();
    match m {
        0 => 0.0,
        1 => points.iter().map(|point| reference[0] - point[0]).fold(0.0, f64::max),
        2 => area(&mut points, reference),
        3 => volume(&mut points, reference),
        _ => exclusive(points, reference),
    }
}

fn area(points: &mut [Vec<f64>], reference: &[f64]) -> f64 {
    points.sort_unstable_by(|a, b| compare(a, b));
    let (mut sum, mut ceiling) = (0.0, reference[1]);
    for point in points {
        if point[1] < ceiling {
            sum += (reference[0] - point[0]) * (ceiling - point[1]);
            ceiling = point[1];
        }
    }
    sum
}

/// Sweeps along the third objective; each point adds its exclusive area to the staircase.
fn volume(points: &mut [Vec<f64>], reference: &[f64]) -> f64 {
    points.sort_unstable_by(|a, b| a[2].total_cmp(&b[2]));
    // Steps of the staircase: the first objective increases, the second decreases.
    let mut stairs: Vec<[f64; 2]> = Vec::with_capacity(points.len());
    let (mut sum, mut area, mut floor) = (0.0, 0.0, f64::NAN);
    for point in points {
        let [x, y, z] = [point[0], point[1], point[2]];
        if area > 0.0 {
            sum += area * (z - floor);
        }
        floor = z;
        let from = stairs.partition_point(|step| step[0] < x);
        if from > 0 && stairs[from - 1][1] <= y || stairs.get(from).is_some_and(|step| step[0] == x && step[1] <= y) {
            continue;
        }
        // The new step covers subsequent ones that are not lower.
        let to = from + stairs[from..].partition_point(|step| step[1] >= y);
        let mut ceiling = if from > 0 { stairs[from - 1][1] } else { reference[1] };
        let mut left = x;
        for step in &stairs[from..to] {
            area += (step[0] - left) * (ceiling - y);
            (left, ceiling) = (step[0], step[1]);
        }
        let right = stairs.get(to).map_or(reference[0], |step| step[0]);
        area += (right - left) * (ceiling - y);
        stairs.splice(from..to, [[x, y]]);
    }
    if area > 0.0 { sum + area * (reference[2] - floor) } else { sum }
}

fn exclusive(mut points: Vec<Vec<f64>>, reference: &[f64]) -> f64 {
    // Points are ordered from the worst in the last objective, so that the limited sets become small.
    points.sort_unstable_by(|a, b| b[b.len() - 1].total_cmp(&a[a.len() - 1]).then(compare(a, b)));
    let m = reference.len();
    let mut sum = 0.0;
    for (i, point) in points.iter().enumerate() {
        let alone: f64 = point.iter().zip(reference).map(|(f, r)| r - f).product();
        let limited: Vec<f64> =
            points[i + 1..].iter().flat_map(|other| other.iter().zip(point).map(|(a, b)| a.max(*b))).collect();
        let kept = non_dominated(&limited, m);
        let limited: Vec<Vec<f64>> = kept.iter().map(|&i| limited[i * m..(i + 1) * m].to_vec()).collect();
        sum += alone - if limited.is_empty() { 0.0 } else { exclusive(limited, reference) };
    }
    sum
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;

    /// Returns the hypervolume by inclusion and exclusion over all subsets.
    fn by_subsets(points: &[Vec<f64>], reference: &[f64]) -> f64 {
        let mut sum = 0.0;
        for subset in 1_u32..1 << points.len() {
            let corner = |k: usize| {
                let of = |(i, point): (usize, &Vec<f64>)| (subset >> i & 1 == 1).then(|| point[k]);
                points.iter().enumerate().filter_map(of).fold(f64::NEG_INFINITY, f64::max)
            };
            let part: f64 = (0..reference.len()).map(|k| (reference[k] - corner(k)).max(0.0)).product();
            sum += if subset.count_ones() % 2 == 1 { part } else { -part };
        }
        sum
    }

    #[test]
    fn the_volume_is_that_of_the_union_of_boxes() {
        let mut random = mops_math::stream(1, "hypervolume");
        for m in 1..=5 {
            for count in [1, 2, 5, 9] {
                for coarse in [4.0, 1e9] {
                    let mut draw = || (random.random::<f64>() * 1.1 * coarse).floor() / coarse;
                    let points: Vec<Vec<f64>> = (0..count).map(|_| (0..m).map(|_| draw()).collect()).collect();
                    let reference = vec![1.0; m];
                    let expected = by_subsets(&points, &reference);
                    let found = hypervolume(&points.concat(), &reference);
                    assert!((found - expected).abs() < 1e-12, "{m} {count}: {found} {expected}");
                }
            }
        }
    }
}
