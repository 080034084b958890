//! Contour lines on a grid.

use crate::plot::Surface;

/// Returns the segments of the contour line at `level`, in grid coordinates: column `c` and row `r` are at `(c, r)`.
/// Squares with a non-finite height are omitted.
///
/// Source: W. E. Lorensen, H. E. Cline, ACM SIGGRAPH Computer Graphics 21 (1987) 163-169, in two dimensions. The mean
/// of the corners resolves a saddle.
pub fn contour(heights: &[Vec<f64>], level: f64) -> Vec<[[f64; 2]; 2]> {
    let mut segments = Vec::new();
    for (r, pair) in heights.windows(2).enumerate() {
        for c in 0..pair[0].len().saturating_sub(1) {
            // Corners in turn: (c, r), (c + 1, r), (c + 1, r + 1), (c, r + 1).
            let corners = [pair[0][c], pair[0][c + 1], pair[1][c + 1], pair[1][c]];
            if corners.iter().all(|height| height.is_finite()) {
                cut(corners, [c as f64, r as f64], level, &mut segments);
            }
        }
    }
    segments
}

fn cut(corners: [f64; 4], [x, y]: [f64; 2], level: f64, segments: &mut Vec<[[f64; 2]; 2]>) {
    const AT: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let above = corners.map(|height| height > level);
    let crossing = |i: usize| {
        let j = (i + 1) % 4;
        let s = (level - corners[i]) / (corners[j] - corners[i]);
        [x + AT[i][0] + s * (AT[j][0] - AT[i][0]), y + AT[i][1] + s * (AT[j][1] - AT[i][1])]
    };
    let crossed: Vec<usize> = (0..4).filter(|&i| above[i] != above[(i + 1) % 4]).collect();
    match crossed[..] {
        [i, j] => segments.push([crossing(i), crossing(j)]),
        [a, b, c, d] => {
            let middle = corners.iter().sum::<f64>() / 4.0 > level;
            // Corner 0 lies between sides d and a. It is cut off if the middle lies on the other side of the level.
            let pairs = if middle == above[0] { [[a, b], [c, d]] } else { [[d, a], [b, c]] };
            segments.extend(pairs.map(|[i, j]| [crossing(i), crossing(j)]));
        }
        _ => {}
    }
}

/// Interpolates between grid points, at a fractional index.
pub fn along(places: &[f64], index: f64) -> f64 {
    let i = (index as usize).min(places.len().saturating_sub(2));
    places[i] + (index - i as f64) * (places[i + 1] - places[i])
}

/// Returns the contour line of heights over the grid of a surface, as points over x and y with gaps between the
/// segments.
pub fn border(surface: &Surface, heights: &[Vec<f64>], level: f64) -> Vec<(f64, f64)> {
    let gap = (f64::NAN, f64::NAN);
    let place = |p: [f64; 2]| (along(&surface.x, p[0]), along(&surface.y, p[1]));
    contour(heights, level).into_iter().flat_map(|[a, b]| [place(a), place(b), gap]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    #[test]
    fn the_contour_of_a_cone_is_a_circle_of_the_right_length() {
        let grid: Vec<Vec<f64>> =
            (0..41).map(|r| (0..41).map(|c| math::hypot(f64::from(c) - 20.0, f64::from(r) - 20.0)).collect()).collect();
        let segments = contour(&grid, 12.3);
        let length: f64 = segments.iter().map(|[a, b]| math::hypot(a[0] - b[0], a[1] - b[1])).sum();
        assert!((length / (std::f64::consts::TAU * 12.3) - 1.0).abs() < 2e-3, "{length}");
        assert!(segments.iter().flatten().all(|p| (math::hypot(p[0] - 20.0, p[1] - 20.0) - 12.3).abs() < 0.02));
    }

    #[test]
    fn a_saddle_has_two_segments_and_gaps_are_omitted() {
        assert_eq!(contour(&[vec![1.0, 0.0], vec![0.0, 1.0]], 0.6).len(), 2);
        // The mean lies below the level: each high corner is cut off by itself.
        let cuts = contour(&[vec![1.0, 0.0], vec![0.0, 1.0]], 0.6);
        assert!(cuts.iter().any(|s| s.iter().all(|p| p[0] + p[1] < 1.0)), "{cuts:?}");
        assert!(contour(&[vec![1.0, 0.0], vec![f64::NAN, 1.0]], 0.6).is_empty());
    }
}
