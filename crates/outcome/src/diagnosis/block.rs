//! Block `diagnosis` of `result.json`. Numbers are in the units of the study; non-finite numbers are null.

use std::collections::BTreeMap;

use mops_core::case::Role;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::Finding;

use super::{
    Alignment, Dependence, Diagnosis, ExperimentError, ForecastOf, Found, HeldOut, NamedBy, Noticeable, ParameterMove,
    Ranked, Removed, Rival, Rule, Step, StrengthValue, Unexplained, Verdict, WiderRanges,
};

/// Result of a diagnosis.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Diagnosis")]
pub struct Block {
    /// Verdict on the model.
    verdict: Verdict,
    /// Probability of the verdict; null if it cannot be stated.
    #[schemars(with = "Option<f64>")]
    probability: f64,
    /// p-value of the residual's structure without a missing effect.
    p_value: f64,
    /// Recorded inputs that act at other times than the study says, or are interpolated otherwise; effects are found
    /// with these.
    alignment: Vec<Alignment>,
    /// Effects added to the model, claimed or proposed.
    found: Vec<FoundEffect>,
    /// Share of the squared error of the declared model, in noises, that the effects found remove from validation data,
    /// else selection data; null without effects or without such data.
    explained_share: Option<f64>,
    /// Coordinate on which what the declared model lacks depends; null if none is significant.
    depends_on: Option<Dependence>,
    /// Coordinate on which what remains with the effects found depends; null if none is significant.
    remaining: Option<Dependence>,
    /// Data whose forecast decided.
    forecast_of: ForecastOf,
    /// What names the effects found; effects that least squares names are proposals.
    named_by: NamedBy,
    /// Wider ranges of declared parameters that explain as much as any effect; null if there are none.
    wider_ranges: Option<WiderRanges>,
    /// True if the effects found are those of highest evidence.
    first_by_evidence: bool,
    /// True if the search was stopped before its end.
    stopped: bool,
    /// True if all fits that the verdict rests on converged.
    converged: bool,
    /// True if the verdict is sure: nothing is missing, or every effect found is claimed, by highest evidence and a
    /// better forecast of held-out data; the search was not stopped, all fits converged, and no parameter is at a
    /// bound.
    sure: bool,
    /// Terms of the nominal model that the data contradict.
    removed: Vec<Removed>,
    /// Models visited by the search, in order.
    steps: Vec<Step>,
    /// Candidate effects, best first.
    ranked: Vec<Candidate>,
    /// Residual that no effect explains; null if there is none.
    unexplained: Option<Unexplained>,
    /// Experiment that would distinguish the alternatives; null without alternatives.
    next_experiment: Option<String>,
    /// Errors of the nominal model, by experiment.
    #[schemars(with = "BTreeMap<String, ModelError>")]
    before: Map<String, Value>,
    /// Errors of the augmented model, by experiment.
    #[schemars(with = "BTreeMap<String, ModelError>")]
    after: Map<String, Value>,
    /// Standard deviation of the noise, by experiment and channel.
    #[schemars(with = "BTreeMap<String, BTreeMap<String, f64>>")]
    noise: Value,
    /// Shifts of the parameters.
    parameters: Vec<ParameterMove>,
    /// Initial states of every experiment in the augmented model.
    starts: Vec<InitialState>,
    /// Detection limits, for the verdict `none`.
    noticeable: Vec<DetectionLimit>,
    /// Places with the coordinate on which what the nominal model lacks depends there, the largest gain first.
    places: Vec<Place>,
    /// Remarks on data and fit.
    notes: Vec<String>,
    /// Number of simulations.
    simulations: usize,
}

/// Effect added to the model.
#[derive(Serialize, JsonSchema)]
struct FoundEffect {
    /// The effect.
    effect: String,
    /// The place, as `kind:name`.
    place: String,
    /// Name in the augmented model, such as `phi-coulomb-friction`; its parameters are called `name.parameter`.
    name: String,
    /// Class, such as `dissipative`.
    class: String,
    /// Formula, for readers.
    formula: String,
    /// Estimates of its parameters, by name.
    #[schemars(with = "BTreeMap<String, f64>")]
    strengths: Map<String, Value>,
    /// Estimates of its parameters, with their errors.
    details: Vec<StrengthValue>,
    /// Probability that this effect, rather than another, is missing; null if none can be stated.
    #[schemars(with = "Option<f64>")]
    probability: f64,
    /// Probability that an effect of this class is missing at this place; null for a given effect, or if most remains
    /// to be explained.
    #[schemars(with = "Option<f64>")]
    class_probability: f64,
    /// Other classes and places that the data cannot distinguish from these, as `class at kind:name`:
    /// `class_probability` is that of one of them.
    alike: Vec<String>,
    /// True if class and place are claimed; otherwise the effect is a proposal, or given.
    claimed: bool,
    /// True if the study gives the effect (`with`).
    given: bool,
    /// Decrease of the BIC when the effect is added: twice the gain in log-evidence, which the BIC approximates.
    bic_gain: f64,
    /// Alternatives at the same place whose BIC is at most 6 higher.
    indistinguishable: Vec<Rival>,
    /// Errors on held-out data with and without the effect, initial states fitted. Empty for a single effect, whose
    /// errors before and after show the same, and if the model without the effect cannot be simulated over whole
    /// records.
    held_out: Vec<HeldOut>,
    /// Second place, as `kind:name`, of an effect that needs one.
    #[serde(skip_serializing_if = "Option::is_none")]
    companion: Option<String>,
    /// The only experiment in which the effect acts, for an effect that happens once.
    #[serde(skip_serializing_if = "Option::is_none")]
    experiment: Option<String>,
}

/// Candidate effect, fitted together with the effects already accepted.
#[derive(Serialize, JsonSchema)]
struct Candidate {
    /// The effect.
    effect: String,
    /// The place, as `kind:name`.
    place: String,
    /// Class.
    class: String,
    /// Probability.
    probability: f64,
    /// Decrease of the BIC when the effect is added.
    bic_gain: f64,
    /// Estimates of its parameters, by name.
    #[schemars(with = "BTreeMap<String, f64>")]
    strengths: Map<String, Value>,
    /// Share of the effect's output signature that parameters and initial states absorb.
    absorbed: f64,
    /// Error with the effect on calibration data, in units of the noise.
    normalised: f64,
    /// Rule that the effect failed; null for a claimed one.
    failed: Option<Rule>,
}

/// Error of a model on an experiment.
#[derive(Serialize, JsonSchema)]
struct ModelError {
    /// Role of the experiment.
    role: Role,
    /// Root mean square error, by channel, in the unit of the channel.
    #[schemars(with = "BTreeMap<String, f64>")]
    channels: Map<String, Value>,
    /// Root mean square error over all channels and samples, in units of the noise; 1 is the noise level.
    normalised: f64,
    /// Errors in windows of a few periods; absent if the record is too short for two.
    #[serde(skip_serializing_if = "Option::is_none")]
    windows: Option<WindowError>,
}

/// Error over windows of a record, each with its own initial states and the parameters fixed.
#[derive(Serialize, JsonSchema)]
struct WindowError {
    /// Number of windows.
    count: usize,
    /// Length of a window, s.
    length: f64,
    /// Root mean square error, by channel, in the unit of the channel.
    #[schemars(with = "BTreeMap<String, f64>")]
    channels: Map<String, Value>,
    /// Root mean square error over all channels and samples, in units of the noise.
    normalised: f64,
}

/// Initial state of an experiment in the augmented model.
#[derive(Serialize, JsonSchema)]
struct InitialState {
    /// Experiment.
    experiment: String,
    /// Parameter that is the initial state.
    parameter: String,
    /// Its value.
    value: f64,
}

/// Detection limit: the smallest parameter of an effect that would have been detected.
#[derive(Serialize, JsonSchema)]
struct DetectionLimit {
    /// The effect.
    effect: String,
    /// The place, as `kind:name`.
    place: String,
    /// Name of the parameter.
    strength: String,
    /// Its value at the detection limit.
    value: f64,
    /// Unit of the value.
    unit: String,
}

/// Place with the coordinate on which what the nominal model lacks depends there, if it acts there.
#[derive(Serialize, JsonSchema)]
struct Place {
    /// The place, as `kind:name`.
    place: String,
    /// Second place, on which the opposite force acts.
    #[serde(skip_serializing_if = "Option::is_none")]
    other: Option<String>,
    /// The coordinate.
    coordinate: String,
    /// Gain in log-evidence of a free curve over the coordinate, nats.
    gain: f64,
}

impl Block {
    fn of(diagnosis: &Diagnosis) -> Self {
        let Diagnosis { found, ranked, before, after, starts, noticeable, places, .. } = diagnosis;
        let start = |(experiment, parameter, value): &(String, String, f64)| InitialState {
            experiment: experiment.clone(),
            parameter: parameter.clone(),
            value: *value,
        };
        Self {
            verdict: diagnosis.verdict,
            probability: diagnosis.probability,
            p_value: diagnosis.p_value,
            found: found.iter().map(FoundEffect::of).collect(),
            explained_share: diagnosis.explained_share,
            depends_on: diagnosis.depends_on.clone(),
            remaining: diagnosis.remaining.clone(),
            forecast_of: diagnosis.forecast_of,
            named_by: diagnosis.named_by,
            wider_ranges: diagnosis.wider.clone(),
            first_by_evidence: diagnosis.is_first,
            stopped: diagnosis.is_stopped,
            converged: diagnosis.converged,
            sure: diagnosis.is_sure,
            removed: diagnosis.removed.clone(),
            steps: diagnosis.steps.clone(),
            ranked: ranked.iter().map(Candidate::of).collect(),
            unexplained: diagnosis.unexplained.clone(),
            next_experiment: diagnosis.next_experiment.clone(),
            before: errors(before),
            after: errors(after),
            noise: noise(diagnosis),
            parameters: diagnosis.parameters.clone(),
            starts: starts.iter().map(start).collect(),
            noticeable: noticeable.iter().map(DetectionLimit::of).collect(),
            places: places.iter().map(Place::of).collect(),
            alignment: diagnosis.alignment.clone(),
            notes: diagnosis.notes.clone(),
            simulations: diagnosis.simulations,
        }
    }
}

impl FoundEffect {
    fn of(found: &Found) -> Self {
        Self {
            effect: found.effect.clone(),
            place: found.place.clone(),
            name: found.name.clone(),
            class: found.class.clone(),
            formula: found.formula.clone(),
            strengths: strengths(&found.strengths),
            details: found.strengths.clone(),
            probability: found.probability,
            class_probability: found.class_probability,
            alike: found.alike.clone(),
            claimed: found.claimed,
            given: found.given,
            bic_gain: found.bic_gain,
            indistinguishable: found.indistinguishable.clone(),
            held_out: found.held_out.clone(),
            companion: found.companion.clone(),
            experiment: found.only.clone(),
        }
    }
}

impl Candidate {
    fn of(ranked: &Ranked) -> Self {
        Self {
            effect: ranked.effect.clone(),
            place: ranked.place.clone(),
            class: ranked.class.clone(),
            probability: ranked.probability,
            bic_gain: ranked.bic_gain,
            strengths: strengths(&ranked.strengths),
            absorbed: ranked.absorbed,
            normalised: ranked.normalised,
            failed: ranked.failed,
        }
    }
}

impl DetectionLimit {
    fn of(noticeable: &Noticeable) -> Self {
        let StrengthValue { name, value, unit, .. } = noticeable.strength.clone();
        Self { effect: noticeable.effect.clone(), place: noticeable.place.clone(), strength: name, value, unit }
    }
}

impl Place {
    fn of(curve: &Dependence) -> Self {
        let Dependence { place, other, coordinate, gain, .. } = curve.clone();
        Self { place, other, coordinate, gain }
    }
}

/// Returns the values of an effect's parameters by name.
fn strengths(strengths: &[StrengthValue]) -> Map<String, Value> {
    strengths.iter().map(|s| (s.name.clone(), json!(s.value))).collect()
}

/// Returns the errors by experiment, and by channel within each.
fn errors(errors: &[ExperimentError]) -> Map<String, Value> {
    let error = |error: &ExperimentError| {
        let windows = error.in_windows.as_ref().map(|w| WindowError {
            count: w.count,
            length: w.length,
            channels: by_channel(&w.channels),
            normalised: w.normalised,
        });
        let channels = by_channel(&error.channels);
        let value = ModelError { role: error.role, channels, normalised: error.normalised, windows };
        (error.name.clone(), serde_json::to_value(value).expect("errors are JSON"))
    };
    errors.iter().map(error).collect()
}

fn by_channel(channels: &[(String, f64)]) -> Map<String, Value> {
    channels.iter().map(|(name, rms)| (name.clone(), json!(rms))).collect()
}

/// Returns the standard deviation of the noise by experiment, and by channel within each.
fn noise(diagnosis: &Diagnosis) -> Value {
    let mut noise = json!({});
    for prediction in &diagnosis.predictions {
        noise[&prediction.experiment][&prediction.signal] = json!(prediction.noise);
    }
    noise
}

impl Finding for Diagnosis {
    const KEY: &'static str = "diagnosis";
    const ABOUT: &'static str = "Missing effects of the model.";
    type Block = Block;

    // The derived form of a diagnosis has more, and is read back.
    fn block(&self) -> Value {
        json!(Block::of(self))
    }
}
