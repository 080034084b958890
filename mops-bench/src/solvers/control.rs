//! Suite `control`: studies with known optimum.

use mops::Shipped;

/// Study with known optimum.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Files of the study.
    pub study: Shipped,
    /// Minimum of the objective.
    pub minimum: f64,
    /// Tuners at the optimum, in order. Empty if only the objective is known, or if the optimum is at a discontinuity,
    /// which rounded values miss.
    pub tuners: &'static [f64],
    /// Source of the solution.
    pub source: &'static str,
}

/// Includes the files of a study in `mops-bench/control/`, with its data.
macro_rules! control {
    ($name:literal $(, $file:literal)*) => {
        Shipped {
            name: $name,
            files: &[
                ("study.toml", include_bytes!(concat!("../../control/", $name, ".toml"))),
                $(($file, include_bytes!(concat!("../../control/", $file))),)*
            ],
        }
    };
}

/// Returns the studies of the suite: designs and a calibration from the thesis, then problems with closed-form,
/// published or independently computed solutions.
pub fn control() -> Vec<Known> {
    let of_shipped = |name: &str| {
        mops::studies::shipped().into_iter().find(|study| study.name == name).expect("the study is shipped")
    };
    let thesis = |name: &str, minimum: f64, tuners: &'static [f64], source: &'static str| Known {
        study: of_shipped(name),
        minimum,
        tuners,
        source,
    };
    let known = |study: Shipped, minimum: f64, tuners: &'static [f64], source: &'static str| Known {
        study,
        minimum,
        tuners,
        source,
    };
    let searched = "least value of several independent searches on an independent simulation";
    vec![
        thesis("pid-design", 0.863_070_4, &[5.559_913, 4.757_388, 1.373_133], searched),
        thesis("pid-design-constrained", 0.735_926_5, &[5.535_264, 5.952_346, 1.340_547], searched),
        thesis("pid-design-multi-case", 3.895_509_8, &[], searched),
        thesis("pole-placement-retuning", 1.115_84, &[], searched),
        thesis(
            "furuta-calibration",
            0.091_413_2,
            &[],
            "least value of all runs from different starts; no other source",
        ),
        known(
            control!("lq-double-integrator"),
            std::f64::consts::SQRT_2,
            &[1.0, std::f64::consts::SQRT_2],
            "closed form of the Riccati equation; A. E. Bryson, Y.-C. Ho, Applied Optimal Control (1975), section 5.2",
        ),
        known(
            control!("lq-two-masses"),
            1.299_051_518_412_3,
            &[0.944_947_291_8, 0.055_052_708_2, 1.374_734_368_4, 1.052_176_133_4],
            "Riccati equation by the iteration of D. Kleinman, IEEE Transactions on Automatic Control 13 (1968) 114-115",
        ),
        known(
            control!("ise-second-order"),
            1.0,
            &[0.5],
            "closed form z + 1/(4 z); G. C. Newton, L. A. Gould, J. F. Kaiser, Analytical Design of Linear Feedback \
             Controls (1957), appendix E",
        ),
        known(
            control!("itae-third-order"),
            3.138_258_640_8,
            &[1.782_778_35, 2.171_486_99],
            "form of D. Graham, R. C. Lathrop, AIEE Transactions 72 (1953) 273-288 (1.75, 2.15), improved by exact \
             integration between the zeros of the error",
        ),
        known(
            control!("settling-second-order"),
            2.859_070_613_3,
            &[],
            "closed form of the damping with 5 % overshoot, 0.690107, and the root of its step response",
        ),
        known(
            control!("minimum-time"),
            2.0,
            &[1.0, 2.0],
            "closed form 2 sqrt(distance/acceleration); A. E. Bryson, Y.-C. Ho (1975), section 3.9",
        ),
        known(
            control!("gain-margin"),
            1.0,
            &[4.0],
            "closed form: ultimate gain 8; J. G. Ziegler, N. B. Nichols, Transactions of the ASME 64 (1942) 759-768",
        ),
        known(
            control!("pi-sensitivity"),
            1.459_448_790_2,
            &[1.221_959, 1.783_387],
            "K. J. Astrom, H. Panagopoulos, T. Hagglund, Automatica 34 (1998) 585-601 (1.22, 1.78), to more digits by \
             bisection",
        ),
        known(
            control!("absorber-hinf"),
            6.407_920_768,
            &[0.952_372_044, 0.133_937_728],
            "J. P. Den Hartog, Mechanical Vibrations (1956), section 3.3 (6.4031 at the fixed points); the highest of \
             both peaks by nested searches",
        ),
        known(
            control!("absorber-h2"),
            2.108_420_355_915_7,
            &[0.964_212_225_3, 0.109_772_227_5],
            "closed form; G. B. Warburton, Earthquake Engineering and Structural Dynamics 10 (1982) 381-401",
        ),
        known(control!("mass-spring", "data/mass-spring.csv"), 0.0, &[4.0, 0.6, 1.0, 0.0], "exact data"),
        known(control!("tank", "data/tank.csv"), 0.0, &[0.006, 0.64], "exact data"),
        // Certified sums of squares, divided by the number of data and by the squared noise level of the study.
        known(
            control!("misra1a", "data/misra1a.csv"),
            1.245_513_889_4e-1 / (14.0 * 0.01),
            &[2.389_421_291_8e2, 5.501_564_318_1e-4],
            NIST,
        ),
        known(
            control!("boxbod", "data/boxbod.csv"),
            1.168_008_876_6e3 / (6.0 * 100.0),
            &[2.138_094_088_9e2, 5.472_374_854_2e-1],
            NIST,
        ),
        known(
            control!("mgh17", "data/mgh17.csv"),
            5.464_894_697_5e-5 / (33.0 * 1e-6),
            &[3.754_100_521_1e-1, 1.935_846_912_7, -1.464_687_136_6, 1.286_753_464e-2, 2.212_269_966_2e-2],
            NIST,
        ),
    ]
}

const NIST: &str = "NIST Statistical Reference Datasets, nonlinear regression, certified values";
