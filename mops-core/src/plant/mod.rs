//! Plants: the equations of a model at given parameters, with inputs and forces as arguments.
//!
//! A plant is `x' = f(t, x, u, w)` with a mode, between whose changes `f` is smooth. What only some plants have is a
//! part of its own, which the plant returns if it has it: [`Events`], [`Breaks`], [`Memory`], [`Jacobian`], [`Bounds`].
//!
//! # Order of the calls
//!
//! The simulation calls, where the part exists:
//!
//! 1. [`Plant::start`];
//! 2. [`Memory::begin`] at the earliest time from which on inputs are known and matter, [`Memory::follow`] and
//!    [`Memory::remember`] over each stretch of the past, and [`Memory::jump`] where inputs jump in it;
//! 3. [`Plant::begin`] with the inputs just before the start, then [`Plant::can_start`] with those from the start on;
//! 4. at the start, and at every jump of an input or a force: [`Memory::jump`], [`Breaks::pass`], [`Plant::settle`];
//! 5. once, at the start: [`Events::arm`];
//! 6. within a step: [`Plant::rates`], [`Jacobian::entries`]; after it [`Events::guard`], [`Bounds::of_guard`] and
//!    [`Plant::signal`], then [`Memory::remember`];
//! 7. where a guard has become negative, [`Events::switch`], or [`Events::rest`] if its events accumulate;
//! 8. where a step reaches [`Breaks::next`] or a jump of an input, the calls of 4.
//!
//! A linearisation calls [`Memory::hold`], then [`Plant::linearise`], and then [`Plant::rates`], [`Breaks::changes`],
//! [`Plant::signal`] and [`Memory::past`].

mod instant;
mod interface;
mod parts;
mod ported;
mod tolerance;

pub use tolerance::{IntegrationMethod, Tolerance};

pub use parts::{Bounds, Breaks, EventInstant, Events, InputRates, Jacobian, Memory, Past, Span, Stretch};
pub use ported::{PlantScalar, Ported};

pub use instant::Instant;
pub use interface::{LeftOut, Plant, Selected};
