//! Loop transfer function of a PID controller and its plant.

use mops_core::{
    Analysis, AnalysisKind, Failure, Interface, Job, Model, ModelOptions, Parameter, StudyError, Variable,
    model::WithTangents,
};
use mops_language::Scalar;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::linear_system::{self, LinearSystem, Matrices, canonical};
use crate::rational::{PlantOptions, TransferFunction};

/// Loop transfer function of `pid-loop`, for stability margins and sensitivity peaks:
///
/// ```text
/// L(s) = k (1 + 1/(Ti s) + Td s/(Td/Nd s + 1)) G(s) exp(-s delay)
/// ```
///
/// Parameters: `k` gain, `Ti` integral time and `Td` derivative time (s; `Ti = inf` for no integral, `Td = 0` for no
/// derivative), `Nd` filter ratio of the derivative (default 10), `delay` of the loop (s, default 0), and every name
/// given in place of a number in the plant. The names are those of `pid-loop`, so that one set of tuners sets both
/// models of a study.
///
/// Signal: `y`. Input: the control error `e`.
///
/// Source: K. J. Astrom, T. Hagglund, PID Controllers, 2nd edition (1995), sections 3.4 and 4.2.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct PidOpenLoopOptions {
    /// Plant, as in `pid-loop`: `{ poles = [...], zeros = [...], gain = 1.0 }`, or
    /// `{ numerator = [...], denominator = [...] }` with coefficients of descending powers of s, or
    /// `{ a = [[...], ...], b = [...], c = [...] }` with state-space matrices. A name instead of a number becomes a
    /// parameter.
    plant: PlantOptions,
}

/// Controller parameters and the delay; those named in the plant come after them.
const OWN: [&str; 5] = ["k", "Ti", "Td", "Nd", "delay"];

/// Model of the kind `pid-open-loop`.
struct PidOpenLoop {
    interface: Interface,
    plant: TransferFunction,
}

impl ModelOptions for PidOpenLoopOptions {
    const KIND: &'static str = "pid-open-loop";

    fn build(self) -> Result<Box<dyn Model>, StudyError> {
        let mut names = Vec::new();
        let plant = TransferFunction::new(&self.plant, &OWN, &mut names).map_err(|m| m.within("plant"))?;
        let positive = |name, unit, about| Parameter::new(name, unit, about).within(f64::MIN_POSITIVE, f64::INFINITY);
        let from_zero = |name, unit, about| Parameter::new(name, unit, about).within(0.0, f64::INFINITY);
        let mut parameters = vec![
            Parameter::new("k", "1", "gain of the controller"),
            positive("Ti", "s", "integral time").or_infinite(),
            from_zero("Td", "s", "derivative time"),
            positive("Nd", "1", "filter ratio of the derivative").with_default(10.0),
            from_zero("delay", "s", "delay of the loop").with_default(0.0),
        ];
        parameters.extend(names.iter().map(|name| Parameter::new(name, "1", "parameter of the plant")));
        let interface = Interface {
            signals: vec![Variable::new("y", "1", "output of the plant")],
            inputs: vec![Variable::new("e", "1", "control error")],
            parameters,
            analysis: AnalysisKind::Linear,
            ..Interface::default()
        };
        Ok(Box::new(PidOpenLoop { interface, plant }))
    }
}

impl LinearSystem for PidOpenLoop {
    fn matrices<S: Scalar>(&self, parameters: &[S]) -> Result<Matrices<S>, Failure> {
        let ([k, ti, td, nd, delay], named) = (
            <[S; 5]>::try_from(&parameters[..OWN.len()]).expect("the study gives every parameter"),
            &parameters[OWN.len()..],
        );
        let (numerator, denominator) = self.plant.polynomials(named)?;
        let n = denominator.len();
        let states = (1..=n).map(|i| format!("x{i}")).collect();
        let mut m = canonical(&numerator, &denominator, states, Some(delay));
        // An absent integral or derivative has no state, which would be an uncontrollable mode.
        let mut through = k;
        let zero = S::from(0.0);
        let add = |m: &mut Matrices<S>, name: &str, rate: S, input: S, effect: S| {
            m.a.iter_mut().for_each(|row| row.push(zero));
            m.a.push(vec![zero; m.a[0].len()]);
            let last = m.a.len() - 1;
            m.a[last][last] = rate;
            m.a[n - 1][last] = effect;
            m.b.push(vec![input]);
            m.c[0].push(zero);
            m.states.push(name.to_owned());
        };
        if ti.value().is_finite() {
            add(&mut m, "integral", zero, k / ti, S::from(1.0));
        }
        if td.value() > 0.0 {
            let filter = nd / td;
            add(&mut m, "filtered", -filter, filter, -(k * nd));
            through += k * nd;
        }
        m.b[n - 1][0] = through;
        Ok(m)
    }

    fn channels(&self) -> [Vec<String>; 2] {
        [vec!["e".to_owned()], vec!["y".to_owned()]]
    }
}

impl Model for PidOpenLoop {
    fn interface(&self) -> &Interface {
        &self.interface
    }

    fn analyse(&self, job: &Job<'_>) -> Result<Analysis, Failure> {
        linear_system::analyse(self, job)
    }

    fn tangents(&self, job: &Job<'_>, seeds: &[Vec<f64>]) -> Option<Result<WithTangents, Failure>> {
        // Without a derivative the model has one state less, so the tangent with respect to `Td` is not available.
        let bare = job.parameters[2] == 0.0 && seeds.iter().any(|seed| seed[2] != 0.0);
        (!bare).then(|| linear_system::tangents(self, job, seeds))
    }
}
