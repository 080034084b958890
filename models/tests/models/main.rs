//! Models and the simulation kernel, compared with closed forms and published values, in one program for all of them.

mod equations;
mod from_fn;
mod kernel;
mod linear;
mod rational;
mod simulated;
mod with_effects;
