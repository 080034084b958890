//! Hand-written answers for tests.

use mops::outcome::diagnosis::Verdict;

use super::tool::{Answer, Named, Statement};

/// Returns an answer with the verdict `none`.
pub(crate) fn nothing() -> Answer {
    Answer {
        verdict: Verdict::None,
        probability: 0.93,
        p_value: 0.43,
        found: Vec::new(),
        statements: Vec::new(),
        depends_on: None,
        remaining: None,
        records: Vec::new(),
        declared: Vec::new(),
        set: Vec::new(),
        strengths: Vec::new(),
        unexplained_at: None,
        simulations: 731,
        seconds: 1.0,
    }
}

/// Returns an answer with Coulomb friction at `joint:phi` and two indistinguishable effects there.
pub(crate) fn coulomb() -> Answer {
    let there = |effect: &str| -> Named { (effect.into(), "joint:phi".into()) };
    Answer {
        verdict: Verdict::Effect,
        probability: 0.9997,
        p_value: 1e-9,
        found: vec![(there("coulomb-friction"), 0.97)],
        statements: vec![Statement { entries: vec![there("dissipative")], probability: 0.95, claimed: true }],
        set: ["coulomb-friction", "quadratic-drag", "stribeck-friction"].map(there).to_vec(),
        strengths: vec![(0, "c".into(), 0.0124, Some([0.0118, 0.013]))],
        ..nothing()
    }
}

/// Returns an answer with the verdict `unexplained` at `process:x`.
pub(crate) fn unexplained() -> Answer {
    Answer {
        verdict: Verdict::Unexplained,
        probability: 0.91,
        p_value: 1e-9,
        unexplained_at: Some("process:x".into()),
        ..nothing()
    }
}
