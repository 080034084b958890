//! Elementary functions that are bit-identical on every machine: those of the crate `libm`, and integer powers by
//! products.
//!
//! The functions of `f64` call the C library of the system. Its kernels depend on the processor, so that the last digit
//! may differ; clippy forbids them. Only operations that IEEE 754 rounds correctly remain methods of `f64`: the four
//! arithmetic operations, `sqrt`, `abs`, `floor` and similar, `%`. `libm` is Rust code based on these alone. It uses
//! processor-specific code only for exact operations (square root, fused multiply-add).
//!
//! Errors are below 1 unit in the last place. They are below 2 for `sinh`, `cosh`, `tanh`, their inverses, `atan2` and
//! `erfc` (tests/references.rs).

pub mod complex;
mod elementary;
mod layers;
mod normal;
mod random;
pub mod rough;

pub use elementary::{
    acos, acosh, asin, asinh, atan, atan2, atanh, cbrt, cos, cosh, erfc, exp, exp_m1, exp2, hypot, ln, ln_1p, ln_gamma,
    log2, log10, mul_add, powf, powi, sin, sin_cos, sinh, tan, tanh,
};
pub use normal::normal;
pub use random::{Stream, stream};
