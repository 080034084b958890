use super::*;

#[test]
fn periods_are_counted_through_noise_and_offset() {
    let times: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i)).collect();
    let chance = |i: usize| ((i * 7919) % 13) as f64 / 6.0 - 1.0;
    let wave = |(i, t): (usize, &f64)| 5.0 + math::sin(2.0 * std::f64::consts::TAU * t) + 0.02 * chance(i);
    let values = times.iter().enumerate().map(wave).collect();
    let series = Series {
        signal: 0,
        name: "q".into(),
        unit: "rad".into(),
        times,
        values,
        noise: 0.02,
        is_noise_estimated: false,
    };
    assert!((periods(&series) - 20.0).abs() <= 0.5, "{}", periods(&series));
    let still = Series { values: vec![5.0; 1000], ..series };
    assert_eq!(periods(&still), 0.0);
}
