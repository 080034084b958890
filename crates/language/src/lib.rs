//! What a study file may say: quantities with units, expressions, and errors that show their place.
//!
//! | module | content |
//! |---|---|
//! | [`mod@unit`] | [`Unit`] and [`Quantity`]: symbols, dimensions, conversions |
//! | [`expression`] | [`Expression`]: formulas over names, evaluated with any [`Scalar`] and checked for dimensions |
//! | [`enclosure`] | bounds of a quantity and of its rate over an interval of time |
//! | [`files`] | where a study finds its data files |
//! | [`entries`] | tables with any keys, and strings as a short form of tables |
//! | [`plain`] | control characters of untrusted text, escaped |
//!
//! [`Scalar`] is a number or a dual number ([`Dual`]): a formula written once gives values and exact derivatives.
//! [`Diagnostic`] is an error with its place in a [`Source`] and the way out.

mod diagnostic;
pub mod enclosure;
pub mod entries;
pub mod expression;
pub mod files;
pub mod plain;
mod scalar;
pub mod unit;

pub use diagnostic::{Diagnostic, Source, nearest, suggestion};
pub use expression::Expression;
pub use scalar::{DIRECTIONS, Dual, Dual7, Scalar};
pub use unit::{Quantity, Unit};
