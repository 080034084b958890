//! All criteria over time.

use mops::criteria;
use mops_core::{Criterion, CriterionOptions, CriterionSpec, Interface, Variable};

use super::plants::SIGNALS;

/// Criterion with a name to print.
pub struct Asked {
    pub name: String,
    pub criterion: Box<dyn Criterion>,
}

type Read = fn(&str) -> Box<dyn CriterionSpec>;

fn read<O: CriterionOptions + 'static>(text: &str) -> Box<dyn CriterionSpec> {
    Box::new(toml::from_str::<O>(text).expect("the options are valid"))
}

/// Criteria with their options, separated by `; `; `SIGNAL` stands for the signal.
const CRITERIA: [(&str, Read, &str); 26] = [
    ("ise", read::<criteria::ise::Ise>, "target = 0.1"),
    ("iae", read::<criteria::iae::Iae>, "target = 0.1"),
    ("itae", read::<criteria::itae::Itae>, "target = 0.1"),
    ("itse", read::<criteria::itse::Itse>, "target = 0.1"),
    ("effort", read::<criteria::control_effort::ControlEffort>, ""),
    ("effort-absolute", read::<criteria::control_effort::ControlEffort>, "of = 'absolute'"),
    ("peak", read::<criteria::peak::Peak>, ""),
    ("peak-minimum", read::<criteria::peak::Peak>, "of = 'minimum'"),
    ("peak-absolute", read::<criteria::peak::Peak>, "of = 'absolute'"),
    ("final-value", read::<criteria::final_value::FinalValue>, ""),
    ("maximum-rate", read::<criteria::maximum_rate::MaximumRate>, ""),
    (
        "step-envelope",
        read::<criteria::step_envelope::StepEnvelope>,
        "upper = [[0, 0.2], [10, 0.1]]; lower = [[0, -0.1], [10, 0]]",
    ),
    ("overshoot", read::<criteria::overshoot::Overshoot>, "target = 0.2; from = 0"),
    ("undershoot", read::<criteria::undershoot::Undershoot>, "target = 0.2; from = 0.05"),
    ("settling-time", read::<criteria::settling_time::SettlingTime>, "target = 0.2; band = 0.1"),
    ("rise-time", read::<criteria::rise_time::RiseTime>, "target = 0.2; from = 0"),
    ("delay-time", read::<criteria::delay_time::DelayTime>, "target = 0.2; from = 0"),
    ("steady-state-error", read::<criteria::steady_state_error::SteadyStateError>, "target = 0.2"),
    (
        "model-tracking",
        read::<criteria::model_tracking::ModelTracking>,
        "target = 0.2; from = 0; time-constant = '0.3 s'",
    ),
    ("initial", read::<criteria::expression::Expression>, "value = 'initial(SIGNAL)'"),
    ("maximum", read::<criteria::expression::Expression>, "value = 'maximum(SIGNAL^2 - 0.1*SIGNAL)'"),
    ("minimum", read::<criteria::expression::Expression>, "value = 'minimum(SIGNAL)'"),
    ("integral", read::<criteria::expression::Expression>, "value = 'integral(SIGNAL^2 + 0.3*SIGNAL)'"),
    ("mean", read::<criteria::expression::Expression>, "value = 'mean(abs(SIGNAL))'"),
    ("rms", read::<criteria::expression::Expression>, "value = 'rms(SIGNAL)'"),
    ("sum", read::<criteria::expression::Expression>, "value = 'integral(SIGNAL)/1 [s] + maximum(SIGNAL)'"),
];

/// Returns all criteria of the first signals of a model.
pub fn asked(interface: &Interface) -> Vec<Asked> {
    let of_signal = |Variable { name: signal, unit, .. }: &Variable| {
        let of = |&(name, read, options): &(&str, Read, &str)| {
            let text = match options.contains("SIGNAL") {
                true => options.replace("SIGNAL", &format!("({signal}/1 [{unit}])")),
                false => format!("signal = '{signal}'\n{}", options.replace("; ", "\n")),
            };
            let criterion = read(&text).bind(interface).expect("the signal exists");
            Asked { name: format!("{name}({signal})"), criterion }
        };
        CRITERIA.iter().map(of).collect::<Vec<_>>()
    };
    interface.signals.iter().take(SIGNALS).flat_map(of_signal).collect()
}
