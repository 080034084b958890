use mops_math as math;

use super::*;

#[test]
fn the_noise_keeps_the_stationary_covariance() {
    for (length, dt) in [(0.7, 0.3), (5.0, 0.01), (0.02, 1.0), (1.0, 0.58)] {
        let process = Matern32 { deviation: 1.3, length };
        let (p, f, q) = (process.stationary(), process.transition(dt), process.noise(dt));
        for a in 0..2 {
            for b in 0..2 {
                let mut sum = q[a][b];
                for j in 0..2 {
                    sum += f[a][j] * p[j][j] * f[b][j];
                }
                let scale = (p[a][a] * p[b][b]).sqrt();
                assert!((sum - p[a][b]).abs() < 4e-15 * scale, "{length} {dt} {a}{b}: {sum} {}", p[a][b]);
            }
        }
        let process = OrnsteinUhlenbeck { deviation: 1.3, length };
        let (p, f, q) = (process.stationary()[0][0], process.transition(dt)[0][0], process.noise(dt)[0][0]);
        assert!((f * p * f + q - p).abs() < 4e-15 * p, "{length} {dt}");
    }
}

#[test]
fn the_noise_of_short_steps_has_the_leading_terms_of_its_series() {
    // With q = 4 lambda^3 tau^2: q dt^3/3, q dt^2/2 and q dt, to first order in lambda dt.
    let (length, dt) = (3.0_f64, 1e-7);
    let rate = 3.0_f64.sqrt() / length;
    let q = 4.0 * rate * rate * rate * 1.69;
    let noise = Matern32 { deviation: 1.3, length }.noise(dt);
    let leading = [[q * dt * dt * dt / 3.0, q * dt * dt / 2.0], [q * dt * dt / 2.0, q * dt]];
    for a in 0..2 {
        for b in 0..2 {
            assert!((noise[a][b] / leading[a][b] - 1.0).abs() < 1e-6, "{a}{b}");
        }
    }
    let noise = OrnsteinUhlenbeck { deviation: 1.3, length }.noise(dt)[0][0];
    assert!((noise / (1.69 * 2.0 * dt / length) - 1.0).abs() < 1e-6);
}

#[test]
fn series_and_closed_form_of_the_integrals_agree_where_they_meet() {
    let rate = 3.0_f64.sqrt();
    let at = |x: f64| Matern32 { deviation: 1.0, length: 1.0 }.integrals(x / (2.0 * rate));
    let [below, above] = [SERIES * (1.0 - 1e-15), SERIES].map(at);
    for (below, above) in below.iter().zip(above) {
        assert!((below / above - 1.0).abs() < 1e-14, "{below} {above}");
    }
    // Integral of exp(-2 lambda s) over a long time.
    assert!((at(80.0)[0] - 0.5 / rate).abs() < 1e-15);
    assert!((math::exp(-80.0)) < 1e-30);
}
