//! Units of measure, and quantities such as `"15 s"`.

mod conversion;
mod dimension;
mod quantity;
mod symbols;

pub use conversion::Unit;
pub use dimension::Dimension;
pub use quantity::Quantity;
