//! Registers: where numbers stand while a tape runs.

use mops_core::Scalar;

/// Place of a number.
pub type Register = u16;

/// Numbers by register.
pub trait Bank<S> {
    /// A bank with room for this many.
    fn with(count: usize) -> Self;
    /// The number in a register.
    fn get(&self, register: Register) -> S;
    /// Writes a register.
    fn set(&mut self, register: Register, value: S);
}

/// Registers whose number fits into a byte.
pub const FEW: usize = 256;

/// Room for [`FEW`] registers: an index cannot be out of range, so none is checked.
pub struct Small<S>(Box<[S; FEW]>);

/// Any number of registers.
pub struct Large<S>(Vec<S>);

#[allow(clippy::cast_possible_truncation)]
impl<S: Scalar> Bank<S> for Small<S> {
    fn with(count: usize) -> Self {
        assert!(count <= FEW, "the size was looked at");
        Self(Box::new([S::from(0.0); FEW]))
    }
    #[inline(always)]
    fn get(&self, register: Register) -> S {
        self.0[usize::from(register as u8)]
    }
    #[inline(always)]
    fn set(&mut self, register: Register, value: S) {
        self.0[usize::from(register as u8)] = value;
    }
}

impl<S: Scalar> Bank<S> for Large<S> {
    fn with(count: usize) -> Self {
        Self(vec![S::from(0.0); count])
    }
    #[inline(always)]
    fn get(&self, register: Register) -> S {
        self.0[usize::from(register)]
    }
    #[inline(always)]
    fn set(&mut self, register: Register, value: S) {
        self.0[usize::from(register)] = value;
    }
}
