//! Registers: storage of numbers while a tape runs.

use mops_language::Scalar;

/// Index of a register.
pub type Register = u16;

/// Bank of registers.
pub trait Bank<S> {
    /// Creates a bank of `count` registers.
    fn with(count: usize) -> Self;
    /// Returns the number in a register.
    fn get(&self, register: Register) -> S;
    /// Writes a number to a register.
    fn set(&mut self, register: Register, value: S);
}

/// Number of registers whose index fits into a byte.
pub const FEW: usize = 256;

/// Bank of [`FEW`] registers: an index cannot be out of range, so it is not checked.
pub struct Small<S>(Box<[S; FEW]>);

/// Bank with any number of registers.
pub struct Large<S>(Vec<S>);

#[allow(clippy::cast_possible_truncation)]
impl<S: Scalar> Bank<S> for Small<S> {
    fn with(count: usize) -> Self {
        assert!(count <= FEW, "the size was checked");
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
