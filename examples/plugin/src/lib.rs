//! mops with a model, a criterion, a solver, an effect, a task and two studies of its own.

pub mod eddy_brake;
pub mod quarter_car;
pub mod ride_comfort;
pub mod shrinking_box;
pub mod suspension;
pub mod tolerances;

use mops::prelude::*;

/// The catalogue of mops, and the additions.
pub fn catalogue() -> Catalogue {
    mops::catalogue()
        .with_model(ModelKind::of::<quarter_car::QuarterCarOptions>())
        .with_criterion(CriterionKind::of::<ride_comfort::RideComfort>())
        .with_solver(SolverKind::of::<shrinking_box::ShrinkingBoxOptions>())
        .with_effect(mops::effects::effect::<eddy_brake::EddyBrake>())
        .with_task(mops::tasks::kind::<tolerances::TolerancesTask>(tolerances::Tolerances))
        .with_study(BuiltStudy::new("suspension", "Spring and damper of a wheel, built in Rust", suspension::study))
        .with_study(Shipped {
            name: "quarter-car",
            files: &[
                ("study.toml", include_bytes!("../studies/quarter-car/study.toml")),
                ("README.md", include_bytes!("../studies/quarter-car/README.md")),
            ],
        })
}
