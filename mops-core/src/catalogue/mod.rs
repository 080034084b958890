//! Catalogue of all kinds of models, criteria and solvers that a study file can name, and of the shipped studies.

mod effects;
mod kinds;
mod study;

pub use effects::EffectBuilder;
pub use kinds::{
    Augment, Catalogue, CriterionKind, CriterionOptions, ModelKind, ModelOptions, SolverChoice, SolverKind,
    SolverOptions, TaskKind, schema_of, schema_once,
};
pub use study::{BuiltStudy, CatalogueStudy, Shipped, StudyFolder};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::{BuiltStudy, Shipped};
    use crate::study::StudyBuilder;

    #[test]
    fn two_studies_of_one_name_are_refused_with_their_origins() {
        let built = |name: &str| BuiltStudy::new(name, "", StudyBuilder::default);
        let one = Catalogue::default().with_study(built("a")).with_study(Shipped { name: "b", files: &[] });
        assert_eq!(one.check_names(), Ok(()));
        let twice = one.with_study(built("b")).check_names().unwrap_err();
        assert_eq!(twice.message, "two studies are named `b`: one shipped with the program, one built in Rust");
    }
}
