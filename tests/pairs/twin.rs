//! The independent simulation of a setup.

use std::f64::consts::TAU;

use mops_core::{
    Input,
    effect::{Placement, Port},
};
use mops_math as math;
use mops_testbed::twins::{self, BODIES, Body, Command, Declared, Site};

use super::Signals;
use super::plants::Setup;

/// Offset to absolute temperatures from which radiation is too fast for steps of fixed length.
const HOT: f64 = 100.0;

/// Returns true for radiation at absolute temperatures, whose time constant is of the order of 0.1 us in these plants.
pub fn is_too_stiff(setup: &Setup) -> bool {
    let is_hot = |(placement, values): (&Placement, &[f64])| {
        placement.effect.parameters().iter().zip(values).any(|(of, value)| of.name == "zero" && *value > HOT)
    };
    setup.placements.iter().zip(values(setup)).any(is_hot)
}

/// Returns the parameters of each effect; its free initial values are 0.
fn values(setup: &Setup) -> Vec<&[f64]> {
    let number = |placement: &Placement| placement.effect.parameters().len();
    let starts = |placement: &Placement| placement.effect.free_starts().len();
    let all: usize = setup.placements.iter().map(|placement| number(placement) + starts(placement)).sum();
    let mut rest = &setup.parameters[setup.parameters.len() - all..];
    let mut split = |placement: &Placement| {
        let (mine, others) = rest.split_at(number(placement));
        rest = &others[starts(placement)..];
        mine
    };
    setup.placements.iter().map(&mut split).collect()
}

fn site(body: &Body, port: &Port) -> Site {
    let index = |state: &str| body.states.iter().position(|name| name == &state).unwrap_or(body.states.len());
    match port {
        Port::Joint { position, .. } => {
            let q = index(position);
            Site::Joint(body.joints.iter().position(|joint| joint.q == q).expect("the position is that of a joint"))
        }
        // None of the plants has a speed without a position.
        Port::Speed { state, .. } | Port::Process { state, .. } => Site::Process(index(state)),
        Port::Actuator { .. } => Site::Actuator,
        Port::Sensor { output } => Site::Sensor(index(output)),
    }
}

/// Returns the value of an input at a time, s.
fn value(input: &Input, t: f64) -> f64 {
    match input {
        Input::Step { time, before, after } => {
            if t < *time {
                *before
            } else {
                *after
            }
        }
        Input::Sine { amplitude, frequency, phase, offset } => {
            offset + amplitude * math::sin(TAU * frequency * t + phase)
        }
        Input::Sampled { times, values, .. } => {
            let last = times.len() - 1;
            let k = times.partition_point(|time| *time <= t).clamp(1, last);
            let share = ((t - times[k - 1]) / (times[k] - times[k - 1])).clamp(0.0, 1.0);
            values[k - 1] + share * (values[k] - values[k - 1])
        }
        _ => unreachable!("the setups have these inputs"),
    }
}

/// Returns the value before time 0 and the times of jumps and bends of an input.
fn past(input: &Input) -> (f64, Vec<f64>) {
    match input {
        Input::Step { time, before, .. } => (*before, vec![*time]),
        Input::Sampled { times, .. } => (value(input, 0.0), times.clone()),
        _ => (value(input, 0.0), Vec::new()),
    }
}

/// Simulates the twin of a setup with steps of at most this length, s.
pub fn simulate(setup: &Setup, times: &[f64], longest: f64) -> Signals {
    let body = BODIES.iter().find(|body| body.name == setup.plant).expect("the plant has a twin");
    let declared = |(placement, parameters): (&Placement, _)| {
        let companion = placement.companion.as_ref().map(|port| site(body, port));
        let (name, is_mutual) = (placement.effect.name(), placement.effect.mutual());
        Declared { name, site: site(body, &placement.port), companion, is_mutual, parameters }
    };
    let declared: Vec<Declared<'_>> =
        setup.placements.iter().zip(values(setup)).map(|(placement, values)| declared((placement, values))).collect();
    let (before, knots) = past(&setup.input);
    let value = |t: f64| value(&setup.input, t);
    let command = Command { value: &value, before, knots: &knots };
    let rows = twins::simulate(body, &declared, &command, times, longest);
    let names: Vec<&str> = setup.model.interface().signals.iter().map(|signal| &signal.name[..]).collect();
    let index = |name: &&str| body.states.iter().position(|state| state == name).unwrap_or(body.states.len());
    let order: Vec<usize> = names.iter().map(index).collect();
    rows.iter().map(|row| order.iter().map(|&i| (row[i], false)).collect()).collect()
}
