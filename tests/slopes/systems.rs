//! Systems whose signals jump or bend at times that depend on parameters.

use std::sync::Arc;

use mops::{Model, models::equations::EquationsOptions};
use mops_core::{Input, ModelOptions};

use super::plants::Setup;

/// Name, equations, and values of the parameters.
type System = (&'static str, &'static str, &'static [f64]);

/// Systems with two signals each.
const SYSTEMS: [System; 17] = [
    (
        "bouncing ball, rebound e, gravity g",
        "states     = { h = '1', v = '1' }
         parameters = { e = '1', g = '1' }
         der        = { h = \"1 [s]*h' = v\", v = \"1 [s]*v' = -g\" }
         start      = { h = 1 }
         when.floor = { guard = 'h', reset = { h = 0, v = '-e*v' } }",
        &[0.8, 4.0],
    ),
    (
        "sawtooth with slope a up to b",
        "states     = { x = '1', n = '1' }
         parameters = { a = '1', b = '1' }
         der        = { x = \"1 [s]*x' = a\", n = \"1 [s]*n' = -n\" }
         when.top   = { guard = 'b - x', reset = { x = '0', n = 'n + 1' } }",
        &[0.7, 0.9],
    ),
    (
        "thermostat with loss a, power p and threshold lo",
        "states     = { T = '1', on = '1' }
         parameters = { a = '1', p = '1', lo = '1' }
         der        = { T = \"1 [s]*T' = -a*T + p*on\", on = '0' }
         start      = { T = 0, on = 1 }
         when.off   = { guard = '1 - T', reset = { on = '0' } }
         when.on    = { guard = 'T - lo', reset = { on = '1' } }",
        &[0.7, 2.1, 0.6],
    ),
    (
        "output with a condition on a state",
        "states     = { x = '1' }
         parameters = { a = '1', c = '1' }
         der        = { x = \"1 [s]*x' = 1 - a*x\" }
         outputs    = { y = 'if(x > c, 0.2 + x, -0.3)' }",
        &[0.9, 0.55],
    ),
    (
        "output with the sign of a speed",
        "states     = { x = '1', v = '1' }
         parameters = { a = '1' }
         der        = { x = \"1 [s]*x' = v\", v = \"1 [s]*v' = -a*x - 0.2*v\" }
         start      = { x = 1 }
         outputs    = { z = '0.5*sign(v) + x', w = 'x' }",
        &[6.0],
    ),
    (
        "delayed step",
        "states     = { x = '1' }
         inputs     = { u = '1' }
         parameters = { T = 's' }
         der        = { x = \"1 [s]*x' = u - x\" }
         outputs    = { y = 'delay(u, T)' }",
        &[0.713],
    ),
    (
        "delayed output with a direct part",
        "states     = { x = '1' }
         inputs     = { u = '1' }
         parameters = { T = 's', a = '1' }
         let        = { q = 'u - a*x' }
         der        = { x = \"1 [s]*x' = q\" }
         outputs    = { y = 'delay(q, T)' }",
        &[0.713, 0.8],
    ),
    (
        "feedback through a delay",
        "states     = { x = '1' }
         inputs     = { u = '1' }
         parameters = { T = 's', a = '1' }
         der        = { x = \"1 [s]*x' = u - a*delay(x, T)\" }
         outputs    = { y = 'u - delay(x, T)' }",
        &[0.371, 0.8],
    ),
    (
        "corner of two ramps",
        "states     = { x = '1' }
         parameters = { a = '1', b = '1' }
         let        = { y = 'min(a*time/1 [s], 2 - b*time/1 [s])' }
         der        = { x = \"1 [s]*x' = y - x\" }
         outputs    = { y = 'y' }",
        &[0.7, 0.9],
    ),
    (
        "saturated feedback",
        "states     = { x = '1' }
         inputs     = { u = '1' }
         parameters = { k = '1', m = '1' }
         let        = { f = 'clip(k*(u - x), -m, m)' }
         der        = { x = \"1 [s]*x' = f\" }
         outputs    = { f = 'f' }",
        &[3.0, 0.4],
    ),
    (
        "dry friction of an oscillator",
        "states     = { x = 'm', v = 'm/s' }
         inputs     = { u = 'N' }
         parameters = { k = 'N/m', c = 'N' }
         der        = { x = 'v', v = \"1 [kg]*v' = u - k*x\" }
         friction   = { x = { coulomb = 'c' } }",
        &[9.0, 0.3],
    ),
    (
        "sampled controller",
        "states     = { x = '1' }
         inputs     = { u = '1' }
         parameters = { k = '1', Ti = '1' }
         der        = { x = \"1 [s]*x' = k*m - x\" }
         outputs    = { y = 'm' }
         clocks.c   = { every = '100 ms', memory = { m = '1' }, next = { m = 'm + (u - x)/Ti' } }",
        &[0.9, 5.0],
    ),
    // Instants that coincide at the given values, and part with them.
    (
        "two thresholds at one value",
        "states     = { x = '1' }
         parameters = { p = '1', q = '1' }
         der        = { x = \"1 [s]*x' = 2.1 - 0.7*x\" }
         outputs    = { y = 'if(x > p, 1, 0)', z = 'if(x > q, 1, 0)' }",
        &[0.8, 0.8],
    ),
    (
        "two switches at one time",
        "states     = { x = '1', z = '1' }
         parameters = { p = 's', q = 's' }
         der        = { x = \"1 [s]*x' = if(time > p, 1, 0) - x\", z = \"1 [s]*z' = if(time > q, 1, 0) - z\" }",
        &[0.5, 0.5],
    ),
    (
        "two bouncing balls",
        "states     = { h = '1', v = '1', k = '1', w = '1' }
         parameters = { d = '1', e = '1' }
         der        = { h = \"1 [s]*h' = v\", v = \"1 [s]*v' = -4\", k = \"1 [s]*k' = w\", w = \"1 [s]*w' = -4\" }
         start      = { h = 1, k = 1 }
         when.one   = { guard = 'h', reset = { h = 0, v = '-d*v' } }
         when.two   = { guard = 'k', reset = { k = 0, w = '-e*w' } }",
        &[0.7, 0.7],
    ),
    (
        "two equal delays",
        "states     = { x = '1', z = '1' }
         inputs     = { u = '1' }
         parameters = { p = 's', q = 's' }
         let        = { a = 'delay(u, p)', b = 'delay(2*u, q)' }
         der        = { x = \"1 [s]*x' = a - x\", z = \"1 [s]*z' = b - z\" }",
        &[0.5, 0.5],
    ),
    (
        "a threshold reached at a step of the input",
        "states     = { x = '1', z = '1' }
         inputs     = { u = '1' }
         parameters = { p = 's' }
         der        = { x = \"1 [s]*x' = u - x\", z = \"1 [s]*z' = if(time > p, 1, 0) - z\" }",
        &[0.413],
    ),
];

/// Returns all systems, with a step as the input.
pub fn systems() -> Vec<Setup> {
    let system = |&(name, text, values): &System| {
        let text = format!("{text}\ntolerance = {{ relative = 1e-10 }}");
        let options: EquationsOptions = toml::from_str(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let model: Arc<dyn Model> = Arc::from(options.build().unwrap_or_else(|error| panic!("{name}: {error:?}")));
        let own = &model.interface().parameters;
        let parameters = own.iter().enumerate().map(|(i, p)| p.default.unwrap_or_else(|| values[i])).collect();
        let input = Input::Step { time: 0.413, before: 0.2, after: 1.0 };
        Setup {
            name: name.to_owned(),
            effects: name.to_owned(),
            plant: name,
            placements: Vec::new(),
            varied: (0..values.len()).collect(),
            model,
            parameters,
            input,
        }
    };
    SYSTEMS.iter().map(system).collect()
}
