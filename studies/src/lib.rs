//! Shipped studies.

use mops_core::catalogue::Shipped;

/// Embeds the files of a study, by their names in its folder under `studies/`.
macro_rules! study {
    ($name:literal $(, $file:literal)*) => {
        Shipped {
            name: $name,
            files: &[
                ("study.toml", include_bytes!(concat!("../", $name, "/study.toml"))),
                ("README.md", include_bytes!(concat!("../", $name, "/README.md"))),
                $(($file, include_bytes!(concat!("../", $name, "/", $file))),)*
            ],
        }
    };
}

/// Returns all shipped studies. A new study is a folder and a line here.
pub fn shipped() -> Vec<Shipped> {
    vec![
        study!("pid-design"),
        study!("pid-design-constrained"),
        study!("pid-design-multi-case"),
        study!("pid-worst-case"),
        study!("pid-robust"),
        study!("pid-pareto"),
        study!("tank-level"),
        study!("multi-model"),
        study!("furuta-calibration", "data/horizontal.csv", "data/upright.csv"),
        study!("furuta-calibration-2-joint", "data/horizontal.csv", "data/upright.csv"),
        study!("furuta-discrepancy", "data/horizontal.csv", "data/pushed.csv", "data/upright.csv"),
        study!("furuta-swing", "data/horizontal.csv", "data/upright.csv"),
        study!("pole-placement-retuning"),
        study!("step-identification", "data/step.csv", "data/sine.csv"),
    ]
}
