//! Plants with two effects each.

use std::sync::Arc;

use mops::{
    Model,
    models::{WithEffects, equations::EquationsOptions},
};
use mops_core::{
    Case, Effect, Input, Job, ModelOptions,
    case::Hold,
    effect::{Between, EffectParameter, InitialGrid, Placement, Port, PortKind},
};

/// Horizon of the simulations, s.
pub const HORIZON: f64 = 3.0;

/// Number of signals of each plant that criteria read: a state and its rate, or two states.
pub const SIGNALS: usize = 2;

/// Plants whose signals, speeds, forces and times are of the order of 1.
const PLANTS: [(&str, &str); 3] = [
    (
        "heater",
        "states    = { T = '1', S = '1' }
         inputs    = { u = '1' }
         der       = { T = \"1 [s]*T' = u - 0.9*T - 0.4*(T - S)\", S = \"2 [s]*S' = 0.4*(T - S)\" }
         start     = { T = 0.3 }
         tolerance = { relative = 1e-10 }",
    ),
    (
        "pendulum",
        "states    = { th = 'rad', w = 'rad/s' }
         inputs    = { u = 'N m' }
         der       = { th = 'w', w = \"1 [kg m2]*w' = u - 4 [N m]*sin(th) - 0.1 [N m s]*w\" }
         start     = { th = 0.4 }
         tolerance = { relative = 1e-10 }",
    ),
    (
        "masses",
        "states    = { x = 'm', v = 'm/s', y = 'm', w = 'm/s' }
         inputs    = { u = 'N' }
         let       = { f = '5 [N/m]*(x - y) + 0.2 [N s/m]*(v - w)' }
         der       = { x = 'v', v = \"1 [kg]*v' = u - f - 1 [N/m]*x\", y = 'w', w = \"0.7 [kg]*w' = f\" }
         tolerance = { relative = 1e-10 }",
    ),
];

/// Kinds of inputs.
const INPUTS: [&str; 3] = ["step", "record", "sine"];

/// A plant with two effects, an input and the parameters to vary.
pub struct Setup {
    /// Plant, input and effects, to print.
    pub name: String,
    /// Names of the effects.
    pub effects: String,
    /// Name of the plant.
    pub plant: &'static str,
    /// The effects at their places.
    pub placements: Vec<Placement>,
    pub model: Arc<dyn Model>,
    pub parameters: Vec<f64>,
    /// Indices of the parameters of the effects.
    pub varied: Vec<usize>,
    pub input: Input,
}

impl Setup {
    pub fn case(&self) -> Case {
        Case { inputs: vec![("u".to_owned(), self.input.clone())], ..Case::default() }
    }

    /// Returns true if both effects act at one place.
    pub fn is_at_one_place(&self) -> bool {
        matches!(&self.placements[..], [a, b] if a.port == b.port)
    }

    pub fn job<'a>(&'a self, case: &'a Case, parameters: &'a [f64]) -> Job<'a> {
        const FIRST: [usize; SIGNALS] = [0, 1];
        Job { case, parameters, signals: &FIRST, horizon: HORIZON }
    }
}

/// Numbers that fill the range from 0 to 1 evenly: the fractional parts of multiples of the golden ratio.
struct Even(f64);

impl Even {
    fn next(&mut self) -> f64 {
        self.0 = (self.0 + 0.618_033_988_749_895).fract();
        self.0
    }

    fn below(&mut self, count: usize) -> usize {
        ((self.next() * count as f64) as usize).min(count - 1)
    }
}

fn input(kind: &str) -> Input {
    match kind {
        "step" => Input::Step { time: 0.413, before: 0.2, after: 1.0 },
        "sine" => Input::Sine { amplitude: 0.9, frequency: 0.63, phase: 0.4, offset: 0.2 },
        _ => {
            let times: Vec<f64> = (0..14).map(|k| 0.257 * f64::from(k)).collect();
            let mut even = Even(0.3);
            let values = times.iter().map(|_| 2.0 * even.next() - 0.7).collect();
            Input::Sampled { times, values, hold: Hold::First }
        }
    }
}

/// Returns a value at which the effect acts, of a typical size 1.
fn value(of: &EffectParameter, even: &mut Even) -> f64 {
    let mut one_of = |list: &[f64]| list[even.below(list.len())];
    let value = match of.grid {
        InitialGrid::Linear => 0.25,
        InitialGrid::Scaled(list) | InitialGrid::ScaledAndGap(list) | InitialGrid::SlewAndScaled(_, list) => {
            one_of(list)
        }
        InitialGrid::Within(list) | InitialGrid::WithinAndGap(list) | InitialGrid::WithinSize(list) => {
            one_of(list) - 0.2
        }
        InitialGrid::Plain(list)
        | InitialGrid::Jumps(list)
        | InitialGrid::Zeros(list)
        | InitialGrid::PlainAndScaled(list, _) => one_of(list),
        InitialGrid::Moments(list) => HORIZON * one_of(list),
        InitialGrid::Frequencies(_) => 4.0,
        InitialGrid::Steps => 0.05,
    };
    let value = if value == 0.0 { 0.1 } else { value };
    let [low, high] = of.bounds;
    (value * (0.85 + 0.3 * even.next())).clamp(low + 1e-3, high - 1e-3)
}

fn bare(text: &str) -> Arc<dyn Model> {
    let options: EquationsOptions = toml::from_str(text).expect("it is TOML");
    Arc::from(options.build().expect("it is a model"))
}

/// Effects of the setups.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chosen {
    /// Effects at their own place whose reported derivative is exact: not quantisation, of which that of its mean is
    /// reported.
    Differentiable,
    /// All effects, also those of one joint between two.
    All,
}

/// Returns the effects that act at a place, with a second place if they need one.
fn acting_at(model: &dyn Model, port: &Port, chosen: Chosen) -> Vec<(Arc<dyn Effect>, Option<Port>)> {
    let ports = &model.interface().ports;
    let companion =
        |wanted: PortKind| ports.iter().find(|other| *other != port && other.kind(ports) == Some(wanted)).cloned();
    let acts = |effect: &Arc<dyn Effect>| {
        (chosen == Chosen::All || !effect.is_staircase())
            && port.kind(ports).is_some_and(|kind| effect.ports().contains(&kind))
    };
    let mut effects = mops::effects::effects();
    if chosen == Chosen::All {
        let between: Vec<_> = effects.iter().filter_map(Between::of).collect();
        effects.extend(between);
    }
    effects
        .into_iter()
        .filter(acts)
        .filter_map(|effect| match effect.second_port() {
            None => Some((effect, None)),
            Some(wanted) => companion(wanted).map(|other| (effect, Some(other))),
        })
        .collect()
}

type Acting = (Port, Arc<dyn Effect>, Option<Port>);

fn setup((plant, model): (&'static str, &Arc<dyn Model>), kind: &str, pair: [&Acting; 2], even: &mut Even) -> Setup {
    let placement = |(k, (port, effect, companion)): (usize, &&Acting)| Placement {
        name: ["a", "b"][k].to_owned(),
        effect: Arc::clone(effect),
        port: port.clone(),
        companion: companion.clone(),
    };
    let placements: Vec<Placement> = pair.iter().enumerate().map(placement).collect();
    let own = model.interface().parameters.len();
    let mut parameters: Vec<f64> = model.interface().parameters.iter().map(|p| p.default.unwrap_or(0.0)).collect();
    let mut varied = Vec::new();
    let with = WithEffects::new(Arc::clone(model), placements.clone()).expect("the effects fit");
    for Placement { effect, .. } in &placements {
        for of in effect.parameters() {
            if !of.fixed {
                varied.push(parameters.len());
            }
            parameters.push(value(of, even));
        }
        parameters.extend(effect.free_starts().iter().map(|_| 0.0));
    }
    assert_eq!((with.interface().parameters.len(), own <= parameters.len()), (parameters.len(), true));
    let [a, b] = pair;
    let title = |of: &Acting| format!("{}{}", of.1.name(), if of.1.mutual() { " between" } else { "" });
    let effects = format!("{} + {}", title(a), title(b));
    let name = format!("{plant} {kind}: {} at {} + {} at {} {parameters:?}", a.1.name(), a.0, b.1.name(), b.0);
    Setup { name, effects, plant, placements, model: Arc::new(with), parameters, varied, input: input(kind) }
}

/// Number of pairs at two places of a plant.
const ACROSS: usize = 500;

/// Returns all pairs of effects at one place, and some at two places, of every plant and with every input.
pub fn setups(chosen: Chosen) -> Vec<Setup> {
    let mut even = Even(0.1);
    let mut all = Vec::new();
    for (plant, text) in PLANTS {
        let model = bare(text);
        let ports = model.interface().ports.clone();
        let at = |port: &Port| {
            let with = |(effect, companion)| (port.clone(), effect, companion);
            acting_at(model.as_ref(), port, chosen).into_iter().map(with).collect::<Vec<Acting>>()
        };
        let acting: Vec<Vec<Acting>> = ports.iter().map(at).collect();
        for (kind, acting) in ports.iter().map(|port| port.kind(&ports)).zip(&acting) {
            // The order matters where one effect receives what the other passes on.
            let is_chain = matches!(kind, Some(PortKind::Actuator | PortKind::Sensor));
            for (i, a) in acting.iter().enumerate() {
                for b in acting.iter().skip(if is_chain { 0 } else { i }) {
                    // Refused.
                    if !b.1.can_follow(a.1.as_ref()) {
                        continue;
                    }
                    for kind in INPUTS {
                        all.push(setup((plant, &model), kind, [a, b], &mut even));
                    }
                }
            }
        }
        let everything: Vec<&Acting> = acting.iter().flatten().collect();
        let mut across = 0;
        while across < ACROSS / PLANTS.len() {
            let [a, b] = [0, 1].map(|_| everything[even.below(everything.len())]);
            if a.0 == b.0 {
                continue;
            }
            across += 1;
            for kind in INPUTS {
                all.push(setup((plant, &model), kind, [a, b], &mut even));
            }
        }
    }
    all
}
