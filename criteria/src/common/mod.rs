//! Common parts of criteria: option parsing, the step of a response, the comparison with a measurement.

mod comparison;
mod error_integral;
mod linear;
mod options;
mod part;
mod step;

pub use comparison::{compare, compared_slopes};
pub use error_integral::ErrorIntegral;
pub use linear::{Channel, LinearCriterion, Of, Values, capped, feedback, poles};
pub use options::{NOT_NEGATIVE, number, optional, positive, second, step_time, trace};
pub use part::part;
pub use step::{Step, StepOptions};
