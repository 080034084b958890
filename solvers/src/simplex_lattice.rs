//! Reference directions, spread evenly over the simplex (Das and Dennis).

/// Returns unit vectors through the simplex points whose coordinates are multiples of `1 / divisions`.
///
/// If there are fewer divisions than objectives, all points lie on the boundary. A second layer with one division less
/// then lies halfway to the centre.
#[allow(clippy::cast_precision_loss)]
pub fn reference_directions(m: usize, divisions: usize) -> Vec<Vec<f64>> {
    let mut points = simplex_lattice(m, divisions);
    if divisions < m && divisions > 1 {
        let inner = simplex_lattice(m, divisions - 1);
        points.extend(inner.into_iter().map(|p| p.into_iter().map(|x| 0.5 * x + 0.5 / m as f64).collect::<Vec<f64>>()));
    }
    for point in &mut points {
        let length = point.iter().map(|x| x * x).sum::<f64>().sqrt();
        point.iter_mut().for_each(|x| *x /= length);
    }
    points
}

/// Returns the largest number of divisions with at most `max_points` lattice points.
pub fn max_divisions(m: usize, max_points: usize) -> usize {
    if m <= 1 {
        return 1;
    }
    (1..max_points).rev().find(|&divisions| lattice_size(m, divisions) <= max_points).unwrap_or(1)
}

/// Returns the binomial coefficient `(divisions + m - 1)` over `(m - 1)`.
fn lattice_size(m: usize, divisions: usize) -> usize {
    (1..m).fold(1_usize, |count, k| count.saturating_mul(divisions + k) / k)
}

/// Returns all points of the simplex whose coordinates are multiples of `1 / divisions`.
#[allow(clippy::cast_precision_loss)]
pub fn simplex_lattice(m: usize, divisions: usize) -> Vec<Vec<f64>> {
    let mut points = Vec::new();
    let mut point = vec![0; m];
    compositions(&mut points, &mut point, 0, divisions);
    points.into_iter().map(|p| p.into_iter().map(|x| x as f64 / divisions as f64).collect()).collect()
}

/// Enumerates all distributions of `remaining` over the coordinates from `k` on.
fn compositions(points: &mut Vec<Vec<usize>>, point: &mut Vec<usize>, k: usize, remaining: usize) {
    if k + 1 == point.len() {
        point[k] = remaining;
        points.push(point.clone());
        return;
    }
    for share in 0..=remaining {
        point[k] = share;
        compositions(points, point, k + 1, remaining - share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_objectives_with_twelve_divisions_have_91_directions() {
        assert_eq!((max_divisions(3, 100), reference_directions(3, 12).len()), (12, 91));
        assert_eq!((max_divisions(2, 100), reference_directions(2, 99).len()), (99, 100));
        for direction in reference_directions(3, 12) {
            assert!((direction.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn many_objectives_have_directions_inside_the_simplex_too() {
        let directions = reference_directions(8, 3);
        assert_eq!(directions.len(), lattice_size(8, 3) + lattice_size(8, 2));
        assert!(directions.iter().any(|d| d.iter().all(|x| *x > 0.0)));
    }
}
