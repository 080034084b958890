//! Reference directions, spread evenly over the simplex.

/// Unit vectors through the points of the simplex whose coordinates are multiples of `1 / divisions`. Where there are fewer
/// divisions than objectives, so that all lie on the edge, a second layer of one division less lies halfway to the centre.
#[allow(clippy::cast_precision_loss)]
pub fn spread(m: usize, divisions: usize) -> Vec<Vec<f64>> {
    let mut points = simplex(m, divisions);
    if divisions < m && divisions > 1 {
        let inner = simplex(m, divisions - 1);
        points.extend(inner.into_iter().map(|p| p.into_iter().map(|x| 0.5 * x + 0.5 / m as f64).collect::<Vec<f64>>()));
    }
    for point in &mut points {
        let length = point.iter().map(|x| x * x).sum::<f64>().sqrt();
        point.iter_mut().for_each(|x| *x /= length);
    }
    points
}

/// The largest number of divisions that gives at most `most` directions.
pub fn divisions_for(m: usize, most: usize) -> usize {
    if m <= 1 {
        return 1;
    }
    (1..most).rev().find(|&divisions| count(m, divisions) <= most).unwrap_or(1)
}

/// `(divisions + m - 1)` over `(m - 1)`.
fn count(m: usize, divisions: usize) -> usize {
    (1..m).fold(1_usize, |count, k| count.saturating_mul(divisions + k) / k)
}

/// All points of the simplex whose coordinates are multiples of `1 / divisions`.
#[allow(clippy::cast_precision_loss)]
pub fn simplex(m: usize, divisions: usize) -> Vec<Vec<f64>> {
    let mut points = Vec::new();
    let mut point = vec![0; m];
    place(&mut points, &mut point, 0, divisions);
    points.into_iter().map(|p| p.into_iter().map(|x| x as f64 / divisions as f64).collect()).collect()
}

/// All ways to share `left` among the coordinates from `k` on.
fn place(points: &mut Vec<Vec<usize>>, point: &mut Vec<usize>, k: usize, left: usize) {
    if k + 1 == point.len() {
        point[k] = left;
        points.push(point.clone());
        return;
    }
    for here in 0..=left {
        point[k] = here;
        place(points, point, k + 1, left - here);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_objectives_with_twelve_divisions_have_91_directions() {
        assert_eq!((divisions_for(3, 100), spread(3, 12).len()), (12, 91));
        assert_eq!((divisions_for(2, 100), spread(2, 99).len()), (99, 100));
        for direction in spread(3, 12) {
            assert!((direction.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn many_objectives_have_directions_inside_the_simplex_too() {
        let directions = spread(8, 3);
        assert_eq!(directions.len(), count(8, 3) + count(8, 2));
        assert!(directions.iter().any(|d| d.iter().all(|x| *x > 0.0)));
    }
}
