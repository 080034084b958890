//! Inputs that drive a model, as functions of time.

mod function;
mod waveforms;

pub use function::{Chirp, Hold, Input};
pub use waveforms::PRBS_STAGES;

#[cfg(test)]
mod tests {
    use mops_math as math;

    use super::*;

    #[test]
    fn inputs_are_continuous_from_the_right_and_name_their_next_jump() {
        let step = Input::Step { time: 1.0, before: 0.0, after: 2.0 };
        assert_eq!((step.at(0.999), step.at(1.0)), (0.0, 2.0));
        assert_eq!((step.next_break(0.0), step.next_break(1.0)), (1.0, f64::INFINITY));
        let sampled = |hold| Input::Sampled { times: vec![0.0, 1.0, 2.0], values: vec![0.0, 4.0, 6.0], hold };
        assert_eq!((sampled(Hold::Zero).at(0.5), sampled(Hold::First).at(0.5)), (0.0, 2.0));
        assert_eq!((sampled(Hold::Zero).at(1.0), sampled(Hold::First).at(5.0)), (4.0, 6.0));
        assert_eq!(sampled(Hold::Zero).next_break(0.0), 1.0);
    }

    #[test]
    fn a_band_limited_input_passes_through_its_samples_and_wants_them_evenly_spaced() {
        let sampled = |times: Vec<f64>| Input::Sampled {
            values: times.iter().map(|t| math::sin(4.0 * t)).collect(),
            times,
            hold: Hold::BandLimited,
        };
        let even = sampled((0..100).map(|i| 0.2 * f64::from(i)).collect());
        assert!((even.at(10.0) - math::sin(40.0)).abs() < 1e-12 && (even.at(10.1) - math::sin(40.4)).abs() < 1e-4);
        assert_eq!((even.at(-1.0), even.at(99.0)), (0.0, math::sin(4.0 * 0.2 * 99.0)));
        assert_eq!((even.uneven(), sampled(vec![0.0, 0.2, 0.5, 0.6]).uneven()), (None, Some(0.2)));
    }

    #[test]
    fn a_sampled_sine_looks_smooth_and_switching_does_not() {
        let sampled = |hold, value: &dyn Fn(f64) -> f64| Input::Sampled {
            times: (0..200).map(f64::from).collect(),
            values: (0..200).map(|i| value(f64::from(i))).collect(),
            hold,
        };
        assert!(sampled(Hold::Zero, &|t| math::sin(0.1 * t)).looks_smooth());
        assert!(!sampled(Hold::First, &|t| math::sin(0.1 * t)).looks_smooth());
        // Switching, a staircase, and a new value at every sample.
        assert!(!sampled(Hold::Zero, &|t| math::sin(0.1 * t).signum()).looks_smooth());
        assert!(!sampled(Hold::Zero, &|t| math::sin(0.1 * (t / 5.0).floor())).looks_smooth());
        assert!(!sampled(Hold::Zero, &|t| math::sin(t * t)).looks_smooth());
    }

    #[test]
    fn a_chirp_has_its_frequencies_at_its_ends() {
        for logarithmic in [false, true] {
            let chirp =
                Chirp { amplitude: 2.0, frequencies: [0.5, 8.0], start: 1.0, duration: 4.0, end: 5.0, logarithmic };
            let tau = std::f64::consts::TAU;
            assert_eq!(chirp.phase(1.0), [0.0, tau * 0.5]);
            assert!((chirp.phase(5.0)[1] - tau * 8.0).abs() < 1e-12);
            let middle = if logarithmic { 2.0 } else { 4.25 };
            assert!((chirp.phase(3.0)[1] - tau * middle).abs() < 1e-12);
            for t in [1.3, 2.0, 4.9] {
                let difference = (chirp.sine(t + 1e-6) - chirp.sine(t - 1e-6)) / 2e-6;
                assert!((difference - chirp.slope(t)).abs() < 1e-6 * 100.0, "{t}");
            }
            let input = Input::Chirp(chirp);
            assert_eq!(
                (input.at(0.9), input.at(5.0), input.next_break(0.0), input.next_break(1.0)),
                (0.0, 0.0, 1.0, 5.0)
            );
            assert!((input.since(0.7).at(2.0) - input.at(2.7)).abs() < 1e-13);
        }
    }

    #[test]
    fn the_first_part_of_a_sum_has_the_zero_of_the_unit() {
        let sine = Input::Sine { amplitude: 5.0, frequency: 1.0, phase: 0.0, offset: 0.0 };
        let sum = Input::Sum(vec![Input::Constant(20.0), sine]);
        assert_eq!(sum.at(0.25), 25.0);
        assert_eq!(sum.mapped(&|v| v + 273.15, 1.0).at(0.25), 298.15);
    }
}
