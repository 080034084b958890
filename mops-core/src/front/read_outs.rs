//! Summary of a front: its ranges and its knee.

/// Returns the smallest and the largest value of every objective.
pub fn ranges(objectives: &[f64], m: usize) -> Vec<[f64; 2]> {
    let range = |k: usize| {
        let column = || objectives.iter().skip(k).step_by(m);
        [column().copied().fold(f64::INFINITY, f64::min), column().copied().fold(f64::NEG_INFINITY, f64::max)]
    };
    (0..m).map(range).collect()
}

/// Returns the objectives normalised to 0 at the smallest and 1 at the largest value; 0 if these are equal.
pub fn normalised(objectives: &[f64], ranges: &[[f64; 2]]) -> Vec<f64> {
    let scale = |(f, [low, high]): (&f64, &[f64; 2])| if high > low { (f - low) / (high - low) } else { 0.0 };
    objectives.chunks_exact(ranges.len().max(1)).flat_map(|row| row.iter().zip(ranges).map(scale)).collect()
}

/// Returns the knee of the front, or `None` if no point lies on the side of the ideal point.
///
/// The knee is the point farthest from a plane, towards the ideal point. The plane passes through the points that are
/// best in one objective and worst in all others. Each objective is normalised by its range.
///
/// Source: I. Das, Structural Optimization 18 (1999) 107-115.
pub fn knee(objectives: &[f64], m: usize) -> Option<usize> {
    let unit = normalised(objectives, &ranges(objectives, m));
    // The plane is `sum = 1`.
    let bulge = |row: &[f64]| 1.0 - row.iter().sum::<f64>();
    let bulges: Vec<f64> = unit.chunks_exact(m.max(1)).map(bulge).collect();
    let farthest = (0..bulges.len()).max_by(|&a, &b| bulges[a].total_cmp(&bulges[b]).then(b.cmp(&a)))?;
    (m >= 2 && bulges[farthest] > 1e-6).then_some(farthest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    #[test]
    fn the_knee_of_a_hyperbola_is_its_corner() {
        // y = 1/x from 1/8 to 8, in units that differ by a factor of 1000.
        let points: Vec<f64> =
            (-30..=30).map(|i| math::powf(2.0, f64::from(i) / 10.0)).flat_map(|x| [x, 1000.0 / x]).collect();
        let knee = knee(&points, 2).unwrap();
        assert_eq!(points[2 * knee], 1.0);
    }

    #[test]
    fn a_concave_front_has_no_knee() {
        let arc = |i: u32| math::sin_cos(f64::from(i) / 20.0 * std::f64::consts::FRAC_PI_2);
        let points: Vec<f64> = (0..=20).map(arc).flat_map(|(s, c)| [s, c]).collect();
        assert_eq!(knee(&points, 2), None);
        assert_eq!(knee(&[], 2), None);
    }

    #[test]
    fn the_knee_of_three_objectives_is_nearest_to_the_ideal_point_along_the_diagonal() {
        let points = [0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.2, 0.2, 0.3, 0.1, 0.4, 0.5];
        assert_eq!(knee(&points, 3), Some(3));
    }
}
