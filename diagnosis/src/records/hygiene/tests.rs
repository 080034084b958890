use super::*;

fn samples(noise: f64) -> (Vec<f64>, Vec<f64>) {
    let times: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.01).collect();
    // A fixed sequence that is as good as white: the fractional parts of multiples of the golden ratio, uniform.
    let white = |k: usize| ((k as f64 * 0.618_033_988_749_894_9).fract() - 0.5) * 12.0_f64.sqrt();
    let values = times.iter().enumerate().map(|(k, t)| math::sin(3.0 * t) + noise * white(k * k + 7 * k)).collect();
    (times, values)
}

#[test]
fn the_noise_on_a_sine_is_found() {
    let (times, values) = samples(0.02);
    let noise = noise_of(&[(&times, &values)]).expect("samples show it");
    assert!((noise - 0.02).abs() < 0.005, "{noise}");
}

#[test]
fn a_sample_far_from_its_neighbours_is_left_out_and_a_step_is_kept() {
    let (times, mut values) = samples(0.001);
    values[200] += 0.5;
    let (_, kept, dropped) = without_spikes(&times, &values, 0.001);
    assert_eq!((dropped, kept.len()), (1, 399));
    values[200] -= 0.5;
    values[300..].iter_mut().for_each(|v| *v += 0.5);
    assert_eq!(without_spikes(&times, &values, 0.001).2, 0);
}

#[test]
fn a_transient_that_is_over_by_the_second_sample_is_kept() {
    let (times, mut values) = samples(0.001);
    values[0] -= 0.5;
    assert_eq!(without_spikes(&times, &values, 0.001).2, 0);
}

#[test]
fn records_of_a_sensor_share_a_noise_and_it_is_not_below_that_of_its_steps() {
    let (times, values) = samples(0.02);
    let [short, long] = [100, 400].map(|n| (&times[..n], &values[..n]));
    let noise = noise_of(&[short, long]).unwrap();
    assert!((noise - 0.02).abs() < 0.005, "{noise}");
    // A ramp of a step every tenth sample: local parabolas leave little.
    let stairs: Vec<f64> = (0..400).map(|k| 0.3 * f64::from(k / 10)).collect();
    let noise = noise_of(&[(&times, &stairs)]).unwrap();
    assert!(noise > 0.999 * 0.3 / 12.0_f64.sqrt(), "{noise}");
}

#[test]
fn one_wrong_sample_does_not_count_however_wrong() {
    let (times, mut values) = samples(0.02);
    values[0] = 1e9;
    let noise = noise_of(&[(&times, &values)]).unwrap();
    assert!((noise - 0.02).abs() < 0.005, "{noise}");
}

#[test]
fn few_samples_and_samples_that_never_change_show_no_noise() {
    let (times, values) = samples(0.02);
    assert!(noise_of(&[(&times[..6], &values[..6])]).is_none() && noise_of(&[(&times, &[1.5; 400])]).is_none());
}
