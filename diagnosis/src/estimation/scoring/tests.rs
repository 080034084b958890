use super::*;

/// Normal log-density of `n` samples with variance `s2` about their mean, as a function of the logarithm of the
/// standard deviation: maximum at `ln(s2)/2`.
fn normal(x: f64, s2: f64, n: f64) -> Score {
    let ratio = s2 / math::exp(2.0 * x);
    Score {
        log: -n * (x + 0.5 * ratio),
        gradient: DVector::from_element(1, n * (ratio - 1.0)),
        information: DMatrix::from_element(1, 1, 2.0 * n),
    }
}

#[test]
fn a_standard_deviation_is_found_from_far_away() {
    for start in [-6.0, 0.0, 6.0] {
        let found = maximise(&[start], &[[-10.0, 10.0]], |x| normal(x[0], 4.0, 50.0)).expect("finite");
        assert!((found.point[0] - math::ln(2.0)).abs() < 1e-2, "{start}: {:?}", found.point);
    }
}

#[test]
fn a_bound_in_front_of_the_maximum_holds() {
    let found = maximise(&[0.0], &[[-1.0, 0.5]], |x| normal(x[0], 4.0, 50.0)).expect("finite");
    assert_eq!(found.point, [0.5]);
}

#[test]
fn log_determinants_of_badly_scaled_matrices_are_right() {
    let matrix = DMatrix::from_row_slice(2, 2, &[1e12, 1e3, 1e3, 4e-4]);
    assert!((log_determinant(&matrix) - math::ln(4e8 - 1e6)).abs() < 1e-12);
    assert_eq!(log_determinant(&DMatrix::from_row_slice(1, 1, &[-1.0])), f64::INFINITY);
}
