//! Stick-slip motion, compared with closed forms.

use mops_language::{Dual, Scalar};
use mops_math as math;
use mops_models::kernel::elements::BearingFriction;
use mops_models::kernel::friction::Contact;
use mops_models::kernel::mechanism::{Bodies, Joint, Mechanism};
use mops_models::kernel::{Driven, Inputs, Sink, Step, Tolerance, integrate};

const TIGHT: Tolerance = Tolerance { relative: 1e-11, absolute: Some(1e-12), max_steps: 100_000, ..Tolerance::DEFAULT };

const fn joint(events: [&'static str; 4]) -> Joint {
    Joint { angle: "q", about: "joint", start: 0.0, events }
}

const FIRST: Joint = joint(["first sticks", "first slides", "first driven", "first braked"]);
const SECOND: Joint = joint(["second sticks", "second slides", "second driven", "second braked"]);

/// Creates a mechanism that starts from this state.
fn mechanism<S: Scalar, B: Bodies<S, N>, const N: usize>(
    bodies: B,
    friction: [BearingFriction<S>; N],
    joints: &[Joint; N],
    start: &[S],
) -> Driven<'static, S, Mechanism<S, B, N>>
where
    Mechanism<S, B, N>: 'static,
{
    Driven::new(Mechanism::new(bodies, friction, joints, start), Inputs::new(Vec::new(), N), &[])
}

#[derive(Default)]
struct Events(Vec<(f64, String)>);

impl<S: Scalar, P: ?Sized> Sink<S, P> for Events {
    fn step(&mut self, _: &Step<S>, _: &Driven<'_, S, P>) {}
    fn reads_steps(&self) -> bool {
        false
    }
    fn event(&mut self, t: f64, what: &str) {
        self.0.push((t, what.to_owned()));
    }
}

/// Block of mass `m` on a belt with speed `belt`, restrained by a spring `k`; the coordinate is the position on the
/// belt.
struct Block<S> {
    m: f64,
    k: S,
    belt: f64,
}

impl<S: Scalar> Bodies<S, 1> for Block<S> {
    fn mass_and_force(&self, t: f64, _: &[S], q: &[S; 1], _: &[S; 1]) -> ([[S; 1]; 1], [S; 1]) {
        ([[S::from(self.m)]], [-self.k * (q[0] + self.belt * t)])
    }
}

#[test]
fn a_block_on_a_belt_sticks_and_slips_with_the_period_of_the_closed_form() {
    // The block sticks up to the break-away force, then oscillates about the sliding force until it has the speed of
    // the belt again. With A = (peak - 1) F/k and w = sqrt(k/m): slip for 2 (pi - atan(A w/v))/w, stick for 2 A/v.
    let (m, k, belt, force, peak) = (0.5, 20.0, 0.3, 2.0, 1.4);
    let friction = BearingFriction::new(&[[0.0, force], [1.0, force]], peak).unwrap();
    let mut block = mechanism(Block { m, k, belt }, [friction], &[FIRST], &[0.0, 0.0]);
    let mut events = Events::default();
    integrate(&mut block, 0.0, 20.0, &[0.0, 0.0], &TIGHT, &mut events).unwrap();
    let w = f64::sqrt(k / m);
    let amplitude = (peak - 1.0) * force / k;
    let slip = 2.0 * (std::f64::consts::PI - math::atan(amplitude * w / belt)) / w;
    let stick = 2.0 * amplitude / belt;
    let (released, what) = events.0[0].clone();
    assert!(what == "first slides" && (released - peak * force / (k * belt)).abs() < 1e-9, "{released}");
    assert!(events.0.len() >= 20);
    for (i, pair) in events.0.windows(2).enumerate() {
        let (exact, what) = if i % 2 == 0 { (slip, "first sticks") } else { (stick, "first slides") };
        assert_eq!(pair[1].1, what);
        assert!((pair[1].0 - pair[0].0 - exact).abs() < 1e-8, "{i}: {} is not {exact}", pair[1].0 - pair[0].0);
    }
}

#[test]
fn tangents_of_the_position_of_a_block_on_a_belt_agree_with_differences() {
    let (m, belt, force, peak) = (0.5, 0.3, 2.0, 1.4);
    let end = |k: f64| {
        let friction = BearingFriction::new(&[[0.0, force], [1.0, force]], peak).unwrap();
        let mut block = mechanism(Block { m, k, belt }, [friction], &[FIRST], &[0.0, 0.0]);
        integrate(&mut block, 0.0, 5.0, &[0.0, 0.0], &TIGHT, &mut ()).unwrap().0[0]
    };
    let fixed = Dual::<1>::from;
    let table = [[fixed(0.0), fixed(force)], [fixed(1.0), fixed(force)]];
    let friction = BearingFriction::new(&table, fixed(peak)).unwrap();
    let block = Block { m, k: Dual::variable(20.0, 0), belt };
    let mut block = mechanism(block, [friction], &[FIRST], &[fixed(0.0); 2]);
    let (x, _) = integrate(&mut block, 0.0, 5.0, &[fixed(0.0); 2], &TIGHT, &mut ()).unwrap();
    let difference = (end(20.001) - end(19.999)) / 0.002;
    assert!(x[0].value == end(20.0) && (x[0].tangent[0] - difference).abs() < 1e-6, "{x:?} {difference}");
}

/// Two joints, each with a force that increases with time: `rate t`.
struct Pulled {
    mass: [[f64; 2]; 2],
    rate: [f64; 2],
}

impl Bodies<f64, 2> for Pulled {
    fn mass_and_force(&self, t: f64, _: &[f64], _: &[f64; 2], _: &[f64; 2]) -> ([[f64; 2]; 2], [f64; 2]) {
        (self.mass, self.rate.map(|rate| rate * t))
    }
}

/// Creates constant friction.
fn dry(force: f64, peak: f64) -> BearingFriction<f64> {
    BearingFriction::new(&[[0.0, force]], peak).unwrap()
}

#[test]
fn two_joints_stuck_at_once_are_released_in_turn() {
    // Joint 1 breaks away at t = 1 and accelerates with (t - 1)/2. It exerts (t - 1)/4 on joint 2, besides the own
    // force t/4. Depending on the sign of the coupling, the friction of joint 2 is constant at t/4 - (t - 1)/4 = 1/4,
    // or t/4 + (t - 1)/4 reaches 2 at t = 4.5.
    for (coupling, second) in [(0.5, None), (-0.5, Some(4.5))] {
        let bodies = Pulled { mass: [[2.0, coupling], [coupling, 1.0]], rate: [1.0, 0.25] };
        let mut pair = mechanism(bodies, [dry(1.0, 1.0), dry(2.0, 1.0)], &[FIRST, SECOND], &[0.0; 4]);
        let mut events = Events::default();
        let (x, _) = integrate(&mut pair, 0.0, 6.0, &[0.0; 4], &TIGHT, &mut events).unwrap();
        assert!((events.0[0].0 - 1.0).abs() < 1e-9 && events.0[0].1 == "first slides", "{:?}", events.0);
        match second {
            None => assert!(events.0.len() == 1 && x[2] == 0.0 && x[3] == 0.0, "{:?}", events.0),
            Some(t) => {
                assert_eq!(events.0.len(), 2, "{:?}", events.0);
                assert!((events.0[1].0 - t).abs() < 1e-9 && events.0[1].1 == "second slides", "{:?}", events.0);
                // Up to this time x1 = (t - 1)^3/12.
                assert!(x[3] > 0.0);
            }
        }
    }
}

#[test]
fn one_joint_that_breaks_away_can_tear_the_other_loose_at_once() {
    // When joint 1 breaks away at 2, the force exceeds sliding friction by 1 N m. The acceleration is 0.5, which exerts
    // 0.25 on joint 2. The limit of joint 2 is 0.2, so it breaks away at the same instant, not a step later.
    let bodies = Pulled { mass: [[2.0, 0.5], [0.5, 1.0]], rate: [1.0, 0.0] };
    let mut pair = mechanism(bodies, [dry(1.0, 2.0), dry(0.2, 1.0)], &[FIRST, SECOND], &[0.0; 4]);
    let mut events = Events::default();
    let (x, _) = integrate(&mut pair, 0.0, 3.0, &[0.0; 4], &TIGHT, &mut events).unwrap();
    assert_eq!(events.0.len(), 1, "{:?}", events.0);
    assert_eq!(pair.plant.contact(), &[Contact::Forward, Contact::Backward]);
    // Both joints slide: 2 a1 + a2/2 = t - 1, a1/2 + a2 = 0.2; Cramer's rule with determinant 1.75.
    let a2 = |t: f64| (2.0 * 0.2 - 0.5 * (t - 1.0)) / 1.75;
    // Integral of the linear a2 from 2 to 3: its value in the middle.
    assert!((x[3] - a2(2.5)).abs() < 1e-9, "{x:?}");
}

/// Chain of two masses between springs, excited periodically.
struct Chain;

impl Bodies<f64, 2> for Chain {
    fn mass_and_force(&self, t: f64, _: &[f64], q: &[f64; 2], _: &[f64; 2]) -> ([[f64; 2]; 2], [f64; 2]) {
        let push = 1.3 * math::sin(2.0 * t);
        ([[1.0, 0.3], [0.3, 0.7]], [push - 4.0 * q[0] + 2.0 * q[1], 2.0 * q[0] - 4.0 * q[1]])
    }
}

#[test]
fn joints_that_stick_and_slide_for_long_never_chatter() {
    let fine = Tolerance { max_step: Some(0.2), ..TIGHT };
    for peak in [1.0, 1.000_1, 1.3] {
        for force in [0.05, 0.4, 0.9, 1.2] {
            for other in [0.02, 0.3, 0.7] {
                let friction =
                    [dry(force, peak), BearingFriction::new(&[[0.0, other], [0.1, 0.2], [1.0, 0.5]], peak).unwrap()];
                let mut chain = mechanism(Chain, friction, &[FIRST, SECOND], &[0.5, 0.0, -0.2, 0.0]);
                let mut events = Events::default();
                integrate(&mut chain, 0.0, 50.0, &[0.5, 0.0, -0.2, 0.0], &fine, &mut events).unwrap();
                // 16 periods, with at most a few stops of a joint in each.
                assert!(events.0.len() < 200, "{peak} {force} {other}: {}", events.0.len());
            }
        }
    }
}
